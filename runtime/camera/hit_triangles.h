#pragma once

#include <algorithm>
#include <cstdint>

#include "runtime/camera/ray_columns.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// The distinct triangles that a batch of rays hit, in the order in which they were found. Each is decoded once.
class HitTriangles {
public:
  void clear() { count_ = 0; }

  /// Returns the number of the triangle of a hit, which may be a new one.
  uint32_t number_of(const RayHit& hit) {
    if (count_ > 0 && is_on(hit, count_ - 1)) return count_ - 1;
    uint8_t& found = found_[(hit.triangle + hit.part * 41u + hit.placement * 13u) % kMaxColumnRays];
    if (found < count_ && is_on(hit, found)) return found;
    hits_[count_] = hit;
    return found = static_cast<uint8_t>(count_++); // after a hash collision, a triangle may get a second number
  }

  /// Decodes all triangles.
  void resolve(const RayTracer& tracer, const SceneSource& source);

  uint32_t count() const { return count_; }
  const HitSurface& surface(uint32_t number) const { return surfaces_[number]; }
  const uint32_t* instances() const { return instances_; }
  const uint32_t* materials() const { return materials_; }
  const uint32_t* triangles() const { return triangles_; } ///< HitSurface::triangle
  const TriangleColumns& columns() const { return columns_; }
  /// False if normals must be looked up for each hit.
  bool has_normals() const { return has_normals_; }

private:
  bool is_on(const RayHit& hit, uint32_t number) const {
    const RayHit& other = hits_[number];
    return hit.triangle == other.triangle && hit.part == other.part && hit.placement == other.placement;
  }

  uint32_t count_ = 0;
  uint8_t found_[kMaxColumnRays]{}; ///< numbers by a hash of the triangle; verified by is_on()
  RayHit hits_[kMaxColumnRays];     ///< one on each triangle
  HitSurface surfaces_[kMaxColumnRays];
  SurfaceQuery places_[kMaxColumnRays]; ///< of the hits
  TriangleAttributes attributes_[kMaxColumnRays];
  uint32_t instances_[kMaxColumnRays], materials_[kMaxColumnRays], triangles_[kMaxColumnRays];
  TriangleColumns columns_;
  bool has_normals_ = true;
};
static_assert(kMaxColumnRays <= 256);

/// Divides rays into runs of equivalent placements, which share one vectorised loop.
class PlacementRuns {
public:
  /// @param alike whether two placements are equivalent
  template <typename Alike>
  void sort(const HitTriangles& triangles, const Alike& alike) {
    count_ = 0;
    for (uint32_t t = 0; t < triangles.count(); ++t) {
      const Placement* const placement = triangles.surface(t).placement;
      uint32_t kind = count_;
      while (kind > 0 && kinds_[kind - 1] != placement) --kind;
      if (kind == 0 && count_ > 0 && alike(*kinds_[count_ - 1], *placement)) kind = count_;
      if (kind == 0) kinds_[count_++] = placement, kind = count_;
      kind_of_[t] = static_cast<uint8_t>(kind - 1);
    }
  }

  /// Calls work(placement, first, count) for ranges that cover all rays in ascending order. A range may begin within
  /// the one before, whose last elements it replaces: so all but the last are multiples of whole vectors.
  template <typename Work>
  void for_each(const int32_t* triangle_of_ray, uint32_t ray_count, const Work& work) const {
    constexpr uint32_t kVector = 4;
    for (uint32_t first = 0; first < ray_count;) {
      const uint8_t kind = kind_of_[triangle_of_ray[first]];
      uint32_t end = count_ == 1 ? ray_count : first + 1;
      while (end < ray_count && kind_of_[triangle_of_ray[end]] == kind) ++end;
      const uint32_t whole = (end - first + kVector - 1) / kVector * kVector;
      work(*kinds_[kind], first, std::min(whole, ray_count - first));
      first = end;
    }
  }

private:
  uint32_t count_ = 0;
  const Placement* kinds_[kMaxColumnRays];
  uint8_t kind_of_[kMaxColumnRays]; ///< by number of the triangle
};

} // namespace packtrace
