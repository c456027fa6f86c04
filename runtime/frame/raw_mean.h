#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/camera/gbuffer.h"

namespace packtrace {

/// Mean of raw AO over frames, for renders without the denoiser. Pixels may miss in some frames.
class RawMean {
public:
  void clear() { sum_.clear(); }
  /// @param frame of the same size as the others since clear()
  void add(const AoFrame& frame);
  /// Mean per pixel; kInvalidAo where all frames miss.
  std::vector<float> result() const;

  std::vector<std::byte> save() const;
  /// @return false if the bytes are not those of save() for that number of pixels
  bool restore(size_t pixels, std::span<const std::byte> bytes);

private:
  std::vector<double> sum_;
  std::vector<uint32_t> count_;
};

} // namespace packtrace
