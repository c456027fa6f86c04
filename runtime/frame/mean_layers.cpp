#include "runtime/frame/mean_layers.h"

#include <algorithm>
#include <cassert>

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

/// Makes the layers that are filled as long as the image has pixels, and the others empty.
void clear_plain_layers(uint32_t layers, RenderedImage& image) {
  const size_t n = image.size.pixels();
  const auto clear = [&]<class T>(std::vector<T>& layer, PlainLayer bit, T value) {
    if (layers & bit)
      layer.assign(n, value);
    else
      layer = std::vector<T>(); // frees the memory, which `= {}` would keep
  };
  image.ao.resize(n), image.coverage.resize(n); // each pixel is written
  clear(image.ao_raw, kAoRawLayer, kInvalidAo);
  clear(image.depth, kDepthLayer, 0.0f);
  clear(image.normal, kNormalLayer, Vec3(0));
  clear(image.albedo, kAlbedoLayer, Vec3(0));
  clear(image.shaded, kShadedLayer, Vec3(0));
  clear(image.instance, kInstanceLayer, kNoInstance);
}

} // namespace

void MeanLayers::clear_sums(ImageSize size) {
  const size_t n = size.pixels();
  const size_t coloured = albedo_kept_ ? n : 0, emitters = emitters_exist_ ? coloured : 0;
  hits_.assign(n, 0.0f), depth_.assign(n, 0.0f);
  normal_.assign(n, Vec3(0)), albedo_.assign(coloured, Vec3(0));
  instance_.assign(n, kNoInstance);
  emitters_.assign(emitters, 0.0f), emitter_albedo_.assign(emitters, Vec3(0));
}

/// A frame alone.
MeanLayers::Sums MeanLayers::sums_of(const GBuffer& g, size_t i) const {
  Sums sums;
  if (g.instance[i] == kNoInstance) return sums;
  sums.hits = 1.0f, sums.instance = g.instance[i];
  sums.depth += g.view_z[i], sums.normal += g.normal[i]; // so that -0 becomes 0
  if (!albedo_kept_) return sums;
  sums.albedo += g.albedo[i];
  if (emitters_exist_ && emits(materials_[g.material[i]])) sums.emitters = 1.0f, sums.emitter_albedo += g.albedo[i];
  return sums;
}

MeanLayers::Sums MeanLayers::sums(const GBuffer& last, size_t i) const {
  if (!kept()) return sums_of(last, i);
  Sums sums{hits_[i], depth_[i], 0.0f, normal_[i], Vec3(0.0f), Vec3(0.0f), instance_[i]};
  if (albedo_kept_) sums.albedo = albedo_[i];
  if (!emitters_.empty()) sums.emitters = emitters_[i], sums.emitter_albedo = emitter_albedo_[i];
  return sums;
}

void MeanLayers::add(const GBuffer& g, std::span<const Material> materials) {
  ++frames_;
  pixel_spread_ = g.pixel_spread;
  if (frames_ == 1) {
    kept_ = false;
    size_ = g.size;
    materials_ = materials;
    emitters_exist_ = std::ranges::any_of(materials, emits);
    albedo_kept_ = !g.albedo.empty() && (!emitters_exist_ || !g.material.empty());
    return;
  }
  assert(kept_ && (!albedo_kept_ || !g.albedo.empty()));
  for_each_image_row(g.size.height, [&](uint32_t y) {
    const size_t begin = static_cast<size_t>(y) * g.size.width, end = begin + g.size.width;
    for (size_t i = begin; i < end; ++i) {
      const Sums added = sums_of(g, i);
      if (added.hits == 0.0f) continue;
      if (hits_[i] == 0.0f) instance_[i] = added.instance;
      hits_[i] += 1.0f;
      depth_[i] += added.depth, normal_[i] += added.normal;
      if (albedo_kept_) albedo_[i] += added.albedo;
      if (!emitters_.empty()) emitters_[i] += added.emitters, emitter_albedo_[i] += added.emitter_albedo;
    }
  });
}

void MeanLayers::keep(const GBuffer& first) {
  if (frames_ != 1 || kept_) return;
  clear_sums(size_);
  for_each_image_row(size_.height, [&](uint32_t y) {
    const size_t begin = static_cast<size_t>(y) * size_.width, end = begin + size_.width;
    for (size_t i = begin; i < end; ++i) {
      const Sums sums = sums_of(first, i);
      hits_[i] = sums.hits, depth_[i] = sums.depth, normal_[i] = sums.normal, instance_[i] = sums.instance;
      if (albedo_kept_) albedo_[i] = sums.albedo;
      if (!emitters_.empty()) emitters_[i] = sums.emitters, emitter_albedo_[i] = sums.emitter_albedo;
    }
  });
  kept_ = true;
}

