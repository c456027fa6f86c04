#pragma once

#include "pbrt_import/base/progress.h"

namespace packtrace {

/// For loops over triangles, rows or layers: throws Error(kCancelled) after Progress::cancel().
inline void stop_if_cancelled() {
  if (Progress::cancelled()) Progress().check_cancelled();
}

} // namespace packtrace
