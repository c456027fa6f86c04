#include <cstdio>

// Part of benchmarks that are compiled for checks (PACKTRACE_UNITY), with little optimisation.
[[maybe_unused]] static const int notice =
    std::fputs("Compiled for checks, not for measuring: configure with -DPACKTRACE_UNITY= to measure.\n", stderr);
