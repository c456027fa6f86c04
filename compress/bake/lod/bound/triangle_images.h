#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/bound/surface_walk.h"

namespace packtrace {

/// Maps triangles before onto the surface after, continuously: the ways of its sides bound the image of each.
class TriangleImages {
public:
  static constexpr uint32_t kNone = SurfaceWalk::kNone;

  /// The image of a triangle: the triangles after that its outline meets, met(first, count).
  /// Where they go around a point after, that is inside.
  struct Image {
    double distance; ///< of both is at most that
    double inside;   ///< how far the point inside is from the triangle; 0 if there is none
    uint32_t first, count;
    uint32_t point; ///< the point inside, or kNone
  };

  /// Both must outlive it.
  TriangleImages(SurfaceWalk& walk, const SimplifyMesh& mesh)
      : walk_(walk), mesh_(mesh), met_(4 * walk.before().triangles.size() + kMost) {}

  /// False, and nothing changed, where a corner or a side has no image, or the outline goes around two points and more.
  bool find(uint32_t triangle, Image& out);
  std::span<const uint32_t> met(const Image& image) const { return std::span(met_).subspan(image.first, image.count); }

  /// Appends the triangles after that the image meets with how far its part there is from the nearest points at most,
  /// both ways.
  /// @param triangle find() was true of it
  void look_closer(uint32_t triangle, const Image& image, std::vector<OverlayPiece>& pieces);

  /// Adds to `shares`, per triangle after that is wanted, how much of it the image covers. What is seen from behind is
  /// negative.
  /// @param triangle find() was true of it
  void add_shares(uint32_t triangle, const Image& image, std::span<const uint8_t> wanted, std::span<double> shares);

private:
  static constexpr uint32_t kMost = 64; ///< triangles after; longer outlines are none

  /// Triangles after, one after the other.
  struct Word {
    uint32_t count = 0;
    std::array<uint32_t, kMost> triangles;
  };

  /// The outline's image within one triangle after: points[first_point .. that of the next).
  struct Interval {
    uint32_t triangle, first_point;
  };
  struct Outline {
    std::vector<Interval> intervals; ///< and one more
    std::vector<DVec3> points;
  };

  double area(uint32_t interval, const DVec3& reference) const;
  template <typename Visitor>
  bool follow(uint32_t triangle, Visitor& visitor);
  bool contract(std::span<const uint32_t> outline, uint32_t& inside) const;
  double distance2_from(uint32_t triangle, const DVec3& point) const;
  const Triangle& points(uint32_t before) const { return walk_.before().triangles[before].points; }
  const uint32_t* edges(uint32_t before) const { return &mesh_.side_edges[3 * size_t{before}]; }

  SurfaceWalk& walk_;
  const SimplifyMesh& mesh_;
  std::vector<uint32_t> met_; ///< with room for one outline more
  uint32_t met_count_ = 0;
  Outline outline_; ///< of the triangle at hand, where shares are looked for
};

} // namespace packtrace
