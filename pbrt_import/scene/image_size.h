#pragma once

#include <cstddef>
#include <cstdint>

namespace packtrace {

struct ImageSize {
  uint32_t width = 0;  ///< pixels
  uint32_t height = 0; ///< pixels
  size_t pixels() const { return static_cast<size_t>(width) * height; }
  bool operator==(const ImageSize&) const = default;
};

} // namespace packtrace
