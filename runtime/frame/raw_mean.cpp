#include "runtime/frame/raw_mean.h"

#include <algorithm>
#include <cstring>

namespace packtrace {

void RawMean::add(const AoFrame& frame) {
  if (sum_.empty()) sum_.assign(frame.ao.size(), 0.0), count_.assign(frame.ao.size(), 0);
  for (size_t i = 0; i < sum_.size(); ++i)
    if (frame.ao[i] >= 0.0f) sum_[i] += static_cast<double>(frame.ao[i]), ++count_[i];
}

std::vector<float> RawMean::result() const {
  std::vector<float> mean(sum_.size(), kInvalidAo);
  for (size_t i = 0; i < mean.size(); ++i)
    if (count_[i] > 0) mean[i] = static_cast<float>(sum_[i] / static_cast<double>(count_[i]));
  return mean;
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
