#include "compress/bake/sequence/sequence_baker.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "compress/bake/clusters/error_stats.h"
#include "compress/format/layout/bit_fields.h"
#include "pbrt_import/base/brief.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

/// The lattice points of the vertices of a geometry in one frame.
class FramePlacer {
public:
  FramePlacer(const Scene& scene, const GeometryPlan& plan, const GeometryGrid& grid,
              std::span<const MeshSequence* const> sequences, const baked::DeformationRecord& record)
      : scene_(scene), plan_(plan), grid_(grid), sequences_(sequences), record_(record) {}

  /// Reads a frame of all parts.
  void read(uint32_t frame) {
    points_.assign(plan_.parts.size(), {});
    for (size_t part = 0; part < plan_.parts.size(); ++part) {
      const bool moves = sequences_[part] != nullptr;
      const std::vector<Vec3> read = moves ? sequences_[part]->frames->positions(frame) : std::vector<Vec3>();
      const std::vector<Vec3>& positions = moves ? read : scene_.meshes[plan_.parts[part].mesh].positions;
      if (moves) check_paths(part, read, frame);
      place(part, positions);
    }
  }

  double max_error() const { return max_error_; }

  FrameVertex operator()(const SourceVertex& source) const { return points_[source.part][source.vertex]; }

private:
  void check_paths(size_t part, std::span<const Vec3> positions, uint32_t frame) const {
    const std::vector<uint32_t>& same_path = *plan_.parts[part].same_path;
    bool same = positions.size() == same_path.size();
    for (size_t v = 0; same && v < positions.size(); ++v) same = positions[v] == positions[same_path[v]];
    if (!same)
      throw Error(ErrorKind::kInput, sequences_[part]->frames->name(frame) + ": it changed while it was being baked");
  }

  void place(size_t part, std::span<const Vec3> positions) {
    const double step = grid_.grid.step();
    std::vector<FrameVertex>& out = points_[part];
    out.resize(positions.size());
    const ErrorStats errors = accumulate_errors(positions.size(), [&](size_t i, ErrorStats& stats) {
      const DVec3 p = transform_point(plan_.parts[part].geometry_from_mesh, DVec3(positions[i]));
      const LatticePoint q = grid_.round(p);
      for (size_t axis = 0; axis < 3; ++axis) {
        out[i][axis] = static_cast<uint32_t>(q[axis] - record_.lo[axis]);
        stats.add(std::abs(static_cast<double>(from_lattice(q[axis], step)) - p[static_cast<int>(axis)]));
      }
    });
    max_error_ = std::max(max_error_, errors.max);
  }

  const Scene& scene_;
  const GeometryPlan& plan_;
  const GeometryGrid& grid_;
  const std::span<const MeshSequence* const> sequences_; ///< by part; null for parts that do not move
  const baked::DeformationRecord& record_;
  std::vector<std::vector<FrameVertex>> points_; ///< by part and vertex of its mesh
  double max_error_ = 0.0;
};

/// Returns a cluster whose position fields would take more than kMaxFieldBits, or the number of clusters.
uint32_t find_wide_cluster(std::span<const FrameVertex> vertices, std::span<const baked::ClusterRecord> clusters) {
  std::atomic<uint32_t> found{static_cast<uint32_t>(clusters.size())};
  tbb::parallel_for(uint32_t{0}, static_cast<uint32_t>(clusters.size()), [&](uint32_t c) {
    uint32_t bits = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      uint32_t lo = ~0u, hi = 0;
      for (const FrameVertex& v : vertices.subspan(clusters[c].first_vertex, clusters[c].vertex_count))
        lo = std::min(lo, v[axis]), hi = std::max(hi, v[axis]);
      bits += static_cast<uint32_t>(std::bit_width(hi - lo));
    }
    if (bits <= kMaxFieldBits) return;
    for (uint32_t seen = found; c < seen && !found.compare_exchange_weak(seen, c);) {
    }
  });
  return found;
}

} // namespace

SequenceBaker::SequenceBaker(const Scene& scene, const BakeConfig& config) : scene_(scene), config_(config) {
  for (const MeshSequence& sequence : config.sequences) {
    if (sequence.mesh >= scene.meshes.size() || sequence.frames == nullptr)
      throw Error(ErrorKind::kUsage, "a sequence has no mesh in the scene, or no frames");
    if (std::ranges::find(meshes_, sequence.mesh) != meshes_.end())
      throw Error(ErrorKind::kUsage, "two sequences move " + scene.meshes[sequence.mesh].name);
    meshes_.push_back(sequence.mesh);
  }
}

