#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/bound/surface_walk.h"

namespace packtrace {

/// Maps source triangles continuously onto the simplified surface: the paths of a triangle's sides bound its image.
class TriangleImages {
public:
  static constexpr uint32_t kNone = SurfaceWalk::kNone;

  /// The image of a source triangle. Its outline crosses the simplified triangles met(image). If these form a fan
  /// around a simplified point, that point is in the image's interior.
  struct Image {
    double distance; ///< maximum distance of any point from its image
    double inside;   ///< distance of the interior point from the triangle; 0 without one
    uint32_t first, count;
    uint32_t point; ///< the interior point, or kNone
  };

  /// The part of an image in one simplified triangle. Bounds of the distances between nearest points: `there` of the
  /// source triangle's part from the simplified triangle, `back` of the image from the source triangle.
  struct Piece {
    uint32_t simplified;
    double there, back;
  };

  /// Both arguments must outlive this object.
  TriangleImages(SurfaceWalk& walk, const SimplifyMesh& mesh)
      : walk_(walk), mesh_(mesh), met_(4 * walk.source().triangles.size() + kMax),
        last_met_(mesh.triangles.size(), kNone) {}

  /// Returns false, and changes nothing, if a corner or side has no image or the outline encloses more than one point.
  bool find(uint32_t triangle, Image& out);
  std::span<const uint32_t> met(const Image& image) const { return std::span(met_).subspan(image.first, image.count); }

  /// Appends one piece per simplified triangle that the outline crosses.
  /// @param triangle find() returned true for it
  void look_closer(uint32_t triangle, const Image& image, std::vector<Piece>& pieces);

  /// Adds to `shares`, for each wanted simplified triangle, the fraction of its area that the image covers. Parts of
  /// the image that are seen from behind count as negative.
  /// @param triangle find() returned true for it
  void add_shares(uint32_t triangle, const Image& image, std::span<const uint8_t> wanted, std::span<double> shares);

private:
  /// maximum number of simplified triangles on an outline; longer ones have no image
  static constexpr uint32_t kMax = 64;

  /// A sequence of adjacent simplified triangles.
  struct Word {
    uint32_t count = 0;
    std::array<uint32_t, kMax> triangles;
  };

  /// The part of an outline in one simplified triangle: points from first_point up to that of the next interval.
  struct Interval {
    uint32_t triangle, first_point;
  };
  struct Outline {
    std::vector<Interval> intervals; ///< plus an end marker
    std::vector<DVec3> points;
  };

  double area(uint32_t interval, const DVec3& reference) const;
  template <typename Visitor>
  bool follow(uint32_t triangle, Visitor& visitor);
  bool contract(std::span<const uint32_t> outline, uint32_t& inside) const;
  double distance2_from(uint32_t triangle, const DVec3& point) const;
  const Triangle& points(uint32_t source) const { return walk_.source().triangles[source].points; }
  const uint32_t* edges(uint32_t source) const { return &mesh_.side_edges[3 * size_t{source}]; }

  SurfaceWalk& walk_;
  const SimplifyMesh& mesh_;
  std::vector<uint32_t> met_; ///< with room for one more outline
  uint32_t met_count_ = 0;
  std::vector<uint32_t> last_met_; ///< per simplified triangle: the last source triangle with an image that met it
  Outline outline_;                ///< of the current triangle; used by add_shares()
};

} // namespace packtrace
