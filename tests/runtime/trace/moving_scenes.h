#pragma once

#include <numeric>
#include <random>
#include <vector>

#include "runtime/trace/movers.h"
#include "tests/runtime/trace/packed_scenes.h"

namespace packtrace::test {

/// A source with other transforms of its instances.
class MovedSource final : public SceneSource {
public:
  MovedSource(const SceneSource& source, std::span<const Affine> world_from_object)
      : source_(source), instances_(source.instances().begin(), source.instances().end()) {
    for (size_t i = 0; i < instances_.size(); ++i) instances_[i].world_from_object = world_from_object[i];
  }

  uint32_t geometry_count() const override { return source_.geometry_count(); }
  GeometryCounts counts(uint32_t geometry) const override { return source_.counts(geometry); }
  void decode(uint32_t geometry, std::span<Vec3> positions, std::span<Triangle> triangles) const override {
    source_.decode(geometry, positions, triangles);
  }
  uint32_t material_of(uint32_t instance, uint32_t triangle) const override {
    return source_.material_of(instance, triangle);
  }
  std::optional<Vec3> shading_normal(uint32_t geometry, uint32_t triangle, Vec2 barycentrics) const override {
    return source_.shading_normal(geometry, triangle, barycentrics);
  }
  std::array<Vec2, 3> corner_uvs(uint32_t geometry, uint32_t triangle) const override {
    return source_.corner_uvs(geometry, triangle);
  }
  float position_error(uint32_t geometry) const override { return source_.position_error(geometry); }
  std::span<const PlacedGeometry> instances() const override { return instances_; }
  std::span<const Material> materials() const override { return source_.materials(); }
  AlphaMaskView mask(uint32_t index) const override { return source_.mask(index); }
  std::span<const Camera> cameras() const override { return source_.cameras(); }
  Bounds world_bounds() const override { return source_.world_bounds(); }
  DVec3 origin() const override { return source_.origin(); }
  uint64_t resident_bytes() const override { return source_.resident_bytes(); }

private:
  const SceneSource& source_;
  std::vector<PlacedGeometry> instances_;
};

inline std::vector<Affine> transforms_of(const SceneSource& source) {
  std::vector<Affine> result;
  for (const PlacedGeometry& placed : source.instances()) result.push_back(placed.world_from_object);
  return result;
}

/// Returns every instance from `first` on as a mover.
inline Movers movers_from(uint32_t first, const SceneSource& source, const Bounds& world) {
  Movers movers{std::vector<uint32_t>(source.instances().size() - first), world};
  std::iota(movers.instances.begin(), movers.instances.end(), first);
  return movers;
}

} // namespace packtrace::test
