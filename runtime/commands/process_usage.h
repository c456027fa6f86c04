#pragma once

#include <cstdint>

namespace packtrace {

/// Most memory this process ever had resident, bytes, mapped file pages included.
uint64_t peak_rss_bytes();

} // namespace packtrace
