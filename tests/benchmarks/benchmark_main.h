#pragma once

#include <exception>

#include <fmt/format.h>

#include "pbrt_import/scene/error.h"

namespace packtrace {

/// main() of a benchmark: run(argc, argv), its errors to stderr behind the name.
/// @return the exit code
template <class Run>
int benchmark_main(const char* name, Run run, int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const Error& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
    return error.exit_code();
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
    return 1;
  }
}

} // namespace packtrace
