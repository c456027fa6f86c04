#pragma once

#include "runtime/trace/packed/kernels/leaf_tests.h"
#include "runtime/trace/packed/kernels/side_by_side.h"

/// Tests the triangles of a batch against the rays of a beam. All rays have one origin, so corners relative to it are
/// computed once per batch.
namespace packtrace::packed {
namespace {

/// A batch's triangles relative to a beam's origin.
struct BeamBatch {
  alignas(64) float corner[3][3][kBatch]; ///< [axis][corner][triangle]
};

template <typename Lanes>
inline void move_to_origin(const DecodedBatch& batch, const RayGroup& group, uint32_t ray, BeamBatch& out) {
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const auto origin = Lanes::set(group.origin[axis][ray]);
    for (uint32_t corner = 0; corner < 3; ++corner)
      Lanes::store(out.corner[axis][corner], Lanes::sub(Lanes::load(batch.vertex[axis][corner]), origin));
  }
}

/// Heights of a batch's triangles above a beam's origin, for rays of one kx.
struct BeamHeights {
  alignas(64) float height[kBatch], residual[kBatch];
};

template <typename Lanes>
inline void find_heights(const BeamBatch& batch, const BatchNormals& normals, const RayGroup& group, uint32_t ray,
                         const uint32_t (&axis)[3], BeamHeights& out) {
  const auto relative = [&](uint32_t k, uint32_t corner) { return Lanes::load(batch.corner[axis[k]][corner]); };
  const auto normal = [&](uint32_t k) { return Lanes::load(normals.normal[axis[k]]); };
  const auto rest = [&](uint32_t k) { return Lanes::set(group.rest[axis[k]][ray]); };
  Lanes::store(out.height, height_along<Lanes>(relative, normal));
  Lanes::store(out.residual, residual_along<Lanes>(rest, normal));
}

/// Tests the rays at `at`, `at` + 1, ... of a beam, one per lane, against one triangle. Returns the lanes with a hit,
/// as a bit mask. Performs the same arithmetic as test_rays().
template <typename WideLanes>
inline uint32_t test_beam_rays(const BeamBatch& batch, const BeamHeights& heights, const BatchNormals& normals,
                               uint32_t triangle, const RayGroup& group, const uint32_t (&axis)[3], uint32_t at,
                               uint32_t wanted, LaneHits<WideLanes>& hits, uint64_t& exact_count) {
  using F = typename WideLanes::F;
  const RayLanes<WideLanes> rays{{WideLanes::load(&group.shear[0][at]), WideLanes::load(&group.shear[1][at]),
                                  WideLanes::load(&group.shear[2][at])},
                                 WideLanes::load(&group.begin[at]),
                                 WideLanes::load(&group.end[at])};
  const auto exact = [&](uint32_t lanes, const F(&x)[3], const F(&y)[3], const F(&z)[3], F depth, F along) {
    float stored[10][WideLanes::kLanes];
    return test_exactly<WideLanes>(lanes, stored_corners<WideLanes>(x, y, z, depth, stored), rays.shear[2], along,
                                   hits);
  };
  return test_relative<WideLanes, true>(
      [&](uint32_t k, uint32_t corner) { return WideLanes::set(batch.corner[axis[k]][corner][triangle]); },
      [&] { return WideLanes::set(heights.height[triangle]); },
      [&](F height) { return WideLanes::sub(height, WideLanes::set(heights.residual[triangle])); },
      [&](uint32_t k) { return WideLanes::set(normals.normal[axis[k]][triangle]); }, exact, rays, FineGrid<false>(),
      wanted, hits, exact_count);
}

/// Whether rays of a beam in one register are tested side by side: otherwise, one ray after the other is.
inline bool prefers_rays_in_lanes(uint32_t rays, uint32_t triangles) { return 2 * rays >= triangles; }

} // namespace
} // namespace packtrace::packed
