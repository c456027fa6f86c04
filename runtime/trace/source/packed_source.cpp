#include "runtime/trace/source/packed_source.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/file/baked_file.h"
#include "runtime/trace/source/cluster_look_up.h"

namespace packtrace {

TriangleNormals::TriangleNormals(const ClusterView& cluster, uint32_t triangle) {
  const Triangle v = cluster.triangle(triangle);
  for (int corner = 0; corner < 3; ++corner) corners[corner] = cluster.normal(v[corner]);
}

std::optional<Vec3> TriangleNormals::at(Vec2 barycentrics) const {
  const Vec3 n = packtrace::interpolated_normal(corners[0], corners[1], corners[2], barycentrics.x, barycentrics.y);
  const float length = glm::length(n);
  if (!(length > 0.0f)) return std::nullopt; // Opposite vertex normals cancel.
  return n / length;
}

std::optional<Vec3> interpolated_normal(const ClusterView& cluster, uint32_t triangle, Vec2 barycentrics) {
  if (!cluster.has_normals()) return std::nullopt;
  return TriangleNormals(cluster, triangle).at(barycentrics);
}

std::array<Vec2, 3> corner_uvs(const ClusterView& cluster, uint32_t triangle) {
  if (!cluster.has_uvs()) return {Vec2(0), Vec2(0), Vec2(0)};
  const Triangle v = cluster.triangle(triangle);
  return {cluster.uv(v.x), cluster.uv(v.y), cluster.uv(v.z)};
}

PackedSource::PackedSource(const BakedFile& file)
    : file_(file), materials_(file.materials()), shading_(file.shading()), cameras_(file.cameras()),
      world_bounds_(file.world_bounds()) {
  instances_.reserve(file.instances().size());
  for (uint32_t i = 0; i < file.instances().size(); ++i)
    instances_.push_back({file.instances()[i].geometry, file.world_from_object(i)});
}

DVec3 PackedSource::origin() const { return file_.origin(); }

uint32_t PackedSource::geometry_count() const { return file_.base_geometry_count(); }

GeometryCounts PackedSource::counts(uint32_t geometry) const {
  const baked::GeometryRecord& record = file_.geometries()[geometry];
  return {record.vertex_count, record.triangle_count};
}

void PackedSource::decode(uint32_t geometry, std::span<Vec3> positions, std::span<Triangle> triangles) const {
  assert(positions.size() == counts(geometry).vertices && triangles.size() == counts(geometry).triangles);
  const auto clusters = static_cast<uint32_t>(file_.clusters(geometry).size());
  for (uint32_t c = 0; c < clusters; ++c) {
    const ClusterView cluster = file_.cluster(geometry, c);
    const baked::ClusterRecord& record = cluster.record();
    decode_positions(cluster, positions.subspan(record.first_vertex, cluster.vertex_count()));
    decode_indices(cluster, record.first_vertex, triangles.subspan(record.first_triangle, cluster.triangle_count()));
  }
}

uint32_t PackedSource::material_of(uint32_t instance, uint32_t triangle) const {
  const uint32_t geometry = instances_[instance].geometry;
  const uint32_t cluster = file_.cluster_of_triangle(geometry, triangle);
  return file_.instance_materials(instance)[file_.clusters(geometry)[cluster].material_slot];
}

std::optional<Vec3> PackedSource::shading_normal(uint32_t geometry, uint32_t triangle, Vec2 barycentrics) const {
  const ClusterView cluster = file_.cluster(geometry, file_.cluster_of_triangle(geometry, triangle));
  return interpolated_normal(cluster, triangle - cluster.record().first_triangle, barycentrics);
}

void PackedSource::look_up(std::span<const SurfaceQuery> places, std::span<SurfaceAttributes> out) const {
  look_up_in_clusters(file_, instances_, places, out, [&](uint32_t geometry, uint32_t triangle, uint32_t& first) {
    return find(geometry, triangle, first);
  });
}

bool PackedSource::look_up_triangles(std::span<const SurfaceQuery> places, std::span<TriangleAttributes> out) const {
  look_up_triangles_in_clusters(
      file_, instances_, places, out,
      [&](uint32_t geometry, uint32_t triangle, uint32_t& first) { return find(geometry, triangle, first); });
  return true;
}

ClusterView PackedSource::find(uint32_t geometry, uint32_t triangle, uint32_t& first) const {
  const ClusterView cluster = file_.cluster(geometry, file_.cluster_of_triangle(geometry, triangle));
  first = cluster.record().first_triangle;
  return cluster;
}

std::array<Vec2, 3> PackedSource::corner_uvs(uint32_t geometry, uint32_t triangle) const {
  const ClusterView cluster = file_.cluster(geometry, file_.cluster_of_triangle(geometry, triangle));
  return packtrace::corner_uvs(cluster, triangle - cluster.record().first_triangle);
}

float PackedSource::position_error(uint32_t geometry) const {
  const double bound = file_.geometries()[geometry].position_error_bound;
  const auto rounded = static_cast<float>(bound);
  return rounded >= bound ? rounded : std::nextafter(rounded, std::numeric_limits<float>::infinity());
}

SurfaceDetail PackedSource::detail_of(uint32_t instance, uint32_t triangle) const {
  const uint32_t geometry = instances_[instance].geometry;
  SurfaceDetail detail;
  detail.cluster =
      static_cast<uint32_t>(file_.geometries()[geometry].first_cluster) + file_.cluster_of_triangle(geometry, triangle);
  return detail;
}

TextureView PackedSource::texture(uint32_t index) const { return file_.texture(index); }

bool PackedSource::may_emit(uint32_t instance) const {
  return std::ranges::any_of(file_.instance_materials(instance),
                             [&](uint32_t material) { return materials_[material].shading.emits(); });
}

bool PackedSource::has_shading() const { return file_.has_shading(); }

AlphaMaskView PackedSource::mask(uint32_t index) const { return file_.mask(index); }

uint64_t PackedSource::resident_bytes() const {
  return file_.file_bytes() + materials_.size() * sizeof(Material) + cameras_.size() * sizeof(Camera) +
         instances_.size() * sizeof(PlacedGeometry) + map_bytes(shading_.maps);
}

} // namespace packtrace
