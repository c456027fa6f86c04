#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/bound/triangle_images.h"

namespace packtrace {

/// Finds simplified triangles that are covered by images of source triangles. The number of images over a point, where
/// images seen from behind count as -1, is an integer that changes only at borders of the images. So it is constant in
/// each part of the surface that no border crosses, and follows from the image areas in one triangle of the part. Where
/// it is not 0, every point of the part is covered. Nothing is known of triangles that borders cross.
/// Source: degree of a map; e.g. Victor Guillemin and Alan Pollack, Differential Topology, 1974, 3.3.
class ImageCover {
public:
  /// All arguments must outlive this object.
  ImageCover(const SurfaceWalk& walk, TriangleImages& images, const SimplifyMesh& mesh)
      : walk_(walk), images_(images), mesh_(mesh) {}

  /// Finds the parts of the simplified surface that no border crosses.
  /// @param mapped per source triangle: 1 if add() or add_unchanged() will be called for it
  void begin(std::span<const uint8_t> mapped);
  /// Adds the image of a mapped source triangle.
  void add(uint32_t triangle, const TriangleImages::Image& image);
  /// Adds a simplified triangle that is also a source triangle.
  void add_unchanged(uint32_t simplified) { shares_[simplified] += 1.0; }
  /// Whether images cover the whole simplified triangle. Valid once all images are added.
  bool whole(uint32_t simplified) const {
    return part_[simplified] != kNone && std::abs(shares_[seeds_[part_[simplified]]]) > 0.5;
  }

private:
  static constexpr uint32_t kNone = SurfaceWalk::kNone;

  void mark_borders(std::span<const uint8_t> mapped);
  void find_part(uint32_t first);

  const SurfaceWalk& walk_;
  TriangleImages& images_;
  const SimplifyMesh& mesh_;
  std::vector<uint8_t> borders_; ///< per simplified triangle: kCrossed, or bit i if a border runs along side i
  std::vector<uint8_t> is_seed_; ///< per simplified triangle
  std::vector<double> shares_;   ///< per simplified triangle, for seeds only: signed number of images over it
  std::vector<uint32_t> part_;   ///< per simplified triangle, or kNone
  std::vector<uint32_t> seeds_;  ///< per part: its largest triangle
  std::vector<uint32_t> reached_;
};

} // namespace packtrace
