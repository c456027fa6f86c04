#include "compress/bake/lod/lod_encoder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "compress/bake/lod/level_normals.h"

namespace packtrace {
namespace {

// More than the rounding errors of a few operations in double; for nested spheres, also more than those in float.
constexpr double kDoubleRoundings = 1.0 + 0x1p-48;
constexpr double kFloatRoundings = 1.0 + 1e-6;

/// The smallest float that is not less than `value`.
float round_up(double value) {
  if (value > static_cast<double>(std::numeric_limits<float>::max())) return std::numeric_limits<float>::infinity();
  const auto nearest = static_cast<float>(value);
  return static_cast<double>(nearest) < value ? std::nextafter(nearest, std::numeric_limits<float>::infinity())
                                              : nearest;
}

/// Maximum distance of a decoded point from its lattice point, in object units: 0 if all coordinates are exact floats.
double decoding_error(const std::vector<LatticePoint>& positions, const PositionGrid& grid) {
  constexpr double kHalfFloatUlp = 0x1p-24, kSmallestFloatHalf = 0x1p-150;
  int64_t largest = 0;
  for (const LatticePoint& p : positions)
    for (const int64_t coordinate : p) largest = std::max(largest, std::abs(coordinate));
  if (largest <= (int64_t{1} << 24) / grid.mantissa && grid.exponent >= -149) return 0.0;
  const double per_axis = static_cast<double>(largest) * grid.step() * kHalfFloatUlp * kDoubleRoundings;
  return std::sqrt(3.0) * (per_axis + kSmallestFloatHalf) * kDoubleRoundings;
}

/// Computes the errors and spheres of groups in object units.
class GroupEncoder {
public:
  GroupEncoder(const QuantizedGeometry& geometry, const ClusterLod& lod)
      : g_(geometry), lod_(lod), step_(geometry.grid.step()), decoding_error_(decoding_error(lod.positions, g_.grid)) {}

  /// Appends the records level by level. Returns false if a value exceeds the range of float.
  bool run(std::vector<baked::LodGroupRecord>& out) {
    std::vector<std::vector<uint32_t>> members(lod_.groups.size());
    for (uint32_t i = 0; i < lod_.clusters.size(); ++i) members[lod_.clusters[i].group].push_back(i);
    for (size_t i = 0; i < lod_.groups.size(); ++i) {
      out.push_back(encode(lod_.groups[i], members[i], out));
      const baked::LodGroupRecord& record = out.back();
      bool finite = std::isfinite(record.radius) && std::isinf(record.error) == lod_.groups[i].terminal;
      for (const float c : record.center) finite &= std::isfinite(c);
      if (!finite) return false;
    }
    return true;
  }

private:
  baked::LodGroupRecord encode(const LodGroup& group, const std::vector<uint32_t>& members,
                               const std::vector<baked::LodGroupRecord>& done) const {
    baked::LodGroupRecord record{};
    record.level = group.level;
    // The error is between two decoded surfaces, and decoding moves both.
    record.error = round_up((group.error * step_ + 2.0 * decoding_error_) * kDoubleRoundings);
    double off = decoding_error_; // of the centre, from rounding it
    for (size_t axis = 0; axis < 3; ++axis) {
      const double center =
          (static_cast<double>(g_.origin[axis]) + group.sphere.center[static_cast<int>(axis)]) * step_;
      record.center[axis] = static_cast<float>(center);
      off += std::abs(static_cast<double>(record.center[axis]) - center);
    }
    record.radius = round_up((group.sphere.radius * step_ + off) * kFloatRoundings);
    for (const uint32_t number : members) {
      const LodCluster& cluster = lod_.clusters[number];
      // Decoded points may lie slightly outside.
      record.radius = std::max(record.radius, round_up((reach(cluster, record) + decoding_error_) * kFloatRoundings));
      if (cluster.generating_group == kNoGroup) continue;
      const baked::LodGroupRecord& inner = done[cluster.generating_group];
      const double outermost = distance(record, point(inner)) + static_cast<double>(inner.radius);
      record.radius = std::max(record.radius, round_up(outermost * kFloatRoundings));
      record.error = std::max(record.error, inner.error);
    }
    return record;
  }

  static DVec3 point(const baked::LodGroupRecord& g) { return DVec3(g.center[0], g.center[1], g.center[2]); }
  static double distance(const baked::LodGroupRecord& from, DVec3 to) { return glm::length(point(from) - to); }

