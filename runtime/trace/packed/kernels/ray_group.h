#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/trace/packed/kernels/kernel_types.h"
#include "runtime/trace/packed/kernels/ray_vectors.h"

/// Rays in the grid of one tree, with the data that box and triangle tests need.
namespace packtrace::packed {
namespace {

/// Maximum number of rays in a group: the bits of a 64-bit mask.
constexpr uint32_t kGroup = 64;
/// Minimum number of rays at a node for tests on the group as a whole (reach) and for testing rays side by side.
constexpr uint32_t kMinSideBySideRays = 32;

/// Box planes are moved outwards by this times M, the largest coordinate of the ray's origin and the tree. It covers
/// all roundings, here in units of u = 2^-24 for a direction whose largest component is in [1, 2):
///  - A hit point may lie off the ray by at most 10 u M: the vertex is rounded to float (1 M), the origin is subtracted
///    (2 M), the slope is rounded (2 M), and the shear is rounded once (4 M); boxes hold the vertex as the integer that
///    it was (1 M). For nearest hits, t counts from the origin before it was rounded (1 M).
///  - The parameter p inv + b of a plane p has an error of at most 8 u M: the node's origin is rounded to float (1 M)
///    and so is the plane (1 M), inv is rounded (2 M, as b has the same factor), so are b's product and pad (1 M each)
///    and the result (2 M).
///  - A direction component below 2^-80 counts as 2^-80, whose inverse times 12 M is a finite float. Within 6 M of the
///    origin the deviation is negligible.
/// The sum is at most 20 u M, and 24 u M are taken. For the tree over many placements M is smaller: see
/// KernelScene::top_pad_coordinate.
constexpr float kBoxPad = 24.0f * 0x1p-24f;
constexpr float kMinDirectionComponent = 0x1p-80f;

/// Relative error bound of t: rounding to float in unit space (2^-24) and once more in a tree's grid (2^-24).
constexpr double kUnitRounding = 0x1p-23;

/// The rays of a group in unit space, one array per value.
struct alignas(64) UnitRays {
  float origin[3][kGroup], direction[3][kGroup], tnear[kGroup];
  float tmax[kGroup]; ///< inclusive end: the float below tfar, or the t of the nearest hit so far
  bool one_origin;    ///< nearest hits only: all rays have the same origin, as camera rays do
};

struct Beam;

/// Returns 1 / x for a power of two in [2^-500, 2^500].
inline double inverse_of_power(double x) {
  return __builtin_bit_cast(double, (int64_t{2046} << 52) - __builtin_bit_cast(int64_t, x));
}

/// Bounding box of all points at which a group's rays may hit something, to compare a node's boxes with: see
/// group_bounds.h.
struct GroupBounds {
  float lo[3], hi[3];
  float flat;   ///< boxes whose extent along an axis is at most this are flat
  float pad[2]; ///< 0, and the pad at the side where rays start, for boxes with an extent
  // Set by set_octant():
  float sign[3];     ///< of the directions, 1 or -1
  float shift[3][2]; ///< rays reach a near plane p if sign p + shift[0] <= 0, a far plane p if shift[1] - sign p <= 0

  void set_octant(uint32_t octant) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const bool backward = ((octant >> axis) & 1u) != 0;
      sign[axis] = backward ? -1.0f : 1.0f;
      shift[axis][0] = backward ? lo[axis] : -hi[axis];
      shift[axis][1] = backward ? -hi[axis] : lo[axis];
    }
  }
};

/// One ray's data for triangle tests: its origin and shears along Woop's axes, and its range of t.
struct alignas(32) TestRay {
  float origin[3], begin, shear[3], end;
};
/// One ray's origin rounding error (exact minus rounded) along Woop's axes.
struct alignas(16) TestResidual {
  float along[3], unused;
};

constexpr GroupBounds kUnboundedGroup{{-__builtin_inff(), -__builtin_inff(), -__builtin_inff()},
                                      {__builtin_inff(), __builtin_inff(), __builtin_inff()},
                                      0.0f,
                                      {},
                                      {},
                                      {}};

/// Ray data for box tests, one array per value. Elements of unused rays are not initialised.
struct alignas(64) BoxRays {
  static constexpr bool kTriangles = false, kSideBySide = false;
  /// A ray crosses a near plane p at t = p inverse + bias[0], a far plane at t = p inverse - bias[1].
  float bias[3][kGroup][2];
  float limits[kGroup][2];  ///< begin and -end: hits lie in (begin, end]
  float inverse[3][kGroup]; ///< reciprocals of the direction, always finite
  uint64_t backward[3];     ///< rays whose x, y, z decrease with t, as bit masks
  // For nearest hits only:
  double t_begin[kGroup]; ///< unit-space t = (grid t + t_begin) t_scale
  double t_scale[kGroup]; ///< a power of two

