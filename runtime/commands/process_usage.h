#pragma once

#include <cstdint>

namespace packtrace {

/// Peak resident memory of this process in bytes, including mapped file pages.
uint64_t peak_rss_bytes();

} // namespace packtrace