  /// Maximum distance of the cluster's points from a group's centre.
  double reach(const LodCluster& cluster, const baked::LodGroupRecord& from) const {
    double furthest = 0.0;
    for (const Triangle& t :
         std::span(lod_.triangles).subspan(cluster.range.first_triangle, cluster.range.triangle_count))
      for (int corner = 0; corner < 3; ++corner) {
        const LatticePoint& p = lod_.positions[lod_.vertices[t[corner]].position];
        const DVec3 lattice(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
        furthest = std::max(furthest, distance(from, lattice * step_));
      }
    return furthest;
  }

  const QuantizedGeometry& g_;
  const ClusterLod& lod_;
  double step_, decoding_error_;
};

/// The clusters of a level, stably sorted by material slot, so that material classes are contiguous.
std::vector<uint32_t> order_clusters(const QuantizedGeometry& geometry, const ClusterLod& lod, uint32_t begin,
                                     uint32_t end) {
  std::vector<uint32_t> order(end - begin);
  std::iota(order.begin(), order.end(), begin);
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return geometry.kinds[lod.clusters[a].range.kind].slot < geometry.kinds[lod.clusters[b].range.kind].slot;
  });
  return order;
}

/// Encodes the clusters of a level above 0, with coarser normals if its errors allow them.
/// @param errors per cluster, in lattice steps
void encode_level(QuantizedGeometry& geometry, GeometryClusters& clusters, std::span<const double> errors,
                  bool coarser_normals, EncodedLod::Level& to) {
  CoarseNormals normals{geometry.normal_encoding, {}, 0.0, 0.0};
  if (coarser_normals) normals = coarsen_normals(level_normal_limit(geometry, clusters, errors), geometry, clusters);
  to.normal_encoding = normals.encoding;
  to.max_normal_error = static_cast<float>(normals.max_error_degrees);
  to.mean_normal_error = static_cast<float>(normals.mean_error_degrees);
  const bool coarser = !normals.vertices.empty();
  if (coarser) std::swap(geometry.vertices, normals.vertices);
  std::swap(geometry.normal_encoding, normals.encoding);
  to.encoded = encode_geometry(geometry, clusters);
  std::swap(geometry.normal_encoding, normals.encoding);
  if (coarser) std::swap(geometry.vertices, normals.vertices);
}

} // namespace

EncodedLod encode_lod(QuantizedGeometry& geometry, ClusterLod& lod, bool coarser_normals) {
  EncodedLod out;
  if (lod.level_count < 2 || !GroupEncoder(geometry, lod).run(out.groups)) return {};
  out.levels.resize(lod.level_count);
  for (const baked::LodGroupRecord& group : out.groups)
    if (++out.levels[group.level].group_count > baked::kMaxLodGroups) return {};
  geometry.positions = std::move(lod.positions);
  geometry.vertices = std::move(lod.vertices);
  GeometryClusters level_clusters;
  level_clusters.triangles = std::move(lod.triangles);
  std::vector<double> errors; // of the level's clusters
  uint64_t terminal = 0;
  float error = 0.0f;
  uint32_t own = 0, below = 0; // first group of the level, and of the one below
  for (uint32_t level = 0, begin = 0, end = 0; level < lod.level_count; ++level, begin = end) {
    while (end < lod.clusters.size() && lod.clusters[end].level == level) ++end;
    const std::vector<uint32_t> order =
        level == 0 ? std::vector<uint32_t>{} : order_clusters(geometry, lod, begin, end);
    level_clusters.clusters.clear(), errors.clear();
    EncodedLod::Level& to = out.levels[level];
    to.triangles = terminal;
    to.error = error;
    for (uint32_t i = begin; i < end; ++i) {
      const LodCluster& c = lod.clusters[level == 0 ? i : order[i - begin]]; // level 0 keeps its stored order
      out.links.push_back({static_cast<uint16_t>(c.group - own),
                           level == 0 ? uint16_t{0} : static_cast<uint16_t>(c.generating_group - below)});
      if (level > 0) level_clusters.clusters.push_back(c.range), errors.push_back(lod.groups[c.generating_group].error);
      to.triangles += c.range.triangle_count;
      if (lod.groups[c.group].terminal)
        terminal += c.range.triangle_count;
      else
        error = std::max(error, out.groups[c.group].error);
    }
    if (level > 0) encode_level(geometry, level_clusters, errors, coarser_normals, to);
    below = own, own += to.group_count;
  }
  return out;
}

} // namespace packtrace
