#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// A scene source that hides some instances. The others keep their numbers.
class OtherInstances final : public SceneSource {
public:
  /// How an instance is left out.
  enum class Absent : uint8_t {
    kFlat,  ///< flattened to a point: tracers of packed clusters place no tree for it
    kEmpty, ///< has a further geometry without triangles, for tracers that copy triangles
  };
  /// @param source must outlive this object
  /// @param left_out instances of it
  OtherInstances(const SceneSource& source, std::span<const uint32_t> left_out, Absent absent)
      : source_(source), absent_(absent), instances_(source.instances().begin(), source.instances().end()) {
    for (const uint32_t i : left_out) {
      if (absent == Absent::kEmpty) instances_[i].geometry = source.geometry_count();
      for (int column = 0; column < 3 && absent == Absent::kFlat; ++column)
        instances_[i].world_from_object[column] = Vec3(0.0f);
    }
  }

  uint32_t geometry_count() const override { return source_.geometry_count() + (absent_ == Absent::kEmpty ? 1 : 0); }
  GeometryCounts counts(uint32_t g) const override { return has(g) ? source_.counts(g) : GeometryCounts{}; }
  void decode(uint32_t g, std::span<Vec3> positions, std::span<Triangle> triangles) const override {
    if (has(g)) source_.decode(g, positions, triangles);
  }
  uint32_t material_of(uint32_t instance, uint32_t triangle) const override {
    return source_.material_of(instance, triangle);
  }
  std::optional<Vec3> shading_normal(uint32_t g, uint32_t triangle, Vec2 barycentrics) const override {
    return source_.shading_normal(g, triangle, barycentrics);
  }
  std::array<Vec2, 3> corner_uvs(uint32_t g, uint32_t triangle) const override {
    return source_.corner_uvs(g, triangle);
  }
  float position_error(uint32_t g) const override { return has(g) ? source_.position_error(g) : 0.0f; }
  std::span<const PlacedGeometry> instances() const override { return instances_; }
  std::span<const Material> materials() const override { return source_.materials(); }
  AlphaMaskView mask(uint32_t index) const override { return source_.mask(index); }
  std::span<const Camera> cameras() const override { return source_.cameras(); }
  Bounds world_bounds() const override { return source_.world_bounds(); }
  DVec3 origin() const override { return source_.origin(); }
  uint64_t resident_bytes() const override { return source_.resident_bytes(); }

  /// Memory of this object's own list.
  uint64_t bytes() const { return instances_.size() * sizeof(PlacedGeometry); }

private:
  bool has(uint32_t geometry) const { return geometry < source_.geometry_count(); }

  const SceneSource& source_;
  Absent absent_;
  std::vector<PlacedGeometry> instances_;
};

} // namespace packtrace
