#pragma once

#include <cstdint>
#include <string>

#include "runtime/measure/knobs.h"

namespace packtrace {

/// How a child process ended and what it used.
struct ChildResult {
  int exit_code = 0; ///< 0 if a signal ended it
  int signal = 0;    ///< 0 if it exited
  std::string error; ///< the end of its standard error, valid UTF-8
  double seconds = 0.0;
  double cpu_seconds = 0.0;
  uint64_t peak_bytes = 0; ///< largest resident set

  bool ok() const { return exit_code == 0 && signal == 0; }
};

/// Runs this program (/proc/self/exe) with other arguments and waits for it. Standard output is discarded. The child
/// ends with this process. On Progress::cancel(), the child is interrupted and waited for.
/// @param program another program to run; empty: this one
/// Throws Error(kIo) if no process can be started, Error(kCancelled).
ChildResult run_child(const Words& arguments, const std::string& program = {});

} // namespace packtrace
