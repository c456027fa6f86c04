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
  /// Mean per pixel; kInvalidAo where no ray of the camera hit. Pixels with a hit but without samples, of the other
  /// colour of a checkerboard, get the mean of their nearest neighbours that have some.
  /// @param instances kNoInstance for pixels without a hit
  std::vector<float> result(ImageSize size, std::span<const uint32_t> instances) const;

  std::vector<std::byte> save() const;
  /// @return false if the bytes are not those of save() for that number of pixels
  bool restore(size_t pixels, std::span<const std::byte> bytes);

private:
  std::vector<double> sum_;
  std::vector<uint32_t> count_;
};

} // namespace packtrace
