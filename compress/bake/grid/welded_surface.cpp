#include "compress/bake/grid/welded_surface.h"

#include <functional>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include "compress/bake/grid/collapsed_triangles.h"
#include "pbrt_import/base/weld_table.h"

namespace packtrace {
namespace {

constexpr uint32_t kUnset = ~0u;
constexpr size_t kGrain = 4096; // fixed, so that sums are grouped equally for any thread count

class SurfaceWelder {
public:
  SurfaceWelder(const Scene& scene, const GeometryPlan& plan, std::span<const LatticePart> parts)
      : plan_(plan), source_(scene, plan), parts_(parts), table_(count(parts, &LatticePart::points)) {
    out_.corners.reserve(count(parts, &LatticePart::triangles));
    const size_t points = count(parts, &LatticePart::points);
    out_.positions.reserve(points), out_.merged.reserve(points), out_.sources.reserve(points);
  }

  WeldedSurface run() {
    for (size_t part = 0; part < parts_.size(); ++part) weld_part(part);
    out_.collapsed = plan_.deforms ? find_repeated() : find_collapsed(out_.positions, out_.corners);
    out_.left.resize(parts_.size());
    for (size_t part = 0, first = 0; part < parts_.size(); first += parts_[part++].triangles.size()) {
      add_areas(part, first);
      for (size_t i = first; i < first + parts_[part].triangles.size(); ++i) out_.left[part] += out_.collapsed[i] == 0;
      out_.collapsed_count += parts_[part].triangles.size() - out_.left[part];
    }
    if (out_.collapsed_count > 0) drop_positions();
    if (!plan_.deforms) out_.sources = {};
    return std::move(out_);
  }

private:
  template <typename Member>
  static size_t count(std::span<const LatticePart> parts, Member member) {
    size_t total = 0;
    for (const LatticePart& part : parts) total += (part.*member).size();
    return total;
  }

  void weld_part(size_t part) {
    std::vector<uint32_t> number_of(parts_[part].points.size(), kUnset);
    for (const Triangle& t : parts_[part].triangles) {
      Triangle corners{};
      for (int i = 0; i < 3; ++i) {
        const std::vector<uint32_t>* const paths = plan_.parts[part].same_path;
        const uint32_t vertex = paths != nullptr ? (*paths)[t[i]] : t[i];
        uint32_t& number = number_of[vertex];
        if (number == kUnset) number = weld(parts_[part].points[vertex], {static_cast<uint32_t>(part), vertex});
        corners[i] = number;
      }
      out_.corners.push_back(corners);
    }
  }

  uint32_t weld(const LatticePoint& p, SourceVertex vertex) {
    if (plan_.deforms) return add(p, vertex);
    const uint64_t hash =
        mix_words(static_cast<uint64_t>(p[0]), static_cast<uint64_t>(p[1]), static_cast<uint64_t>(p[2]));
    const auto next = static_cast<uint32_t>(out_.positions.size());
    const uint32_t number = table_.find_or_add(hash, next, [&](uint32_t other) { return out_.positions[other] == p; });
    if (number == next) {
      add(p, vertex);
    } else if (out_.merged[number] == 0) {
      const SourceVertex& first = out_.sources[number];
      out_.merged[number] = !source_.same(first.part, first.vertex, vertex.part, vertex.vertex);
    }
    return number;
  }

  uint32_t add(const LatticePoint& p, SourceVertex vertex) {
    out_.positions.push_back(p), out_.merged.push_back(0), out_.sources.push_back(vertex);
    return static_cast<uint32_t>(out_.positions.size() - 1);
  }

  /// Per triangle: whether two corners are the same position.
  std::vector<uint8_t> find_repeated() const {
    std::vector<uint8_t> repeated;
    for (const Triangle& t : out_.corners) repeated.push_back(t.x == t.y || t.y == t.z || t.z == t.x ? 1 : 0);
    return repeated;
  }

  void add_areas(size_t part, size_t first) {
    using Areas = std::pair<double, double>; // areas of all triangles and of the removed ones
    const std::vector<Triangle>& triangles = parts_[part].triangles;
    const Areas areas = tbb::parallel_deterministic_reduce(
        tbb::blocked_range<size_t>(0, triangles.size(), kGrain), Areas{},
        [&](const tbb::blocked_range<size_t>& range, Areas sum) {
          for (size_t i = range.begin(); i < range.end(); ++i) {
            const Triangle& t = triangles[i];
            const DVec3 a = source_(part, t.x);
            const double area = 0.5 * glm::length(glm::cross(source_(part, t.y) - a, source_(part, t.z) - a));
            sum.first += area;
            if (out_.collapsed[first + i] != 0) sum.second += area;
          }
          return sum;
        },
        [](const Areas& a, const Areas& b) { return Areas{a.first + b.first, a.second + b.second}; });
    out_.source_area += areas.first, out_.collapsed_area += areas.second;
  }

  /// Renumbers positions, without those that only removed triangles use.
  void drop_positions() {
    std::vector<uint32_t> number_of(out_.positions.size(), kUnset);
    std::vector<LatticePoint> positions;
    std::vector<uint8_t> merged;
    std::vector<SourceVertex> sources;
    for (size_t i = 0; i < out_.corners.size(); ++i)
      for (int k = 0; k < 3 && out_.collapsed[i] == 0; ++k) {
        uint32_t& corner = out_.corners[i][k];
        uint32_t& number = number_of[corner];
        if (number == kUnset) {
          number = static_cast<uint32_t>(positions.size());
          positions.push_back(out_.positions[corner]), merged.push_back(out_.merged[corner]);
          sources.push_back(out_.sources[corner]);
        }
        corner = number;
      }
    out_.positions = std::move(positions), out_.merged = std::move(merged);
    out_.sources = std::move(sources);
  }

  const GeometryPlan& plan_;
  const SourcePoints source_;
  const std::span<const LatticePart> parts_;
  WeldTable table_;
  WeldedSurface out_;
};

} // namespace

WeldedSurface weld_surface(const Scene& scene, const GeometryPlan& plan, std::span<const LatticePart> parts) {
  return SurfaceWelder(scene, plan, parts).run();
}

} // namespace packtrace
