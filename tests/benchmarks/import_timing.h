#pragma once

#include <cstdint>

#include "tests/benchmarks/import_inputs.h"

namespace packtrace {

/// Time and memory of one import.
struct ImportTiming {
  double cpu_ms = 0;  ///< user and system time of the whole importing process
  double wall_ms = 0; ///< of import_scene()
  double peak_rss_mib = 0;
};

/// Imports in a child process, so that memory and heap state do not carry over between imports. The caller must not
/// have started threads.
/// Throws Error(kInput) if the import fails or if its counts differ from those that the input states; for an input with
/// a stated triangle count, also if it reports a warning or an error. Throws Error(kIo) if no child process can be
/// started.
ImportTiming time_import(const ImportInput& input, uint32_t threads);

/// Times of plain loops over the same bytes; CPU time unless stated otherwise.
struct Calibration {
  double copy_ms = 0; ///< memcpy from memory to memory; for PLY files read() and memcpy
  /// std::from_chars to float for each number, skipping other tokens. These three are 0 for PLY files.
  double scan_ms = 0;
  double scan_wall_ms = 0;            ///< wall time of that scan
  double two_thread_scan_wall_ms = 0; ///< wall time with half of the text per thread
};

/// Measures the times in a child process, like time_import().
Calibration calibrate(const ImportInput& input);

} // namespace packtrace
