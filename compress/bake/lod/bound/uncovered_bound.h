#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/bound/stated_error.h"
#include "compress/bake/lod/bound/surface_side.h"
#include "compress/bake/lod/bound/triangle_refiner.h"

namespace packtrace {

/// A part of a triangle after is that far from a triangle before, at most.
struct PartDistance {
  uint32_t after, before;
  double distance;
};

/// Measures triangles after against the surface before: those that nothing else bounds. First each is laid over the
/// triangles before that are found at it, or cut; then those of which most is left to gain are cut further, and what is
/// too far off is measured against all that may be near.
class UncoveredBound {
public:
  /// @param before linked; all must outlive it
  UncoveredBound(SurfaceSide& before, const SurfaceSide& after, GroupError& error, TriangleRefiner& refiner)
      : before_(before), after_(after), error_(error), refiner_(refiner) {}

  /// Measures all of a triangle.
  /// @param found triangles before of which part may be there; some more than once
  void measure(uint32_t triangle, std::span<const uint32_t> found);
  /// Looks closer at those that matter. Returns what bounds all triangles measured, part by part.
  std::vector<PartDistance> finish();

private:
  using Corners = std::array<DVec3, 3>;

  /// Of parts_[first .. first + count).
  struct Claim {
    double stated;
    uint32_t triangle;
    size_t first, count;
    bool operator<(const Claim& o) const { return stated != o.stated ? stated < o.stated : triangle > o.triangle; }
  };

  double had(uint32_t before) const { return before_.surface().triangles[before].error; }
  bool lay(const Corners& part, double& stated);
  double refine();
  double measure_part(uint32_t triangle, const Corners& part, double& least);
  double look_closer(uint32_t triangle, const Corners& part, double known, uint32_t depth);
  bool spent() const;

  SurfaceSide& before_;
  const SurfaceSide& after_;
  GroupError& error_;
  TriangleRefiner& refiner_;
  std::vector<PartDistance> parts_;
  std::vector<Claim> claims_;
  std::vector<OverlayPiece> laid_, refined_; ///< of the part at hand
};

} // namespace packtrace
