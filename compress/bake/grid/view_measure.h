#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/grid/scene_measure.h"
#include "compress/bake/grid/surface_sample.h"
#include "pbrt_import/scene/camera_rays.h"

namespace packtrace {

/// Size of the images for which the default precision makes its promise.
inline constexpr ImageSize kPromisedSize{320, 180};

/// How a camera sees a geometry if nothing occludes it.
struct ViewStats {
  double pixels = 0.0; ///< covered pixels; each overlapping surface counts
  double height = 0.0; ///< harmonic mean of triangle heights, weighted by pixels, world units; 0 if no pixel is covered
  /// World-space size of a pixel at the surface: 2 % quantile over the pixels; 0 if no pixel is covered.
  double pixel = 0.0;

  /// Fraction of the image that is covered, at most 1.
  double coverage() const;
};

/// Accumulates the visible pieces of triangles for ViewStats.
class ViewSums {
public:
  /// @param pixels number of covered pixels
  /// @param pixel world-space size of a pixel at the piece
  /// @param height height of the triangle, world units
  void add(double pixels, double pixel, double height);
  /// Returns the statistics of all pieces added so far.
  ViewStats stats() const;

private:
  static constexpr int kBinsPerOctave = 4, kFirstOctave = -128, kOctaves = 256;
  std::array<double, size_t{kOctaves} * kBinsPerOctave> pixels_by_size_{};
  double pixels_ = 0.0, pixels_by_height_ = 0.0;
};

/// Transforms (world_from_geometry) of a geometry's instances.
struct Placements {
  std::span<const baked::InstanceRecord> instances; ///< all instances of the scene
  std::span<const uint32_t> chosen;                 ///< indices of the geometry's instances

  size_t size() const { return chosen.size(); }
  DAffine operator[](size_t i) const { return placement_of(instances[chosen[i]]); }
};

/// Estimates the pixels that a world-space box covers. Returns 0 only if the box is out of sight.
double box_pixels(const PrimaryCamera& camera, const Bounds& world);

/// Adds the camera's view of a geometry's sample in all of its instances. If there are many, a weighted subset
/// represents them: about 8192 placed triangles are visited, large ones split into pieces of at most 32 pixels.
/// @param box bounds of the geometry
/// @param sample_pixels per sample triangle: increased by the pixels of the triangles that it represents
void add_geometry_view(const PrimaryCamera& camera, std::span<const SampleTriangle> sample,
                       const Placements& placements, const Bounds& box, ViewSums& sums,
                       std::span<double> sample_pixels);

} // namespace packtrace
