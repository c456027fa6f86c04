#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/ao/sampler.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/ray_tracer.h"
#include "runtime/trace/view_tracer.h"

namespace packtrace {

/// The surface points of a tile from which occlusion rays start, as arrays. Memory is kept from tile to tile.
class ShadingPoints {
public:
  void clear() { pixel_.clear(), x_px_.clear(), y_px_.clear(); }
  void add(uint32_t x_px, uint32_t y_px, uint32_t pixel) {
    x_px_.push_back(x_px), y_px_.push_back(y_px), pixel_.push_back(pixel);
  }
  uint32_t count() const { return static_cast<uint32_t>(pixel_.size()); }
  std::span<const uint32_t> pixels() const { return pixel_; }

  /// Loads the surfaces of the pixels that were added.
  /// @param offset_scale AoConfig::offset_scale
  void load(const GBuffer& gbuffer, const PixelSampler& sampler, const UnitSpace& space, float offset_scale) {
    load_surfaces(gbuffer, space, offset_scale);
    sampler.pixels(x_px_.data(), y_px_.data(), count(), sampled_);
  }
  /// Does the same for copy_to() only.
  void load_surfaces(const GBuffer& gbuffer, const UnitSpace& space, float offset_scale);

  /// Copies what was loaded, for tracers that make rays themselves.
  /// @param first of the points to copy, which out has room for
  void copy_to(size_t first, std::span<OcclusionPoint> out) const;

  /// Writes the rays of the first rays.size() points. Directions are cosine-weighted about the shading normal; those
  /// below the geometric surface are mirrored to its upper side.
  /// @param samples numbers of the samples in the points' sequences
  void write_rays(const PixelSampler& sampler, std::span<const uint32_t> samples, float tfar, std::span<Ray> rays);

private:
  struct Vectors {
    std::vector<float> x, y, z;
    void resize(size_t count) { x.resize(count), y.resize(count), z.resize(count); }
  };

  std::vector<uint32_t> pixel_, x_px_, y_px_;
  PixelSampler::Pixels sampled_;
  Vectors origin_, geometric_, normal_, direction_;
  std::vector<float> offset_, u_, v_;
};

} // namespace packtrace
