#pragma once

#include "runtime/lod/sharing_config.h"

namespace packtrace::test {

/// A scheme that shares only the coarsest cuts: every other instance has its own cut.
inline SharingConfig own_cuts() {
  SharingConfig config;
  config.shared_levels = 0;
  config.share_equal_cuts = false;
  return config;
}

} // namespace packtrace::test
