#include "compress/bake/lod/level_normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "compress/bake/clusters/renumbering.h"
#include "pbrt_import/base/weighted_quantile.h"
#include "pbrt_import/base/weld_table.h"
#include "pbrt_import/scene/angle.h"

namespace packtrace {
namespace {

/// Encodings to choose from, with ascending numbers of bits.
constexpr std::array<NormalEncoding, 3> kCoarser{NormalEncoding::kAxis12, NormalEncoding::kAxis16,
                                                 NormalEncoding::kOct20};
constexpr double kShareOfTurn = 0.25;
constexpr double kLooserShare = 0.25; // share of the surface that may turn by less

/// Returns a triangle's error over its longest edge, and twice its area; nothing for triangles without area.
std::optional<std::pair<double, double>> turn_of(const QuantizedGeometry& geometry, const Triangle& t, double error) {
  std::array<DVec3, 3> sides{};
  double longest2 = 0.0;
  for (int i = 0; i < 3; ++i) {
    const LatticePoint &a = geometry.positions[geometry.vertices[t[i]].position],
                       &b = geometry.positions[geometry.vertices[t[(i + 1) % 3]].position];
    DVec3& side = sides[static_cast<size_t>(i)];
    for (size_t axis = 0; axis < 3; ++axis) side[static_cast<int>(axis)] = static_cast<double>(b[axis] - a[axis]);
    longest2 = std::max(longest2, glm::dot(side, side));
  }
  const double area = glm::length(glm::cross(sides[0], sides[1]));
  if (!(area > 0.0)) return std::nullopt;
  return std::pair(error / std::sqrt(longest2), area);
}

/// Encodes the normals of a level's vertices again.
class Recoder {
public:
  /// @param corners number of corners of the level
  Recoder(const QuantizedGeometry& geometry, NormalEncoding to, size_t corners)
      : g_(geometry), to_(to), sources_(corners / 4), table_(corners) {}

  /// Returns a vertex' new number. Vertices that become equal get one number.
  uint32_t operator()(uint32_t vertex, bool flat) {
    const uint32_t source = sources_(2 * vertex + static_cast<uint32_t>(flat));
    if (source == numbers_.size()) numbers_.push_back(add(vertex, flat));
    return numbers_[source];
  }

  CoarseNormals result() && {
    return {to_, std::move(vertices_), max_, count_ > 0 ? sum_ / static_cast<double>(count_) : 0.0};
  }

private:
  uint32_t add(uint32_t vertex, bool flat) {
    QuantizedVertex v = g_.vertices[vertex];
    if (!flat) v.normal_code = recode(v.normal_code);
    const auto next = static_cast<uint32_t>(vertices_.size());
    const uint64_t uv = static_cast<uint32_t>(v.uv[0]) | (uint64_t{static_cast<uint32_t>(v.uv[1])} << 32);
    const uint32_t number = table_.find_or_add(mix_words(v.position, v.normal_code, uv), next,
                                               [&](uint32_t other) { return vertices_[other] == v; });
    if (number == next) vertices_.push_back(v);
    return number;
  }

  uint32_t recode(uint32_t code) {
    const DVec3 normal = glm::normalize(DVec3(decode_normal(g_.normal_encoding, code)));
    const NearestNormal near = find_nearest_normal(to_, normal);
    const double error = angle_degrees(normal, glm::normalize(DVec3(near.decoded)));
    max_ = std::max(max_, error), sum_ += error, ++count_;
    return near.code;
  }

  const QuantizedGeometry& g_;
  NormalEncoding to_;
  Renumbering sources_;           ///< of 2 vertex + (1 if flat)
  std::vector<uint32_t> numbers_; ///< per source
  WeldTable table_;
  std::vector<QuantizedVertex> vertices_;
  double max_ = 0.0, sum_ = 0.0;
  uint64_t count_ = 0;
};

} // namespace

double level_normal_limit(const QuantizedGeometry& geometry, const GeometryClusters& level,
                          std::span<const double> errors) {
  std::vector<std::pair<double, double>> turns;
  double all = 0.0;
  for (size_t i = 0; i < level.clusters.size(); ++i) {
    const ClusterRange& c = level.clusters[i];
    if (geometry.kinds[c.kind].flat) continue;
    for (const Triangle& t : std::span(level.triangles).subspan(c.first_triangle, c.triangle_count))
      if (const auto turn = turn_of(geometry, t, errors[i])) turns.push_back(*turn), all += turn->second;
  }
  return kShareOfTurn * std::atan(4.0 * weighted_quantile(turns, kLooserShare * all)) * kDegreesPerRadian;
}

CoarseNormals coarsen_normals(double limit_degrees, const QuantizedGeometry& geometry, GeometryClusters& level) {
  const uint32_t bits = format_of(geometry.normal_encoding).bits;
  const auto found = std::find_if(kCoarser.begin(), kCoarser.end(), [&](NormalEncoding encoding) {
    return format_of(encoding).bits < bits && format_of(encoding).max_error_degrees <= limit_degrees;
  });
  if (found == kCoarser.end()) return {geometry.normal_encoding, {}, 0.0, 0.0};
  size_t corners = 0;
  for (const ClusterRange& c : level.clusters) corners += size_t{3} * c.triangle_count;
  Recoder recode(geometry, *found, corners);
  for (const ClusterRange& c : level.clusters)
    for (Triangle& t : std::span(level.triangles).subspan(c.first_triangle, c.triangle_count))
      for (int corner = 0; corner < 3; ++corner) t[corner] = recode(t[corner], geometry.kinds[c.kind].flat);
  return std::move(recode).result();
}

} // namespace packtrace
