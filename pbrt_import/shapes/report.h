#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "pbrt_import/scene/diagnostics.h"

namespace packtrace {

/// Takes problems that a shape or file reader survived. line counts from 1 in the file being read; 0: no line known.
/// May be empty: then nobody listens.
using ReportFn = std::function<void(Severity severity, uint32_t line, std::string message)>;

} // namespace packtrace