  float unit_t(uint32_t i, float t) const { return static_cast<float>((double{t} + t_begin[i]) * t_scale[i]); }
  /// Returns a grid t that is not below any grid t that maps to `unit_t`. Where the origin was moved, several do.
  float t_of(uint32_t i, float unit_t) const {
    const double t = double{unit_t} * inverse_of_power(t_scale[i]);
    return static_cast<float>(t - t_begin[i] + (t_begin[i] != 0.0 ? kUnitRounding * t : 0.0));
  }
  void set_tmax(uint32_t i, float t) { limits[i][1] = -t; }
  float tmax(uint32_t i) const { return -limits[i][1]; }
};

/// Adds arrays for testing many rays at a node side by side, one per lane.
struct alignas(64) SideBySideRays : BoxRays {
  static constexpr bool kSideBySide = true;
  float near_bias[3][kGroup], far_bias[3][kGroup]; ///< bias[0] and -bias[1]
  float begin[kGroup], end[kGroup];                ///< limits[0] and -limits[1]
  GroupBounds reach;

  void set_tmax(uint32_t i, float t) {
    BoxRays::set_tmax(i, t);
    end[i] = t;
  }
};

/// Adds the data for triangle tests.
struct alignas(64) RayGroup : SideBySideRays {
  static constexpr bool kTriangles = true;
  float origin[3][kGroup];
  float shear[3][kGroup];   ///< Woop's (Sx, Sy, Sz)
  uint32_t axis[3][kGroup]; ///< Woop's (kx, ky, kz): axis numbers; kz is the axis of the direction's largest component
  uint64_t major[3];        ///< rays whose kx is x, y, z, as bit masks
  // For nearest hits only:
  float rest[3][kGroup]; ///< the origin's rounding error: exact minus rounded
  Beam* beam = nullptr;  ///< of all rays of the group, or null; see beam.h
  // For leaf tests:
  TestRay tests[kGroup];
  TestResidual rests[kGroup]; ///< for nearest hits only

  void set_tmax(uint32_t i, float t) {
    SideBySideRays::set_tmax(i, t);
    tests[i].end = t;
  }
};

/// Returns the next smaller floats: tfar itself is excluded.
inline Floats before_tfar(const Floats& tfar) { return reinterpret_cast<Floats>(reinterpret_cast<Ints>(tfar) - 1); }

/// Reads a block of rays, starting at element `first` of `out`.
/// @param numbers indices of the block's rays
[[gnu::always_inline]] inline void read_rays(const KernelRay* rays, const uint32_t (&numbers)[kBlock], uint32_t first,
                                             UnitRays& out) {
  static_assert(sizeof(KernelRay) == 32 && offsetof(KernelRay, tnear) == 12 && offsetof(KernelRay, direction) == 16 &&
                offsetof(KernelRay, tfar) == 28);
  const float* from[kBlock];
  for (uint32_t i = 0; i < kBlock; ++i) from[i] = reinterpret_cast<const float*>(rays + numbers[i]);
  Floats values[8];
  read_rows(from, values);
  transpose(values);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    write_block(&out.origin[axis][first], values[axis]);
    write_block(&out.direction[axis][first], values[4 + axis]);
  }
  write_block(&out.tnear[first], values[3]);
  write_block(&out.tmax[first], before_tfar(values[7]));
}

/// Whether the first `count` rays of a group have the same origin. take() fills the rest of the last block with copies.
inline bool start_at_one_place(const UnitRays& rays, uint32_t count) {
  Ints same = Ints{} - 1;
  for (uint32_t first = 0; first < count; first += kBlock)
    for (uint32_t axis = 0; axis < 3; ++axis) {
      Floats origin;
      read_block(origin, &rays.origin[axis][first]);
      same &= origin == rays.origin[axis][0];
    }
  return lane_bits(same) == kBlockLanes;
}

/// A block of rays in a tree's grid, the input of set_boxes() and set_shears().
struct RayBlock {
  Floats origin[3], direction[3], begin, end;
  Floats rest[3];    ///< RayGroup::rest; set for nearest hits and triangle tests only
  Floats inverse[3]; ///< RayGroup::inverse, set by set_boxes()
};

/// Writes the data for box tests of a block, starting at element `first` of the group.
/// @param pad_coordinate minimum of kBoxPad's M
/// @tparam kForBeam whether `limits` and `bias` are left to fill_records()
template <bool kForBeam, typename Group>
[[gnu::always_inline]] inline void set_boxes(RayBlock& block, float pad_coordinate, uint32_t first, Group& group) {
  Floats reach = Floats{} + pad_coordinate;
  for (uint32_t axis = 0; axis < 3; ++axis) keep_larger(reach, magnitude(block.origin[axis]));
  if constexpr (!kForBeam) write_pairs(&group.limits[first], block.begin, -block.end);
  if constexpr (Group::kSideBySide) {
    write_block(&group.begin[first], block.begin);
    write_block(&group.end[first], block.end);
  }
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const Floats d = block.direction[axis], size = magnitude(d);
    const Floats over = 1.0f / (size > kMinDirectionComponent ? size : Floats{} + kMinDirectionComponent);
    const Ints sign = reinterpret_cast<Ints>(d) & static_cast<int32_t>(0x80000000u);
    const Floats inverse = reinterpret_cast<Floats>(reinterpret_cast<Ints>(over) | sign);
    const Floats back = block.origin[axis] * inverse, away = kBoxPad * reach * over;
    block.inverse[axis] = inverse;
    write_block(&group.inverse[axis][first], inverse);
    if constexpr (!kForBeam) write_pairs(&group.bias[axis][first], -back - away, back - away);
    if constexpr (Group::kSideBySide) {
      write_block(&group.near_bias[axis][first], -back - away);
      write_block(&group.far_bias[axis][first], away - back);
    }
    group.backward[axis] |= uint64_t{lane_bits(inverse < 0.0f)} << first;
  }
}

