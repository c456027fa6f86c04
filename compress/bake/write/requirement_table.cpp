#include "compress/bake/write/requirement_table.h"

namespace packtrace {
namespace {

struct Use {
  uint64_t triangles = 0, source_bytes = 0;
};

/// Uses in one geometry, by stream and reason.
using Uses = std::array<std::array<Use, baked::kReasonCount>, baked::kStreamCount>;

Uses uses_of(const Scene& scene, const GeometryPlan& plan, const GeometryNeeds& needs, const QuantizeStats& stats) {
  Uses uses{};
  const auto add = [&](baked::Stream stream, baked::Reason reason, uint64_t triangles, uint64_t bytes) {
    uses[stream][reason].triangles += triangles;
    uses[stream][reason].source_bytes += bytes;
  };
  for (size_t i = 0; i < plan.parts.size(); ++i) {
    const Mesh& mesh = scene.meshes[plan.parts[i].mesh];
    const PartNeeds& part = needs.parts[i];
    add(baked::kNormals, part.normals, stats.left[i], mesh.normals.size() * sizeof(Vec3));
    add(baked::kUvs, part.uvs, stats.left[i], mesh.uvs.size() * sizeof(Vec2));
    add(baked::kTangents, part.tangents, stats.left[i], 0);
  }
  Use& smooth = uses[baked::kNormals][baked::kForShading];
  const Use inferred{stats.flat_triangles, stats.inferred_normals * sizeof(Vec3)};
  smooth.triangles -= inferred.triangles, smooth.source_bytes -= inferred.source_bytes;
  uses[baked::kNormals][baked::kInferred] = inferred;
  return uses;
}

} // namespace

uint32_t RequirementTable::add(const Scene& scene, const GeometryPlan& plan, const GeometryNeeds& needs,
                               const QuantizeStats& stats, const ClusterView::StreamBits& bits) {
  const Uses uses = uses_of(scene, plan, needs, stats);
  const std::array<uint64_t, baked::kStreamCount> stored = {bits.normals, bits.uvs, 0};
  uint32_t mask = 0;
  for (uint32_t stream = 0; stream < baked::kStreamCount; ++stream) {
    baked::RequirementRecord* last = nullptr;
    for (uint32_t reason = 0; reason < baked::kReasonCount; ++reason) {
      const Use& use = uses[stream][reason];
      if (use.triangles == 0) continue;
      last = &rows_[stream][reason];
      ++last->geometries;
      last->triangles += use.triangles;
      last->source_bytes += use.source_bytes;
      mask |= baked::requirement_bit(stream, reason);
    }
    if (last != nullptr) last->stored_bits += stored[stream];
  }
  return mask;
}

std::vector<baked::RequirementRecord> RequirementTable::rows() const {
  std::vector<baked::RequirementRecord> rows;
  for (uint32_t stream = 0; stream < baked::kStreamCount; ++stream)
    for (uint32_t reason = 0; reason < baked::kReasonCount; ++reason) {
      baked::RequirementRecord row = rows_[stream][reason];
      row.stream = stream, row.reason = reason;
      if (row.geometries > 0) rows.push_back(row);
    }
  return rows;
}

} // namespace packtrace
