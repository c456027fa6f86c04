#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/bound/stated_error.h"
#include "compress/bake/lod/bound/surface_side.h"
#include "compress/bake/lod/bound/triangle_refiner.h"

namespace packtrace {

/// A part of a simplified triangle lies within `distance` of a source triangle.
struct PartDistance {
  uint32_t simplified, source;
  double distance;
};

/// Bounds the distance of simplified triangles from the source surface, for those that no image is known to cover
/// (ImageCover). Each triangle is first overlaid on nearby source triangles, or subdivided if the overlay does not
/// cover it. finish() then subdivides the triangles with the largest bounds, more finely if needed, against every
/// source triangle that may be near enough. Triangles with bounds below the limit stay as they are.
class UncoveredBound {
public:
  /// @param source, simplified, error, refiner must outlive this object; `source` must be linked
  UncoveredBound(SurfaceSide& source, const SurfaceSide& simplified, GroupError& error, TriangleRefiner& refiner)
      : source_(source), simplified_(simplified), error_(error), refiner_(refiner) {}

  /// Bounds the distance of a whole simplified triangle.
  /// @param found source triangles, parts of which may map to it; may contain duplicates; must stay
  /// valid until finish() returns
  void measure(uint32_t triangle, std::span<const uint32_t> found);
  /// Tightens the bounds that determine the group's error. Returns bounds that together cover all measured triangles.
  std::vector<PartDistance> finish();

private:
  using Corners = std::array<DVec3, 3>;

  /// The error bound of a triangle; its parts are parts_[first .. first + count).
  struct Claim {
    double stated;
    uint32_t triangle;
    size_t first, count;
    std::span<const uint32_t> not_cut; ///< `found` of measure(), until subdivision has been tried; empty if not needed
    bool operator<(const Claim& o) const { return stated != o.stated ? stated < o.stated : triangle > o.triangle; }
  };

  double inherited_error(uint32_t source) const { return source_.surface().triangles[source].error; }
  bool overlay(const Corners& part, double& stated);
  bool overlay_near(double& stated);
  double refine();
  struct CutBounds {
    double least, stated; ///< lower and upper bound
  };
  CutBounds cut(const Corners& part);
  void cut_later(Claim& claim);
  void note_parts(uint32_t triangle, std::span<const OverlayPiece> pieces);
  double measure_part(uint32_t triangle, const Corners& part, double& least);
  double look_closer(uint32_t triangle, const Corners& part, double known, uint32_t depth);
  bool spent() const;

  SurfaceSide& source_;
  const SurfaceSide& simplified_;
  GroupError& error_;
  TriangleRefiner& refiner_;
  std::vector<PartDistance> parts_;
  std::vector<Claim> claims_;
  std::vector<OverlayPiece> mapped_triangles_, refined_; ///< bounds of the current part
};

} // namespace packtrace
