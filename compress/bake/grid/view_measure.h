#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/grid/scene_measure.h"
#include "compress/bake/grid/surface_sample.h"
#include "pbrt_import/scene/camera_rays.h"

namespace packtrace {

/// The image that the default precision is measured by.
inline constexpr ImageSize kPromisedSize{320, 180};

/// What a camera sees of geometry if nothing hides it.
struct ViewStats {
  double pixels = 0.0; ///< covered, each as often as surfaces lie over one another
  double height = 0.0; ///< harmonic mean of triangle heights by pixels, world units; 0 where none is covered
  double pixel = 0.0;  ///< world length of a pixel there: the 2 % quantile by pixels; 0 where none is covered

  /// Share of the image, at most 1.
  double coverage() const;
};

/// Sums over the pieces of triangles that a camera sees, for ViewStats.
class ViewSums {
public:
  /// @param pixels covered  @param pixel world length of one there  @param height of the triangle, world units
  void add(double pixels, double pixel, double height);
  ViewStats stats() const;

private:
  static constexpr int kBinsPerOctave = 4, kFirstOctave = -128, kOctaves = 256;
  std::array<double, size_t{kOctaves} * kBinsPerOctave> pixels_by_size_{};
  double pixels_ = 0.0, pixels_by_height_ = 0.0;
};

/// world_from_geometry of a geometry's instances.
struct Placements {
  std::span<const baked::InstanceRecord> instances; ///< of the scene
  std::span<const uint32_t> chosen;                 ///< the geometry's

  size_t size() const { return chosen.size(); }
  DAffine operator[](size_t i) const { return placement_of(instances[chosen[i]]); }
};

/// Adds what the camera sees of a geometry's sample in all of its instances. Where there are many, some stand for
/// others: about 8192 placed triangles are looked at, large ones in pieces of at most 32 pixels.
/// @param box of the geometry
/// @param sample_pixels by sample: the pixels that the triangles which it stands for cover are added
void look_at_geometry(const PrimaryCamera& camera, std::span<const SampleTriangle> sample, const Placements& placements,
                      const Bounds& box, ViewSums& sums, std::span<double> sample_pixels);

} // namespace packtrace
