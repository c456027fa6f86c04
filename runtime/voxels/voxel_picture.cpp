#include "runtime/voxels/voxel_picture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "runtime/ao/hash.h"
#include "runtime/ao/hemisphere.h"

namespace packtrace {
namespace {

/// Points of the unit square: a lattice of rank 1, shifted by pixel.
/// Source: the plastic constant's sequence, Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018.
Vec2 sample_point(uint32_t sample, uint32_t pixel) {
  constexpr double kA = 0.7548776662466927, kB = 0.5698402909980532;
  const auto shifted = [&](double step, uint32_t hash) {
    const double value = static_cast<double>(hash) * 0x1p-32 + step * static_cast<double>(sample + 1);
    return static_cast<float>(value - std::floor(value));
  };
  return {shifted(kA, hash32(2 * pixel)), shifted(kB, hash32(2 * pixel + 1))};
}

/// Sums over a pixel's hits of distance fields.
struct FieldSums {
  float visibility = 0.0f, taps = 0.0f, cones = 0.0f;
  uint32_t hits = 0;
};

class PictureTracer {
public:
  PictureTracer(const VoxelScene& scene, const VoxelPictureConfig& config, ImageSize size)
      : scene_(scene), config_(config), size_(size), row_rays_(size.height),
        fields_(has_fields(scene) ? size.pixels() : 0) {
    picture_.color.resize(size.pixels(), Vec3(0.0f)), picture_.coverage.resize(size.pixels(), 0.0f);
  }

  void trace_row(const PrimaryCamera& camera, uint32_t view, uint32_t y) {
    row_rays_[y] += size_.width;
    for (uint32_t x = 0; x < size_.width; ++x) {
      const CameraRay ray = camera.ray(x, y);
      const auto hit = scene_.first_hit(ray.origin, ray.direction, 0.0, std::numeric_limits<double>::infinity());
      if (!hit) continue;
      const uint32_t pixel = y * size_.width + x;
      const DVec3 point = ray.origin + hit->t * ray.direction;
      const float visibility = visibility_at(*hit, point, view, pixel);
      row_rays_[y] += config_.samples;
      picture_.color[pixel] += hit->albedo * visibility;
      picture_.coverage[pixel] += 1.0f;
      if (const auto field = scene_.field_visibility(*hit, point + hit->clearance, config_.radius)) {
        FieldSums& sums = fields_[pixel];
        ++sums.hits;
        sums.visibility += visibility, sums.taps += field->taps, sums.cones += field->cones;
      }
    }
  }

  VoxelPicture finish() {
    for (size_t i = 0; i < picture_.color.size(); ++i) {
      if (picture_.coverage[i] > 0.0f) picture_.color[i] /= picture_.coverage[i];
      picture_.coverage[i] /= static_cast<float>(config_.views);
    }
    for (const uint64_t rays : row_rays_) picture_.rays += rays;
    for (const FieldSums& sums : fields_) {
      if (sums.hits == 0) continue;
      ++picture_.field_pixels;
      picture_.tap_error += std::abs(double{sums.taps} - double{sums.visibility}) / sums.hits;
      picture_.cone_error += std::abs(double{sums.cones} - double{sums.visibility}) / sums.hits;
    }
    const auto pixels = static_cast<double>(std::max<uint64_t>(picture_.field_pixels, 1));
    picture_.tap_error /= pixels, picture_.cone_error /= pixels;
    return std::move(picture_);
  }

private:
  static bool has_fields(const VoxelScene& scene) {
    return std::ranges::any_of(scene.proxies(), [](const Proxy& proxy) { return proxy.is_field(); });
  }

  /// Share of the occlusion rays that reach the radius.
  float visibility_at(const SceneVoxelHit& hit, DVec3 point, uint32_t view, uint32_t pixel) const {
    uint32_t open = 0;
    for (uint32_t s = 0; s < config_.samples; ++s) {
      const Vec2 sample = sample_point(view * config_.samples + s, pixel ^ hash32(config_.seed));
      const DVec3 direction(turned_to(Vec3(hit.normal), cosine_direction(sample)));
      open += !scene_.occluded_from(hit, point, direction, config_.radius);
    }
    return static_cast<float>(open) / static_cast<float>(config_.samples);
  }

  const VoxelScene& scene_;
  const VoxelPictureConfig& config_;
  ImageSize size_;
  std::vector<uint64_t> row_rays_;
  std::vector<FieldSums> fields_; ///< per pixel; empty if the scene has none
  VoxelPicture picture_;
};

} // namespace

VoxelPicture trace_voxel_picture(const VoxelScene& scene, const std::function<PrimaryCamera(uint32_t)>& view,
                                 const VoxelPictureConfig& config, Progress& progress) {
  const ImageSize size = view(0).size();
  PictureTracer tracer(scene, config, size);
  for (uint32_t v = 0; v < config.views; ++v) {
    const PrimaryCamera camera = view(v);
    tbb::parallel_for(0u, size.height, [&](uint32_t y) {
      progress.check_cancelled();
      tracer.trace_row(camera, v, y);
      progress.advance();
    });
  }
  return tracer.finish();
}

} // namespace packtrace
