#include "runtime/trace/gpu/surface_tables.h"

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/layout/bit_stream.h"
#include "runtime/trace/packed/scene/placed_trees.h"
#include "runtime/trace/packed/scene/traced_trees.h"

namespace packtrace {
namespace {

gpu::InstanceSurface instance_surface(const Placement& placement, const Affine& world_from_object) {
  gpu::InstanceSurface out{};
  for (int column = 0; column < 4; ++column)
    for (int axis = 0; axis < 3; ++axis)
      out.unit_from_surface[3 * column + axis] = placement.unit_from_surface[column][axis];
  for (int column = 0; column < 3; ++column)
    for (int axis = 0; axis < 3; ++axis) out.world_from_object[3 * column + axis] = world_from_object[column][axis];
  return out;
}

gpu::NormalRecord normal_record(const ClusterView& cluster, uint32_t instance) {
  gpu::NormalRecord out{};
  out.instance = instance;
  if (!cluster.has_normals()) return out;
  const baked::ClusterRecord& record = cluster.record();
  const ClusterView::StreamBits bits = cluster.stream_bits();
  const bool mixed = (record.flags & baked::kClusterMixedCharts) != 0;
  const uint32_t chart = (uint32_t{record.flags} & baked::kClusterChart) >> baked::kClusterChartShift;
  const uint32_t chart_bits = mixed ? bits_for_count(format_of(cluster.normal_encoding()).charts) : 0;
  out.place = static_cast<uint32_t>(bits.indices + bits.positions) |
              static_cast<uint32_t>(cluster.normal_encoding()) << 20 | chart << 24 | gpu::kHasNormals;
  out.widths = uint32_t{record.normal_bits[0]} | uint32_t{record.normal_bits[1]} << 5 | chart_bits << 10 |
               bits_for_count(record.normal_palette) << 13 | uint32_t{record.normal_palette} << 17;
  out.anchors =
      static_cast<uint16_t>(record.normal_anchor[0]) | uint32_t{static_cast<uint16_t>(record.normal_anchor[1])} << 16;
  return out;
}

} // namespace

SurfaceTables surface_tables(const BakedFile& file, const SceneSource& source, const PackedTracer& tracer) {
  SurfaceTables out;
  const PlacedTrees& placed = tracer.placed_trees();
  const TracedTrees& traced = tracer.traced_trees();
  const std::span<const Affine> moved = tracer.world_from_object();
  const std::span<const PlacedGeometry> instances = source.instances();
  out.instances.resize(instances.size());
  for (uint32_t i = 0; i < instances.size(); ++i)
    if (placed.is_placed(i))
      out.instances[i] = instance_surface(placed.surface(i), moved.empty() ? instances[i].world_from_object : moved[i]);
  for (uint32_t p = 0; p < placed.count(); ++p) out.lookup.push_back(placed.instance_of(p));
  static_assert(baked::kNone == gpu::kNoInstance);
  const std::span<const packed::TraceCluster> clusters = traced.clusters();
  const std::span<const baked::GeometryRecord> geometries = file.geometries();
  uint32_t g = 0;
  for (uint32_t i = 0; i < clusters.size(); ++i) {
    gpu::NormalRecord record{};
    while (g + 1 < geometries.size() && geometries[g + 1].first_cluster <= i) ++g;
    if (clusters[i].bits != nullptr) {
      const bool in_world = traced.records[traced.grid_of[g]].geometry == baked::kWorldTree;
      record = normal_record(file.cluster(g, static_cast<uint32_t>(i - geometries[g].first_cluster)),
                             in_world ? tracer.first_instance(g) : gpu::kNoInstance);
    }
    out.lookup.insert(out.lookup.end(), {record.place, record.widths, record.anchors, record.instance});
  }
  return out;
}

gpu::SurfaceViewRecord surface_view_record(const PrimaryCamera& now, const PrimaryCamera& previous,
                                           const UnitSpace& space, double no_motion_px) {
  gpu::SurfaceViewRecord out{};
  out.inverse_scale = space.inverse_scale();
  const DAffine &here = now.camera_from_world(), &before = previous.camera_from_world();
  for (int column = 0; column < 4; ++column) {
    out.depth[column] = here[column].z;
    for (int axis = 0; axis < 3; ++axis) out.before[3 * column + axis] = before[column][axis];
  }
  out.depth_scale = now.depth_scale(), out.before_depth_scale = previous.depth_scale();
  const glm::dvec4 window = previous.window();
  out.window[0] = window.x, out.window[1] = window.w;
  out.window[2] = window.y - window.x, out.window[3] = window.z - window.w;
  out.size[0] = previous.size().width, out.size[1] = previous.size().height;
  out.offset_px[0] = previous.offset_px().x, out.offset_px[1] = previous.offset_px().y;
  out.no_motion_px = no_motion_px;
  out.moved = now == previous ? 0 : 1;
  out.before_orthographic = previous.projection() == Projection::kOrthographic ? 1 : 0;
  return out;
}

} // namespace packtrace
