#include "runtime/frame/shaded_mean.h"

#include <algorithm>
#include <cstring>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace packtrace {

void ShadedMean::add(const ShadedFrame& frame) {
  if (frames_ == 0) means_.assign(frame.size.pixels(), {});
  ++frames_;
  const float share = 1.0f / static_cast<float>(frames_);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, means_.size(), 4096), [&](const tbb::blocked_range<size_t>& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) {
      Means& mean = means_[i];
      mean.direct += (frame.direct[i] - mean.direct) * share;
      mean.specular += (frame.specular[i] - mean.specular) * share;
      mean.ambient += (frame.ambient[i] - mean.ambient) * share;
    }
  });
}

void ShadedMean::resolve(const FrameConfig& config, std::span<const float> ao, RenderedImage& image) const {
  const uint32_t factor = config.supersample;
  const uint32_t width = config.traced_size().width;
  const size_t pixels = config.size.pixels();
  image.pbr.assign(pixels, Vec3(0)), image.direct.assign(pixels, Vec3(0)), image.specular.assign(pixels, Vec3(0));
  const float scale = 1.0f / static_cast<float>(factor * factor);
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, config.size.height, 8), [&](const auto& rows) {
    for (uint32_t y = rows.begin(); y < rows.end(); ++y)
      for (uint32_t x = 0; x < config.size.width; ++x) {
        Means sum;
        for (uint32_t sub = 0; sub < factor * factor; ++sub) {
          const size_t in = (size_t{y} * factor + sub / factor) * width + size_t{x} * factor + sub % factor;
          const float open = config.view == FrameView::kPbrAo && ao[in] >= 0.0f ? ao[in] : 1.0f;
          sum.direct += means_[in].direct, sum.specular += means_[in].specular;
          sum.ambient += means_[in].ambient * open;
        }
        const size_t out = size_t{y} * config.size.width + x;
        image.direct[out] = sum.direct * scale, image.specular[out] = sum.specular * scale;
        image.pbr[out] = (sum.direct + sum.specular + sum.ambient) * scale;
      }
  });
}

std::vector<std::byte> ShadedMean::save() const {
  if (empty()) return {};
  const auto means = std::as_bytes(std::span(means_));
  std::vector<std::byte> bytes(sizeof frames_ + means.size());
  std::memcpy(bytes.data(), &frames_, sizeof frames_);
  std::ranges::copy(means, bytes.begin() + sizeof frames_);
  return bytes;
}

bool ShadedMean::restore(size_t pixels, std::span<const std::byte> bytes) {
  clear();
  if (bytes.empty()) return true;
  if (bytes.size() != sizeof frames_ + pixels * sizeof(Means)) return false;
  means_.resize(pixels);
  std::memcpy(&frames_, bytes.data(), sizeof frames_);
  std::memcpy(static_cast<void*>(means_.data()), bytes.data() + sizeof frames_, pixels * sizeof(Means));
  return frames_ > 0;
}

} // namespace packtrace