void SequenceBaker::measure(ScenePlan& plan, SceneMeasure& measure, Progress& progress) {
  if (config_.sequences.empty()) return;
  uint64_t frames = 0;
  for (const MeshSequence& sequence : config_.sequences) frames += sequence.frames->count();
  progress.begin("measuring frames", frames);
  for (const MeshSequence& sequence : config_.sequences)
    measures_.push_back(measure_sequence(scene_, sequence, progress));
  for (size_t g = 0; g < plan.geometries.size(); ++g)
    for (GeometryPart& part : plan.geometries[g].parts)
      for (size_t i = 0; i < meshes_.size(); ++i)
        if (part.mesh == meshes_[i]) {
          part.same_path = &measures_[i].same_path;
          measure.geometries[g].bounds.extend(transform_bounds(part.geometry_from_mesh, measures_[i].bounds));
        }
  for (size_t i = 0; i < scene_.shapes.size(); ++i) { // as measure_scene() does for the positions of frame 0
    const baked::InstanceRecord& instance = plan.instances[i];
    if (instance.geometry != baked::kNone && plan.geometries[instance.geometry].deforms)
      measure.world.bounds.extend(placed_box(instance, measure.geometries[instance.geometry].bounds));
  }
}

const MeshSequence* SequenceBaker::sequence_of(const GeometryPart& part) const {
  const auto found = std::ranges::find(meshes_, part.mesh);
  return found == meshes_.end() ? nullptr : &config_.sequences[static_cast<size_t>(found - meshes_.begin())];
}

std::vector<EncodedDeformation> SequenceBaker::pack(const ScenePlan& plan, std::span<const GeometryGrid> grids,
                                                    std::span<const PackedGeometry> packed, Progress& progress) const {
  std::vector<EncodedDeformation> out;
  for (uint32_t g = 0; g < plan.geometries.size(); ++g)
    if (plan.geometries[g].deforms && !packed[g].encoded.clusters.empty())
      out.push_back(pack_geometry(plan.geometries[g], g, grids[g], packed[g], progress));
  return out;
}

EncodedDeformation SequenceBaker::pack_geometry(const GeometryPlan& plan, uint32_t geometry, const GeometryGrid& grid,
                                                const PackedGeometry& packed, Progress& progress) const {
  std::vector<const MeshSequence*> sequences;
  const MeshSequence* first = nullptr;
  uint64_t source_vertices = 0;
  for (const GeometryPart& part : plan.parts) {
    source_vertices += scene_.meshes[part.mesh].positions.size();
    const MeshSequence* sequence = sequence_of(part);
    sequences.push_back(sequence);
    if (sequence == nullptr) continue;
    if (first == nullptr) first = sequence;
    if (sequence->frames->count() != first->frames->count() || sequence->frames_per_second != first->frames_per_second)
      throw Error(ErrorKind::kInput,
                  plan.name + ": its sequences differ in their number of frames or frames per second");
  }
  baked::DeformationRecord record{};
  record.geometry = geometry;
  record.group_frames = config_.sequence_group;
  record.frames_per_second = first->frames_per_second;
  record.first_number = first->first_number;
  record.source_vertices = source_vertices;
  const Bounds& bounds = packed.frames;
  for (size_t axis = 0; axis < 3; ++axis) {
    record.lo[axis] = grid.lowest(bounds.lo[static_cast<int>(axis)]);
    const auto extent = static_cast<uint64_t>(grid.highest(bounds.hi[static_cast<int>(axis)]) - record.lo[axis]);
    if (!tree_origin_of_frames(record.lo[axis], extent))
      throw Error(ErrorKind::kLimitExceeded, plan.name + ": its frames span more steps of its grid, " +
                                                 brief(grid.grid.step()) +
                                                 ", than a tree holds (2^30); choose a coarser precision");
    record.extent[axis] = static_cast<uint32_t>(extent);
  }
  const std::vector<baked::ClusterRecord>& clusters = packed.encoded.clusters;
  std::vector<uint32_t> counts;
  for (const baked::ClusterRecord& cluster : clusters) counts.push_back(cluster.vertex_count);

  FramePlacer placer(scene_, plan, grid, sequences, record);
  std::optional<DeformationEncoder> encoder;
  std::vector<FrameVertex> vertices(packed.encoded.sources.size());
  progress.begin("encoding frames", first->frames->count());
  for (uint32_t frame = 0; frame < first->frames->count(); ++frame) {
    progress.check_cancelled();
    placer.read(frame);
    tbb::parallel_for(size_t{0}, vertices.size(), [&](size_t v) { vertices[v] = placer(packed.encoded.sources[v]); });
    if (const uint32_t wide = find_wide_cluster(vertices, clusters); wide < clusters.size())
      throw Error(ErrorKind::kLimitExceeded, first->frames->name(frame) + ": cluster " + std::to_string(wide) +
                                                 " spans so many steps of the grid that a position takes more than " +
                                                 std::to_string(kMaxFieldBits) + " bits; choose a coarser precision");
    if (!encoder) encoder.emplace(record, counts, vertices); // frame 0 is what the file's clusters hold
    encoder->add(vertices);
    progress.advance();
  }
  if (placer.max_error() > packed.record.position_error_bound)
    throw Error(ErrorKind::kLimitExceeded, plan.name + ": measured position error " + brief(placer.max_error()) +
                                               " of its frames exceeds its bound " +
                                               brief(packed.record.position_error_bound));
  EncodedDeformation encoded = encoder->finish();
  encoded.record.max_position_error = placer.max_error();
  return encoded;
}

} // namespace packtrace
