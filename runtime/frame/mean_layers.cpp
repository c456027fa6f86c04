#include "runtime/frame/mean_layers.h"

#include <algorithm>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

bool emits(const Material& material) { return (material.flags & kEmissive) != 0; }

/// Calls work(y) for all rows on all cores.
template <typename Work>
void for_each_image_row(uint32_t height, const Work& work) {
  constexpr uint32_t kRows = 8;
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, height, kRows), [&](const tbb::blocked_range<uint32_t>& rows) {
    for (uint32_t y = rows.begin(); y < rows.end(); ++y) work(y);
  });
}

} // namespace

void MeanLayers::clear_sums(ImageSize size, bool emitters) {
  size_ = size;
  const size_t n = size.pixels();
  hits_.assign(n, 0.0f), depth_.assign(n, 0.0f);
  normal_.assign(n, Vec3(0)), albedo_.assign(n, Vec3(0));
  instance_.assign(n, kNoInstance);
  emitters_.assign(emitters ? n : 0, 0.0f), emitter_albedo_.assign(emitters ? n : 0, Vec3(0));
}

void MeanLayers::add(const GBuffer& g, std::span<const Material> materials) {
  if (frames_ == 0) clear_sums(g.size, std::ranges::any_of(materials, emits));
  ++frames_;
  pixel_spread_ = g.pixel_spread;
  for_each_image_row(g.size.height, [&](uint32_t y) {
    const size_t begin = static_cast<size_t>(y) * g.size.width, end = begin + g.size.width;
    for (size_t i = begin; i < end; ++i) {
      if (g.instance[i] == kNoInstance) continue;
      if (hits_[i] == 0.0f) instance_[i] = g.instance[i];
      hits_[i] += 1.0f;
      depth_[i] += g.view_z[i], normal_[i] += g.normal[i], albedo_[i] += g.albedo[i];
      if (!emitters_.empty() && emits(materials[g.material[i]]))
        emitters_[i] += 1.0f, emitter_albedo_[i] += g.albedo[i];
    }
  });
}

void MeanLayers::write_guides(GBuffer& guides) const {
  guides.size = size_;
  guides.pixel_spread = pixel_spread_;
  const size_t n = size_.pixels();
  guides.view_z.resize(n), guides.normal.resize(n);
  guides.instance = instance_;
  guides.motion_px.assign(n, Vec2(0));
  for_each_image_row(size_.height, [&](uint32_t y) {
    const size_t begin = static_cast<size_t>(y) * size_.width, end = begin + size_.width;
    for (size_t i = begin; i < end; ++i) {
      guides.view_z[i] = hits_[i] > 0.0f ? depth_[i] / hits_[i] : 0.0f;
      const float length = glm::length(normal_[i]);
      guides.normal[i] = length > 0.0f ? normal_[i] / length : Vec3(0);
    }
  });
}

void MeanLayers::resolve(const FrameConfig& config, std::span<const float> ao, std::span<const float> raw,
                         RenderedImage& image) const {
  const uint32_t factor = config.supersample;
  image.size = config.size;
  const size_t n = image.size.pixels();
  image.ao.assign(n, kInvalidAo), image.ao_raw.assign(n, kInvalidAo);
  image.depth.assign(n, 0.0f), image.coverage.assign(n, 0.0f);
  image.normal.assign(n, Vec3(0)), image.albedo.assign(n, Vec3(0)), image.shaded.assign(n, Vec3(0));
  image.instance.assign(n, kNoInstance);
  const float rays = static_cast<float>(frames_) * static_cast<float>(factor * factor);
  const auto resolve_pixel = [&](uint32_t x, uint32_t y) {
    const size_t out = static_cast<size_t>(y) * image.size.width + x;
    float hits = 0, ao_hits = 0, raw_hits = 0, ao_sum = 0, raw_sum = 0, depth = 0;
    Vec3 normal(0), albedo(0), shaded(0);
    for (uint32_t sub = 0; sub < factor * factor; ++sub) {
      const size_t in = (static_cast<size_t>(y) * factor + sub / factor) * size_.width +
                        static_cast<size_t>(x) * factor + sub % factor;
      if (hits_[in] == 0.0f) continue;
      if (hits == 0.0f) image.instance[out] = instance_[in];
      hits += hits_[in], depth += depth_[in];
      if (ao[in] >= 0.0f) ao_hits += hits_[in], ao_sum += hits_[in] * ao[in];
      if (raw[in] >= 0.0f) raw_hits += 1.0f, raw_sum += raw[in];
      normal += normal_[in], albedo += albedo_[in];
      const float light = std::max(ao[in], 0.0f);
      shaded +=
          emitters_.empty() ? albedo_[in] * light : Vec3(emitters_[in]) + (albedo_[in] - emitter_albedo_[in]) * light;
    }
    if (hits == 0.0f) return;
    const float scale = 1.0f / hits;
    if (ao_hits > 0.0f) image.ao[out] = ao_sum * (1.0f / ao_hits);
    image.depth[out] = depth * scale;
    if (raw_hits > 0.0f) image.ao_raw[out] = raw_sum * (1.0f / raw_hits);
    image.coverage[out] = hits / rays;
    const float length = glm::length(normal);
    image.normal[out] = length > 0 ? normal / length : Vec3(0);
    image.albedo[out] = albedo * scale, image.shaded[out] = shaded * scale;
  };
  for_each_image_row(image.size.height, [&](uint32_t y) {
    for (uint32_t x = 0; x < image.size.width; ++x) resolve_pixel(x, y);
  });
}

} // namespace packtrace
