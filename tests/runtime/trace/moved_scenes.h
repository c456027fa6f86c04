#pragma once

#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "compress/format/cluster/position_grid.h"
#include "compress/format/deformation/frame_vertices.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "tests/runtime/trace/packed_scenes.h"

/// Frames of deforming geometries made by moving the vertices of a baked file.
namespace packtrace::test {

/// Object-space position of a vertex of the file in a frame.
using Motion = std::function<DVec3(DVec3 position)>;

/// The lattice box of all vertices of a geometry in several frames.
inline DeformingGeometry range_of(const BakedFile& file, uint32_t geometry, std::span<const Motion> frames) {
  constexpr int64_t kMax = std::numeric_limits<int64_t>::max(), kMin = std::numeric_limits<int64_t>::min();
  DeformingGeometry out{geometry, {{kMax, kMax, kMax}, {kMin, kMin, kMin}}};
  const baked::GeometryRecord& record = file.geometries()[geometry];
  const double step = PositionGrid{record.step_mantissa, record.step_exponent}.step();
  const auto extend = [&](const LatticePoint& q) {
    for (size_t axis = 0; axis < 3; ++axis) {
      out.range.lo[axis] = std::min(out.range.lo[axis], q[axis]);
      out.range.hi[axis] = std::max(out.range.hi[axis], q[axis]);
    }
  };
  for (uint32_t c = 0; c < record.cluster_count; ++c) {
    const ClusterView view = file.cluster(geometry, c);
    for (uint32_t v = 0; v < view.vertex_count(); ++v) {
      extend(view.lattice(v));
      for (const Motion& frame : frames) {
        const DVec3 p = frame(DVec3(view.position(v)));
        extend({to_lattice(p.x, step), to_lattice(p.y, step), to_lattice(p.z, step)});
      }
    }
  }
  return out;
}

/// The file's vertices, moved.
class MovedVertices final : public FrameVertices {
public:
  MovedVertices(const BakedFile& file, const DeformingGeometry& geometry, Motion motion)
      : file_(file), geometry_(geometry), motion_(std::move(motion)) {}

  void read(uint32_t cluster, std::span<FramePoint> out) const override {
    const ClusterView view = file_.cluster(geometry_.geometry, cluster);
    for (uint32_t v = 0; v < out.size(); ++v) {
      const DVec3 p = motion_(DVec3(view.position(v)));
      for (size_t axis = 0; axis < 3; ++axis)
        out[v][axis] = static_cast<int32_t>(to_lattice(p[static_cast<int>(axis)], step()) - geometry_.range.lo[axis]);
      out[v][3] = 0;
    }
  }

  /// As kernels decode it.
  Vec3 position(uint32_t cluster, uint32_t vertex) const {
    std::vector<FramePoint> points(file_.cluster(geometry_.geometry, cluster).vertex_count());
    read(cluster, points);
    Vec3 p;
    for (size_t axis = 0; axis < 3; ++axis)
      p[static_cast<int>(axis)] = from_lattice(geometry_.range.lo[axis] + points[vertex][axis], step());
    return p;
  }

private:
  double step() const {
    const baked::GeometryRecord& record = file_.geometries()[geometry_.geometry];
    return PositionGrid{record.step_mantissa, record.step_exponent}.step();
  }

  const BakedFile& file_;
  const DeformingGeometry geometry_;
  const Motion motion_;
};

/// A source whose deforming geometries are decoded in one frame.
class DeformedSource final : public SceneSource {
public:
  DeformedSource(const BakedScene& scene, std::vector<const MovedVertices*> moved)
      : file_(scene.file), still_(scene.source), moved_(std::move(moved)) {}

  uint32_t geometry_count() const override { return still_.geometry_count(); }
  GeometryCounts counts(uint32_t geometry) const override { return still_.counts(geometry); }
  void decode(uint32_t geometry, std::span<Vec3> positions, std::span<Triangle> triangles) const override {
    still_.decode(geometry, positions, triangles);
    const MovedVertices* moved = geometry < moved_.size() ? moved_[geometry] : nullptr;
    if (moved == nullptr) return;
    size_t next = 0;
    for (uint32_t c = 0; c < file_.clusters(geometry).size(); ++c)
      for (uint32_t v = 0; v < file_.clusters(geometry)[c].vertex_count; ++v) positions[next++] = moved->position(c, v);
  }
  uint32_t material_of(uint32_t instance, uint32_t triangle) const override {
    return still_.material_of(instance, triangle);
  }
  std::optional<Vec3> shading_normal(uint32_t, uint32_t, Vec2) const override { return std::nullopt; }
  std::array<Vec2, 3> corner_uvs(uint32_t geometry, uint32_t triangle) const override {
    return still_.corner_uvs(geometry, triangle);
  }
  float position_error(uint32_t geometry) const override { return still_.position_error(geometry); }
  std::span<const PlacedGeometry> instances() const override { return still_.instances(); }
  std::span<const Material> materials() const override { return still_.materials(); }
  AlphaMaskView mask(uint32_t index) const override { return still_.mask(index); }
  std::span<const Camera> cameras() const override { return still_.cameras(); }
  Bounds world_bounds() const override { return still_.world_bounds(); }
  DVec3 origin() const override { return still_.origin(); }
  uint64_t resident_bytes() const override { return still_.resident_bytes(); }

private:
  const BakedFile& file_;
  const SceneSource& still_;
  const std::vector<const MovedVertices*> moved_; ///< by geometry; null for those that stay
};

/// A box around a scene of a ground, masked, squeezed, mirrored and turned instances of a sphere, in which the sphere
/// of radius 1 moves. The sphere is the only geometry with a tree of its own.
inline constexpr uint32_t kMovingSphere = 1;
inline Scene moving_scene(uint32_t instances = 4) {
  Scene scene;
  add_shape(scene, quad({-8, -2, -8}, {0, 0, 16}, {16, 0, 0}));
  add_object(scene, sphere({0, 0, 0}, 1, 32));
  for (uint32_t i = 0; i < instances; ++i) {
    const double x = static_cast<double>(i % 8) * 2.5 - 3, z = static_cast<double>(i / 8) * 2.5 - 2;
    scene.instances.push_back(
        {0, Affine(placed({x, 1, z}, {i % 3 == 1 ? -1.0 : 1.0, 0.5 + 0.25 * (i % 4), 1}, 30.0 * i, {0.2, 1, 0.1}))});
  }
  return scene;
}

/// Waves that grow along y; continuous, so a closed surface stays closed.
inline Motion wave(double t) {
  return [t](DVec3 p) {
    const double sway = 0.4 * (p.y + 1.0) * std::sin(t + 2.0 * p.y);
    return DVec3(p.x * (1.0 + 0.3 * std::sin(t)) + sway, p.y * (1.0 + 0.2 * std::cos(2.0 * t)),
                 p.z + 0.3 * std::sin(3.0 * p.x + t));
  };
}

} // namespace packtrace::test
