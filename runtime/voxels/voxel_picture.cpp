#include "runtime/voxels/voxel_picture.h"

#include <atomic>
#include <limits>

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

} // namespace

VoxelPicture trace_voxel_picture(const VoxelScene& scene, const PrimaryCamera& camera, const VoxelPictureConfig& config,
                                 Progress& progress) {
  const ImageSize size = camera.size();
  VoxelPicture picture;
  picture.color.resize(size.pixels(), Vec3(0.0f)), picture.coverage.resize(size.pixels(), 0.0f);
  std::atomic<uint64_t> rays{0};
  struct RowErrors {
    uint64_t pixels = 0;
    double taps = 0.0, cones = 0.0;
  };
  std::vector<RowErrors> errors(size.height); // summed in order, so that the result does not depend on threads
  tbb::parallel_for(0u, size.height, [&](uint32_t y) {
    progress.check_cancelled();
    uint64_t traced = size.width;
    for (uint32_t x = 0; x < size.width; ++x) {
      const CameraRay ray = camera.ray(x, y);
      const auto hit = scene.first_hit(ray.origin, ray.direction, 0.0, std::numeric_limits<double>::infinity());
      if (!hit) continue;
      const DVec3 origin = ray.origin + hit->t * ray.direction + hit->clearance * hit->edge * hit->normal;
      const uint32_t pixel = y * size.width + x;
      uint32_t open = 0;
      for (uint32_t s = 0; s < config.samples; ++s) {
        const Vec3 direction = turned_to(Vec3(hit->normal), cosine_direction(sample_point(s, pixel)));
        open += !scene.occluded(origin, DVec3(direction), 0.0, config.radius);
      }
      traced += config.samples;
      picture.color[pixel] =
          hit->albedo * (static_cast<float>(open) / static_cast<float>(std::max(config.samples, 1u)));
      picture.coverage[pixel] = 1.0f;
      const double visibility = static_cast<double>(open) / std::max(config.samples, 1u);
      if (const auto field = scene.field_visibility(*hit, origin, config.radius)) {
        ++errors[y].pixels;
        errors[y].taps += std::abs(double{field->taps} - visibility);
        errors[y].cones += std::abs(double{field->cones} - visibility);
      }
    }
    rays += traced;
    progress.advance();
  });
  picture.rays = rays;
  for (const RowErrors& row : errors)
    picture.field_pixels += row.pixels, picture.tap_error += row.taps, picture.cone_error += row.cones;
  if (picture.field_pixels > 0) {
    picture.tap_error /= static_cast<double>(picture.field_pixels);
    picture.cone_error /= static_cast<double>(picture.field_pixels);
  }
  return picture;
}

} // namespace packtrace
