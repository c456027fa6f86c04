#include "compress/bake/grid/geometry_measure.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "pbrt_import/base/error.h"

namespace packtrace {

void LengthHistogram::add_squared(double squared_length) {
  if (!(squared_length > 0.0)) return;
  const auto bin = static_cast<size_t>(std::bit_cast<uint64_t>(squared_length) >> (52 - kMantissaBits));
  ++counts_[bin];
  ++total_;
  first_ = std::min(first_, bin);
  end_ = std::max(end_, bin + 1);
}

void LengthHistogram::add(const LengthHistogram& other) {
  for (size_t i = other.first_; i < other.end_; ++i) counts_[i] += other.counts_[i];
  total_ += other.total_;
  first_ = std::min(first_, other.first_);
  end_ = std::max(end_, other.end_);
}

void LengthHistogram::add_scaled(const LengthHistogram& other, double factor) {
  for (size_t i = other.first_; i < other.end_; ++i) {
    if (other.counts_[i] == 0) continue;
    const uint64_t middle = (uint64_t{i} << (52 - kMantissaBits)) | (uint64_t{1} << (51 - kMantissaBits));
    const double squared = std::bit_cast<double>(middle) * factor * factor;
    if (!(squared > 0.0) || !std::isfinite(squared)) continue;
    const auto bin = static_cast<size_t>(std::bit_cast<uint64_t>(squared) >> (52 - kMantissaBits));
    counts_[bin] += other.counts_[i];
    total_ += other.counts_[i];
    first_ = std::min(first_, bin);
    end_ = std::max(end_, bin + 1);
  }
}

void LengthHistogram::clear() {
  for (size_t i = first_; i < end_; ++i) counts_[i] = 0;
  first_ = kBins, end_ = 0, total_ = 0;
}

double LengthHistogram::median() const {
  uint64_t before = 0;
  for (size_t i = first_; i < end_; ++i) {
    before += counts_[i];
    if (before * 2 > total_) return std::sqrt(std::bit_cast<double>(uint64_t{i} << (52 - kMantissaBits)));
  }
  return 0.0;
}

double GeometryMeasure::max_abs() const {
  if (bounds.empty()) return 0.0;
  const DVec3 m = glm::max(glm::abs(bounds.lo), glm::abs(bounds.hi));
  return std::max({m.x, m.y, m.z});
}

double GeometryMeasure::float_step() const {
  if (bounds.empty()) return 0.0;
  const DVec3 largest = glm::max(glm::abs(bounds.lo), glm::abs(bounds.hi));
  double least = 0.0;
  for (int axis = 0; axis < 3; ++axis)
    if (largest[axis] > 0.0 && (least == 0.0 || largest[axis] < least)) least = largest[axis];
  return least * 0x1p-24;
}

Bounds measure_geometry(const Scene& scene, const GeometryPlan& plan, LengthHistogram& edges) {
  Bounds bounds;
  std::vector<DVec3> points;
  for (const GeometryPart& part : plan.parts) {
    const Mesh& mesh = scene.meshes[part.mesh];
    points.resize(mesh.positions.size());
    const PartMap place(part);
    for (size_t i = 0; i < points.size(); ++i) {
      points[i] = place(mesh.positions[i]);
      constexpr double kMax = std::numeric_limits<float>::max();
      const DVec3 p = glm::abs(points[i]);
      if (!(p.x <= kMax && p.y <= kMax && p.z <= kMax)) // also rejects NaN
        throw Error(ErrorKind::kInput, "vertex " + std::to_string(i) + " of " + mesh.name +
                                           " is not finite, or leaves the float range when transformed");
      bounds.extend(points[i]);
    }
    for (const Triangle& t : mesh.triangles) {
      const size_t limit = points.size();
      if (t.x >= limit || t.y >= limit || t.z >= limit)
        throw Error(ErrorKind::kInput, "a triangle of " + mesh.name + " names a vertex that does not exist");
      for (const DVec3 edge : {points[t.y] - points[t.x], points[t.z] - points[t.y], points[t.x] - points[t.z]})
        edges.add_squared(glm::dot(edge, edge));
    }
  }
  return bounds;
}

PositionGrid choose_grid(const BakeConfig& config, const GeometryMeasure& measure, double max_stretch) {
  const DVec3 extent = measure.bounds.extent();
  double step = 0.0;
  switch (config.precision_kind) {
  case PrecisionKind::kEdgeFraction:
  case PrecisionKind::kPicture:
    step = measure.median_edge * config.precision;
    break;
  case PrecisionKind::kDiagonalFraction:
    step = measure.bounds.diagonal() * config.precision;
    break;
  case PrecisionKind::kAbsolute:
    step = max_stretch > 0.0 ? config.precision / max_stretch : config.precision;
    break;
  case PrecisionKind::kPositionBits:
    step = std::max({extent.x, extent.y, extent.z}) / (std::exp2(config.precision) - 1.0);
    break;
  }
  if (step == 0.0) step = std::max(measure.max_abs() * 0x1p-24, double{std::numeric_limits<float>::denorm_min()});
  return choose_position_grid(step);
}

} // namespace packtrace
