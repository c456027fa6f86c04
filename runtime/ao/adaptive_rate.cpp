#include "runtime/ao/adaptive_rate.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

constexpr float kSameDepth = 0.02f; ///< relative difference up to which a depth is that of the same surface

template <typename Work>
void for_pixels(size_t count, const Work& work) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 1u << 14), [&](const tbb::blocked_range<size_t>& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) work(i);
  });
}

/// Threshold in [0, 1) of a pixel in a frame: evenly distributed over 16 x 16 pixels and aligned parts of them, which
/// is Bayer's order, and over the frames of a pixel.
float threshold(uint32_t x, uint32_t y, uint32_t frame) {
  constexpr uint32_t kGolden = 0x9e3779b9u;
  uint32_t order = 0; // the digits of x ^ y and y, the lowest in front
  for (uint32_t bit = 0; bit < 4; ++bit) order = order << 2 | ((x ^ y) >> bit & 1u) << 1 | (y >> bit & 1u);
  const uint32_t fixed = (order << 24) + frame * kGolden;
  return static_cast<float>(fixed >> 8) * 0x1p-24f;
}

} // namespace

void AdaptiveRate::resize(ImageSize size) {
  size_ = size, frame_ = 0;
  pixels_.assign(size.pixels(), {});
  age_.assign(size.pixels(), 0), next_age_.resize(size.pixels());
  first_.resize(size.pixels()), count_.resize(size.pixels());
}

/// Moves ages to where their surfaces are now; 0 for surfaces that were not seen.
void AdaptiveRate::follow_surfaces(const GBuffer& g) {
  const auto width = static_cast<float>(size_.width), height = static_cast<float>(size_.height);
  for_pixels(size_.pixels(), [&](size_t i) {
    next_age_[i] = 0;
    if (g.instance[i] == kNoInstance) return;
    const size_t column = i % size_.width, row = i / size_.width;
    const float x = std::floor(static_cast<float>(column) + 0.5f - g.motion_px[i].x);
    const float y = std::floor(static_cast<float>(row) + 0.5f - g.motion_px[i].y);
    if (!(x >= 0.0f && x < width && y >= 0.0f && y < height)) return;
    const size_t from = static_cast<size_t>(y) * size_.width + static_cast<size_t>(x);
    const float z = g.previous_z.empty() ? g.view_z[i] : g.previous_z[i];
    const Pixel& before = pixels_[from];
    if (before.instance == g.instance[i] && std::abs(before.view_z - z) <= kSameDepth * z) next_age_[i] = age_[from];
  });
  std::swap(age_, next_age_);
}

/// Returns rates that keep the budget of one unit per pixel: less for young pixels if old ones would get too little.
AdaptiveRate::Rates AdaptiveRate::rates(const GBuffer& g) const {
  uint64_t young_pixels = 0, old_pixels = 0;
  for (size_t i = 0; i < age_.size(); ++i)
    if (g.instance[i] != kNoInstance) ++(age_[i] < kYoungFrames ? young_pixels : old_pixels);
  const auto young = static_cast<double>(young_pixels), old = static_cast<double>(old_pixels);
  if (old == 0.0 || young == 0.0) return {1.0, 1.0};
  const double young_rate = std::min(kYoungRate, (young + old - kMinRate * old) / young);
  return {young_rate, (young + old - young_rate * young) / old};
}

SamplePlan AdaptiveRate::next_frame(const GBuffer& g, bool same_pixels, uint32_t spp,
                                    std::span<const float> max_history) {
  if (g.size != size_ || age_.empty())
    resize(g.size);
  else if (!same_pixels)
    follow_surfaces(g);
  for (size_t i = 0; i < max_history.size(); ++i)
    if (max_history[i] < static_cast<float>(age_[i])) age_[i] = static_cast<uint8_t>(max_history[i]);
  const Rates rates = this->rates(g);
  for_pixels(size_.pixels(), [&](size_t i) {
    Pixel& pixel = pixels_[i];
    first_[i] = pixel.samples, count_[i] = 0;
    pixel.instance = g.instance[i], pixel.view_z = g.view_z[i];
    if (pixel.instance == kNoInstance) return;
    const double rate = age_[i] < kYoungFrames ? rates.young : rates.old;
    const float dither =
        threshold(static_cast<uint32_t>(i % size_.width), static_cast<uint32_t>(i / size_.width), frame_);
    count_[i] = static_cast<uint16_t>(std::min(65535.0, std::floor(rate * spp + double{dither})));
    pixel.samples += count_[i];
    if (count_[i] > 0 && age_[i] < 255) ++age_[i];
  });
  ++frame_;
  return {0, spp, {}, first_, count_};
}

std::vector<std::byte> AdaptiveRate::save() const {
  if (age_.empty()) return {};
  std::vector<std::byte> bytes(sizeof(frame_) + pixels_.size() * (sizeof(Pixel) + 1));
  std::memcpy(bytes.data(), &frame_, sizeof(frame_));
  std::memcpy(bytes.data() + sizeof(frame_), pixels_.data(), pixels_.size() * sizeof(Pixel));
  std::memcpy(bytes.data() + sizeof(frame_) + pixels_.size() * sizeof(Pixel), age_.data(), age_.size());
  return bytes;
}

bool AdaptiveRate::restore(ImageSize size, std::span<const std::byte> bytes) {
  clear();
  if (bytes.empty()) return true;
  if (bytes.size() != sizeof(frame_) + size.pixels() * (sizeof(Pixel) + 1)) return false;
  resize(size);
  std::memcpy(&frame_, bytes.data(), sizeof(frame_));
  std::memcpy(pixels_.data(), bytes.data() + sizeof(frame_), pixels_.size() * sizeof(Pixel));
  std::memcpy(age_.data(), bytes.data() + sizeof(frame_) + pixels_.size() * sizeof(Pixel), age_.size());
  return true;
}

} // namespace packtrace