/// Writes the data for triangle tests of a block, starting at element `first` of the group.
/// @param block after set_boxes()
/// @tparam kNearest whether block.rest is set
/// @tparam kForBeam whether `tests` and `rests` are left to fill_records()
template <bool kNearest, bool kForBeam>
inline void set_shears(const RayBlock& block, uint32_t first, RayGroup& group) {
  for (uint32_t axis = 0; axis < 3; ++axis) write_block(&group.origin[axis][first], block.origin[axis]);
  const Floats x = block.direction[0], y = block.direction[1], z = block.direction[2];
  const Floats ax = magnitude(x), ay = magnitude(y), az = magnitude(z);
  const Ints by_z = (az >= ax) & (az >= ay), by_y = ~by_z & (ay >= ax);
  const auto along_k = [&](const Floats(&v)[3], Floats(&rows)[8]) {
    rows[0] = by_z ? v[0] : by_y ? v[2] : v[1];
    rows[1] = by_z ? v[1] : by_y ? v[0] : v[2];
    rows[2] = by_z ? v[2] : by_y ? v[1] : v[0];
  };
  const Ints zero{};
  group.major[0] |= uint64_t{lane_bits(by_z)} << first;
  group.major[1] |= uint64_t{lane_bits(~by_z & ~by_y)} << first;
  group.major[2] |= uint64_t{lane_bits(by_y)} << first;
  write_block(&group.axis[0][first], by_z ? zero : by_y ? zero + 2 : zero + 1);
  write_block(&group.axis[1][first], by_z ? zero + 1 : by_y ? zero : zero + 2);
  write_block(&group.axis[2][first], by_z ? zero + 2 : by_y ? zero + 1 : zero);
  Floats rows[8];
  along_k(block.direction, rows);
  const Floats along = rows[2];
  rows[4] = rows[0] / along, rows[5] = rows[1] / along;
  rows[6] = by_z ? block.inverse[2] : by_y ? block.inverse[1] : block.inverse[0]; // 1 / along
  for (uint32_t axis = 0; axis < 3; ++axis) write_block(&group.shear[axis][first], rows[4 + axis]);
  if constexpr (kNearest)
    for (uint32_t axis = 0; axis < 3; ++axis) write_block(&group.rest[axis][first], block.rest[axis]);
  if constexpr (kForBeam) return;
  along_k(block.origin, rows);
  rows[3] = block.begin, rows[7] = block.end;
  transpose(rows);
  write_rows(rows, &group.tests[first]);
  if constexpr (kNearest) {
    Floats rests[8]{};
    along_k(block.rest, rests);
    transpose(rests);
    write_rows(rests, &group.rests[first]);
  }
}

/// Writes what set_boxes() and set_shears() leave out for a beam.
inline void fill_records(RayGroup& group) {
  for (uint32_t first = 0; first < kGroup; first += kBlock) {
    RayBlock block;
    Ints k0;
    read_block(block.begin, &group.begin[first]);
    read_block(block.end, &group.end[first]);
    read_block(k0, &group.axis[0][first]);
    write_pairs(&group.limits[first], block.begin, -block.end);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      Floats near, far;
      read_block(near, &group.near_bias[axis][first]);
      read_block(far, &group.far_bias[axis][first]);
      write_pairs(&group.bias[axis][first], near, -far);
      read_block(block.origin[axis], &group.origin[axis][first]);
      read_block(block.rest[axis], &group.rest[axis][first]);
    }
    Floats rows[8], rests[8]{};
    for (uint32_t k = 0; k < 3; ++k) {
      const auto along_k = [&](const Floats(&v)[3]) {
        return k0 == 0 ? v[k] : k0 == 1 ? v[(k + 1) % 3] : v[(k + 2) % 3];
      };
      rows[k] = along_k(block.origin), rests[k] = along_k(block.rest);
      read_block(rows[4 + k], &group.shear[k][first]);
    }
    rows[3] = block.begin, rows[7] = block.end;
    transpose(rows);
    write_rows(rows, &group.tests[first]);
    transpose(rests);
    write_rows(rests, &group.rests[first]);
  }
}

} // namespace
} // namespace packtrace::packed
