#pragma once

#include <cstdint>

#include "tests/benchmarks/import_inputs.h"

namespace packtrace {

/// What one import took.
struct ImportTiming {
  double cpu_ms = 0;  ///< user and system, of the whole process that imported
  double wall_ms = 0; ///< of import_scene()
  double peak_rss_mib = 0;
};

/// Imports in a child process of its own, so that neither memory nor heap carry over from one import to the next. The
/// caller must not have started threads. Throws Error(kInput) if the import fails, or reports an error or other counts
/// than an input has that states them, Error(kIo) if there can be no child.
ImportTiming time_import(const ImportInput& input, uint32_t threads);

/// What plain loops over the same bytes take, in CPU time where nothing else is said.
struct Calibration {
  double copy_ms = 0; ///< memcpy from memory to memory; of PLY files: read() and memcpy
  /// std::from_chars to float for each number, other tokens skipped. Of PLY files these are 0.
  double scan_ms = 0;
  double scan_wall_ms = 0;            ///< wall time of that
  double two_thread_scan_wall_ms = 0; ///< wall time with half of the text for each of two threads
};

/// Measures them in a child process, like time_import().
Calibration calibrate(const ImportInput& input);

} // namespace packtrace
