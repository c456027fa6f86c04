#include "runtime/trace/source/lod_source.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <string>

#include "compress/format/cluster/cluster_codec.h"
#include "pbrt_import/base/error.h"
#include "runtime/trace/source/cluster_look_up.h"

namespace packtrace {
namespace {

/// Returns level 0 alone as one group that was never simplified.
LodGeometry without_levels(const BakedFile& file, uint32_t geometry) {
  baked::LodGroupRecord group{};
  group.error = std::numeric_limits<float>::infinity();
  std::vector<uint32_t> triangles;
  for (const baked::ClusterRecord& cluster : file.clusters(geometry)) triangles.push_back(cluster.triangle_count);
  if (triangles.empty()) {
    triangles.push_back(0);
  } else {
    const Bounds box = object_bounds(file.geometries()[geometry]);
    const DVec3 center = box.centre();
    for (int axis = 0; axis < 3; ++axis) group.center[static_cast<size_t>(axis)] = static_cast<float>(center[axis]);
    group.radius = static_cast<float>(box.diagonal()) * 0.51f;
  }
  const std::vector<LodLink> links(triangles.size(), {0, baked::kNoLodGroup});
  return {{&group, 1}, links, triangles};
}

} // namespace

std::vector<LodGeometry> lod_geometries(const BakedFile& file) {
  std::vector<LodGeometry> geometries;
  geometries.reserve(file.base_geometry_count());
  std::vector<uint32_t> triangles;
  for (uint32_t g = 0; g < file.base_geometry_count(); ++g) {
    const LodView lod = file.lod(g);
    if (lod.levels.empty()) {
      geometries.push_back(without_levels(file, g));
      continue;
    }
    triangles.clear();
    for (const baked::LodLevelRecord& level : lod.levels)
      for (const baked::ClusterRecord& cluster : file.clusters(level.geometry))
        triangles.push_back(cluster.triangle_count);
    geometries.emplace_back(lod.groups, lod.links(), triangles);
  }
  return geometries;
}

std::vector<LodInstance> lod_instances(const SceneSource& source) {
  std::vector<LodInstance> instances;
  for (const PlacedGeometry& placed : source.instances())
    instances.push_back({placed.geometry, DAffine(placed.world_from_object)});
  return instances;
}

LodSource::LodSource(const BakedFile& file, const PackedSource& source, const LodSharing& sharing, const LodPlan& plan)
    : file_(file), source_(source), instances_(source.instances().begin(), source.instances().end()) {
  for (const PlannedBlas& blas : plan.blas) {
    const LodGeometry& geometry = sharing.geometries()[blas.geometry];
    add_blas(geometry, blas.geometry, passed_of_blas(geometry, sharing.steps(blas.geometry), plan, blas));
  }
  stretch_.reserve(instances_.size());
  for (size_t i = 0; i < instances_.size(); ++i) {
    instances_[i].geometry = plan.blas_of_instance[i];
    stretch_.push_back(largest_stretch(DAffine(instances_[i].world_from_object)));
  }
}

void LodSource::add_blas(const LodGeometry& geometry, uint32_t number, std::span<const uint64_t> passed) {
  Blas blas;
  blas.geometry = number;
  blas.first_cluster = clusters_.size();
  const LodView lod = file_.lod(number);
  uint64_t triangles = 0, vertices = 0;
  uint32_t level = 0, first = 0; // first: number of the first cluster of the level
  uint32_t holder = number;      // the level's geometry in the file
  for (const uint32_t c : clusters_of_cut(geometry, passed)) {
    while (c - first >= file_.clusters(holder).size()) {
      if (level + 1 >= lod.levels.size()) return blas_.push_back(blas); // The geometry has no clusters.
      first += static_cast<uint32_t>(file_.clusters(holder).size());
      holder = lod.levels[++level].geometry;
    }
    const uint32_t from = geometry.links()[c].generating_group;
    const float error = from == baked::kNoLodGroup ? 0.0f : lod.groups[from].error;
    const baked::ClusterRecord& record = file_.clusters(holder)[c - first];
    clusters_.push_back(
        {holder, c - first, level, static_cast<uint32_t>(triangles), static_cast<uint32_t>(vertices), error});
    triangles += record.triangle_count, vertices += record.vertex_count;
    if (std::max(triangles, vertices) > std::numeric_limits<uint32_t>::max())
      throw Error(ErrorKind::kLimitExceeded,
                  "a cut of geometry " + std::to_string(number) + " has 2^32 triangles or vertices, or more");
  }
  blas.cluster_count = clusters_.size() - blas.first_cluster;
  blas.triangles = static_cast<uint32_t>(triangles), blas.vertices = static_cast<uint32_t>(vertices);
  blas_.push_back(blas);
}

GeometryCounts LodSource::counts(uint32_t blas) const { return {blas_[blas].vertices, blas_[blas].triangles}; }

void LodSource::decode(uint32_t blas, std::span<Vec3> positions, std::span<Triangle> triangles) const {
  assert(positions.size() == blas_[blas].vertices && triangles.size() == blas_[blas].triangles);
  for (const BlasCluster& c : clusters(blas)) {
    const ClusterView cluster = view(c);
    decode_positions(cluster, positions.subspan(c.first_vertex, cluster.vertex_count()));
    decode_indices(cluster, c.first_vertex, triangles.subspan(c.first_triangle, cluster.triangle_count()));
  }
}

const BlasCluster& LodSource::find(uint32_t blas, uint32_t triangle) const {
  const std::span<const BlasCluster> all = clusters(blas);
  const auto next = std::upper_bound(all.begin(), all.end(), triangle,
                                     [](uint32_t t, const BlasCluster& c) { return t < c.first_triangle; });
  return *(next - 1);
}

uint32_t LodSource::triangle_number(uint32_t blas, uint32_t cluster, uint32_t triangle) const {
  const std::span<const BlasCluster> all = clusters(blas);
  const auto found = std::lower_bound(all.begin(), all.end(), cluster, [&](const BlasCluster& c, uint32_t number) {
    return file_.geometries()[c.geometry].first_cluster + c.cluster < number;
  });
  return found->first_triangle + triangle;
}

uint32_t LodSource::material_of(uint32_t instance, uint32_t triangle) const {
  const BlasCluster& c = find(instances_[instance].geometry, triangle);
  return file_.instance_materials(instance)[file_.clusters(c.geometry)[c.cluster].material_slot];
}

std::optional<Vec3> LodSource::shading_normal(uint32_t blas, uint32_t triangle, Vec2 barycentrics) const {
  const BlasCluster& c = find(blas, triangle);
  return interpolated_normal(view(c), triangle - c.first_triangle, barycentrics);
}

void LodSource::look_up(std::span<const SurfaceQuery> places, std::span<SurfaceAttributes> out) const {
  look_up_in_clusters(file_, instances_, places, out, [&](uint32_t blas, uint32_t triangle, uint32_t& first) {
    const BlasCluster& c = find(blas, triangle);
    first = c.first_triangle;
    return view(c);
  });
}

bool LodSource::look_up_triangles(std::span<const SurfaceQuery> places, std::span<TriangleAttributes> out) const {
  look_up_triangles_in_clusters(file_, instances_, places, out, [&](uint32_t blas, uint32_t triangle, uint32_t& first) {
    const BlasCluster& c = find(blas, triangle);
    first = c.first_triangle;
    return view(c);
  });
  return true;
}

std::array<Vec2, 3> LodSource::corner_uvs(uint32_t blas, uint32_t triangle) const {
  const BlasCluster& c = find(blas, triangle);
  return packtrace::corner_uvs(view(c), triangle - c.first_triangle);
}

SurfaceDetail LodSource::detail_of(uint32_t instance, uint32_t triangle) const {
  const BlasCluster& c = find(instances_[instance].geometry, triangle);
  return {c.level, static_cast<uint32_t>(file_.geometries()[c.geometry].first_cluster + c.cluster),
          static_cast<float>(c.error * stretch_[instance])};
}

Bounds LodSource::bounds(uint32_t blas) const {
  Bounds all;
  uint32_t last = ~0u;
  for (const BlasCluster& c : clusters(blas)) {
    if (c.geometry == last) continue;
    all.extend(object_bounds(file_.geometries()[last = c.geometry]));
  }
  return all;
}

uint64_t LodSource::resident_bytes() const {
  return source_.resident_bytes() + blas_.size() * sizeof(Blas) + clusters_.size() * sizeof(BlasCluster) +
         instances_.size() * (sizeof(PlacedGeometry) + sizeof(double));
}

} // namespace packtrace