void MeanLayers::write_guides(const GBuffer& last, GBuffer& guides) const {
  guides.size = size_;
  guides.pixel_spread = pixel_spread_;
  const size_t n = size_.pixels();
  guides.view_z.resize(n), guides.normal.resize(n);
  const std::span<const uint32_t> instance = instances(last);
  guides.instance.assign(instance.begin(), instance.end());
  guides.motion_px.assign(n, Vec2(0));
  for_each_image_row(size_.height, [&](uint32_t y) {
    const size_t begin = static_cast<size_t>(y) * size_.width, end = begin + size_.width;
    for (size_t i = begin; i < end; ++i) {
      const Sums sum = sums(last, i);
      guides.view_z[i] = sum.hits > 0.0f ? sum.depth / sum.hits : 0.0f;
      const float length = glm::length(sum.normal);
      guides.normal[i] = length > 0.0f ? sum.normal / length : Vec3(0);
    }
  });
}

std::span<const Vec3> MeanLayers::albedos(const GBuffer& last, std::vector<Vec3>& memory) const {
  if (!kept()) return last.albedo;
  memory.resize(size_.pixels());
  for_each_image_row(size_.height, [&](uint32_t y) {
    for (size_t i = size_t{y} * size_.width, end = i + size_.width; i < end; ++i) {
      const Sums sum = sums(last, i);
      memory[i] = sum.hits > 0.0f ? sum.albedo / sum.hits : Vec3(0.0f);
    }
  });
  return memory;
}

/// Writes ambient occlusion and coverage, for images of one frame with one traced pixel per pixel and no other layers.
void MeanLayers::resolve_occlusion(const GBuffer& frame, std::span<const float> ao, RenderedImage& image) const {
  for_each_image_row(image.size.height, [&](uint32_t y) {
    for (size_t i = size_t{y} * image.size.width, end = i + image.size.width; i < end; ++i) {
      const bool hit = frame.instance[i] != kNoInstance;
      image.coverage[i] = hit ? 1.0f : 0.0f;
      image.ao[i] = hit && ao[i] >= 0.0f ? ao[i] : kInvalidAo;
    }
  });
}

void MeanLayers::resolve(const FrameConfig& config, const GBuffer& last, std::span<const float> ao,
                         std::span<const float> raw, RenderedImage& image) const {
  const uint32_t factor = config.supersample, layers = config.plain_layers;
  image.size = config.size;
  clear_plain_layers(layers, image);
  if (factor == 1 && layers == 0 && frames_ == 1 && !kept()) return resolve_occlusion(last, ao, image);
  const float rays = static_cast<float>(frames_) * static_cast<float>(factor * factor);
  const auto resolve_pixel = [&](uint32_t x, uint32_t y) {
    const size_t out = static_cast<size_t>(y) * image.size.width + x;
    float hits = 0, ao_hits = 0, raw_hits = 0, ao_sum = 0, raw_sum = 0, depth = 0;
    Vec3 normal(0), albedo(0), shaded(0);
    for (uint32_t sub = 0; sub < factor * factor; ++sub) {
      const size_t in = (static_cast<size_t>(y) * factor + sub / factor) * size_.width +
                        static_cast<size_t>(x) * factor + sub % factor;
      const Sums s = sums(last, in);
      if (s.hits == 0.0f) continue;
      if (hits == 0.0f && (layers & kInstanceLayer)) image.instance[out] = s.instance;
      hits += s.hits, depth += s.depth;
      if (ao[in] >= 0.0f) ao_hits += s.hits, ao_sum += s.hits * ao[in];
      if ((layers & kAoRawLayer) != 0 && raw[in] >= 0.0f) raw_hits += 1.0f, raw_sum += raw[in];
      normal += s.normal, albedo += s.albedo;
      const float light = std::max(ao[in], 0.0f);
      shaded += emitters_exist_ ? Vec3(s.emitters) + (s.albedo - s.emitter_albedo) * light : s.albedo * light;
    }
    image.coverage[out] = hits > 0.0f ? hits / rays : 0.0f;
    image.ao[out] = ao_hits > 0.0f ? ao_sum * (1.0f / ao_hits) : kInvalidAo;
    if (hits == 0.0f) return;
    const float scale = 1.0f / hits;
    if (raw_hits > 0.0f && (layers & kAoRawLayer)) image.ao_raw[out] = raw_sum * (1.0f / raw_hits);
    if (layers & kDepthLayer) image.depth[out] = depth * scale;
    const float length = glm::length(normal);
    if (layers & kNormalLayer) image.normal[out] = length > 0 ? normal / length : Vec3(0);
    if (layers & kAlbedoLayer) image.albedo[out] = albedo * scale;
    if (layers & kShadedLayer) image.shaded[out] = shaded * scale;
  };
  for_each_image_row(image.size.height, [&](uint32_t y) {
    for (uint32_t x = 0; x < image.size.width; ++x) resolve_pixel(x, y);
  });
}

} // namespace packtrace
