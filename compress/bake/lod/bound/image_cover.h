#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/bound/triangle_images.h"

namespace packtrace {

/// Which triangles after are covered by images of triangles before. How often images cover a place, those seen from
/// behind counted against the others, is a whole number that changes at their borders only. So it is the same
/// everywhere in a part of the surface that no border crosses, and the areas of the images in one triangle of the part
/// say it. Where it is not 0, no point is left out. Of triangles that borders cross nothing is known.
/// Source: degree of a map; e.g. Victor Guillemin and Alan Pollack, Differential Topology, 1974, 3.3.
class ImageCover {
public:
  /// All must outlive it.
  ImageCover(const SurfaceWalk& walk, TriangleImages& images, const SimplifyMesh& mesh)
      : walk_(walk), images_(images), mesh_(mesh) {}

  /// Finds the parts.
  /// @param mapped per triangle before: it is among the images, or itself one of the triangles after
  void begin(std::span<const uint8_t> mapped);
  /// Takes the image of a triangle before into account, each that is mapped.
  void add(uint32_t triangle, const TriangleImages::Image& image);
  /// Takes a triangle after into account that was there before.
  void add_unchanged(uint32_t after) { shares_[after] += 1.0; }
  /// Whether every point of the triangle after is on an image, once all are added.
  bool whole(uint32_t after) const { return part_[after] != kNone && std::abs(shares_[seeds_[part_[after]]]) > 0.5; }

private:
  static constexpr uint32_t kNone = SurfaceWalk::kNone;

  void mark_borders(std::span<const uint8_t> mapped);
  void find_part(uint32_t first);

  const SurfaceWalk& walk_;
  TriangleImages& images_;
  const SimplifyMesh& mesh_;
  std::vector<uint8_t> borders_; ///< per triangle after: kCrossed; bit i: a border goes along side i
  std::vector<uint8_t> is_seed_; ///< per triangle after
  std::vector<double> shares_;   ///< per triangle after, of seeds only: what is covered
  std::vector<uint32_t> part_;   ///< per triangle after, or kNone
  std::vector<uint32_t> seeds_;  ///< per part: its largest triangle
  std::vector<uint32_t> reached_;
};

} // namespace packtrace
