#include "runtime/frame/raw_mean.h"

#include <algorithm>
#include <cstring>

namespace packtrace {
namespace {

/// Mean of the valid values on the square of half side `reach` around a pixel: of those in its row and column if there
/// are any, else of all; kInvalidAo if there are none.
float mean_around(ImageSize size, std::span<const float> values, uint32_t x, uint32_t y, uint32_t reach) {
  double near_sum = 0.0, sum = 0.0;
  uint32_t near_count = 0, count = 0;
  const auto add = [&](int64_t column, int64_t row) {
    if (column < 0 || row < 0 || column >= size.width || row >= size.height) return;
    const float value = values[static_cast<size_t>(row) * size.width + static_cast<size_t>(column)];
    if (!(value >= 0.0f)) return;
    sum += static_cast<double>(value), ++count;
    if (column == x || row == y) near_sum += static_cast<double>(value), ++near_count;
  };
  const int64_t r = reach, cx = x, cy = y;
  for (int64_t d = -r; d <= r; ++d) add(cx + d, cy - r), add(cx + d, cy + r);
  for (int64_t d = 1 - r; d < r; ++d) add(cx - r, cy + d), add(cx + r, cy + d);
  if (near_count > 0) return static_cast<float>(near_sum / near_count);
  return count > 0 ? static_cast<float>(sum / count) : kInvalidAo;
}

} // namespace

void RawMean::add(const AoFrame& frame) {
  if (sum_.empty()) sum_.assign(frame.ao.size(), 0.0), count_.assign(frame.ao.size(), 0);
  for (size_t i = 0; i < sum_.size(); ++i)
    if (frame.ao[i] >= 0.0f) sum_[i] += static_cast<double>(frame.ao[i]), ++count_[i];
}

std::vector<float> RawMean::result(ImageSize size, std::span<const uint32_t> instances) const {
  std::vector<float> mean(sum_.size(), kInvalidAo);
  for (size_t i = 0; i < mean.size(); ++i)
    if (count_[i] > 0) mean[i] = static_cast<float>(sum_[i] / static_cast<double>(count_[i]));
  if (std::ranges::max(count_) == 0) return mean;
  std::vector<float> filled = mean;
  for (uint32_t y = 0; y < size.height; ++y)
    for (uint32_t x = 0; x < size.width; ++x) {
      const size_t i = static_cast<size_t>(y) * size.width + x;
      if (count_[i] > 0 || instances[i] == kNoInstance) continue;
      for (uint32_t reach = 1; filled[i] == kInvalidAo; ++reach) filled[i] = mean_around(size, mean, x, y, reach);
    }
  return filled;
}

std::vector<std::byte> RawMean::save() const {
  if (sum_.empty()) return {};
  const auto sums = std::as_bytes(std::span(sum_)), counts = std::as_bytes(std::span(count_));
  std::vector<std::byte> bytes(sums.size() + counts.size());
  std::ranges::copy(counts, std::ranges::copy(sums, bytes.begin()).out);
  return bytes;
}

bool RawMean::restore(size_t pixels, std::span<const std::byte> bytes) {
  clear();
  if (bytes.empty()) return true;
  if (bytes.size() != pixels * (sizeof(double) + sizeof(uint32_t))) return false;
  sum_.resize(pixels), count_.resize(pixels);
  std::memcpy(sum_.data(), bytes.data(), pixels * sizeof(double));
  std::memcpy(count_.data(), bytes.data() + pixels * sizeof(double), pixels * sizeof(uint32_t));
  return true;
}

} // namespace packtrace
