#pragma once

#include "tests/end_to_end/workbench.h"

namespace packtrace::test {

/// A report of the small scene that stopped at a full disk and was continued. Tests share it, because it takes seconds.
struct MeasuredReport {
  MeasuredReport();

  Workbench bench; ///< the report is in its folder "report"
  CommandResult full, continued;
  bool work_left = false; ///< the folder of baked files was there after the first run
};

/// Returns the same report in every call.
const MeasuredReport& measured_report();

} // namespace packtrace::test
