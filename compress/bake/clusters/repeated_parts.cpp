#include "compress/bake/clusters/repeated_parts.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>

#include <tbb/parallel_for.h>

#include "compress/bake/clusters/renumbering.h"
#include "compress/bake/clusters/triangle_cutter.h"
#include "compress/format/cluster/index_codec.h"
#include "compress/format/trees/node_groups.h"
#include "pbrt_import/base/disjoint_sets.h"

namespace packtrace {
namespace {

constexpr uint32_t kMinTriangles = 32;       // clusters of smaller parts would take more than their topology saves
constexpr uint32_t kMaxTriangles = 1u << 14; // no page holds two larger parts
// Limit of the area of a part's clusters, relative to its box, over that of the first part.
constexpr double kMaxAreaRatio = 1.25;
constexpr uint32_t kNoPart = ~0u;

/// A connected component: triangles of one kind that share positions.
struct Component {
  uint32_t begin = 0, end = 0; ///< range of Components::triangles
  uint32_t free = 0;           ///< number of triangles that are not taken
};

struct Components {
  std::vector<uint32_t> triangles; ///< component by component, in file order
  std::vector<Component> list;

  std::span<const uint32_t> of(const Component& component) const {
    return std::span(triangles).subspan(component.begin, component.end - component.begin);
  }
};

class ComponentFinder {
public:
  ComponentFinder(const QuantizedGeometry& geometry, std::span<const uint8_t> taken)
      : g_(geometry), taken_(taken), connected_(geometry.positions.size()), component_of_(geometry.positions.size()) {}

  Components run() {
    std::vector<uint32_t> triangles(g_.triangles.size());
    std::iota(triangles.begin(), triangles.end(), 0u);
    if (g_.kinds.size() > 1) std::ranges::stable_sort(triangles, {}, [&](uint32_t t) { return g_.kind_of[t]; });
    out_.triangles.resize(triangles.size());
    for (size_t begin = 0, end; begin < triangles.size(); begin = end) {
      const uint32_t kind = g_.kind_of[triangles[begin]];
      for (end = begin + 1; end < triangles.size() && g_.kind_of[triangles[end]] == kind;) ++end;
      add_kind(std::span(triangles).subspan(begin, end - begin), static_cast<uint32_t>(begin));
    }
    return std::move(out_);
  }

private:
  uint32_t position(uint32_t triangle, int corner) const {
    return g_.vertices[g_.triangles[triangle][corner]].position;
  }

  /// Adds the components of all triangles of a kind.
  /// @param begin where they begin in Components::triangles
  void add_kind(std::span<const uint32_t> triangles, uint32_t begin) {
    for (const uint32_t t : triangles)
      for (int corner = 0; corner < 3; ++corner) {
        const uint32_t p = position(t, corner);
        connected_.reset(p), component_of_[p] = kNoPart;
      }
    for (const uint32_t t : triangles)
      for (int corner = 1; corner < 3; ++corner) connected_.join(position(t, 0), position(t, corner));
    const size_t first = out_.list.size();
    for (const uint32_t t : triangles) {
      uint32_t& number = component_of_[connected_.root(position(t, 0))];
      if (number == kNoPart) number = static_cast<uint32_t>(out_.list.size()), out_.list.emplace_back();
      Component& component = out_.list[number];
      ++component.end, component.free += taken_[t] == 0; // `end` is a count until all are counted
    }
    for (Component& component : std::span(out_.list).subspan(first)) {
      const uint32_t count = component.end;
      component.begin = component.end = begin;
      begin += count;
    }
    for (const uint32_t t : triangles)
      out_.triangles[out_.list[component_of_[connected_.root(position(t, 0))]].end++] = t;
  }

  const QuantizedGeometry& g_;
  const std::span<const uint8_t> taken_;
  DisjointSets connected_;             ///< positions
  std::vector<uint32_t> component_of_; ///< per position, valid for roots
  Components out_;
};

class PartFinder {
public:
  PartFinder(const QuantizedGeometry& geometry, std::span<const uint8_t> taken)
      : g_(geometry), taken_(taken), components_(ComponentFinder(geometry, taken).run()) {}

  std::vector<RepeatedPart> run() {
    const std::vector<std::vector<uint32_t>> groups = group_by_connectivity();
    std::vector<std::vector<RepeatedPart>> parts(groups.size());
    tbb::parallel_for(size_t{0}, groups.size(), [&](size_t i) { parts[i] = cut_alike(groups[i]); });
    std::vector<RepeatedPart> result;
    for (std::vector<RepeatedPart>& of_group : parts)
      result.insert(result.end(), std::make_move_iterator(of_group.begin()), std::make_move_iterator(of_group.end()));
    return result;
  }

private:
  /// Calls visit() for the numbers that make up a component's connectivity: per triangle, whether it is taken, and its
  /// vertices, numbered by first use.
  template <typename Visit>
  void visit_connectivity(uint32_t component, Renumbering& numbers, const Visit& visit) const {
    numbers.clear();
    for (const uint32_t t : components_.of(components_.list[component])) {
      visit(taken_[t]);
      for (int corner = 0; corner < 3; ++corner) visit(numbers(g_.triangles[t][corner]));
    }
  }

  std::vector<uint32_t> connectivity(uint32_t component, Renumbering& numbers) const {
    std::vector<uint32_t> all;
    visit_connectivity(component, numbers, [&](uint32_t value) { all.push_back(value); });
    return all;
  }

  /// Returns the components that are not alone in having their connectivity and kind, in groups.
  std::vector<std::vector<uint32_t>> group_by_connectivity() const {
    Renumbering numbers(kMaxClusterVertices);
    std::vector<std::vector<uint32_t>> groups;
    std::unordered_map<uint64_t, size_t> group_of_hash;
    for (uint32_t i = 0; i < components_.list.size(); ++i) {
      const Component& component = components_.list[i];
      if (component.free < kMinTriangles || component.free > kMaxTriangles) continue;
      uint64_t hash = g_.kind_of[components_.triangles[component.begin]];
      visit_connectivity(i, numbers,
                         [&](uint32_t value) { hash = (hash ^ value) * 0x9e3779b97f4a7c15u, hash ^= hash >> 29; });
      const auto [at, is_new] = group_of_hash.try_emplace(hash, groups.size());
      if (is_new) groups.emplace_back();
      groups[at->second].push_back(i);
    }
    std::erase_if(groups, [](const std::vector<uint32_t>& group) { return group.size() < 2; });
    for (std::vector<uint32_t>& group : groups) { // hashes may be equal by chance
      const std::vector<uint32_t> first = connectivity(group[0], numbers);
      std::erase_if(group, [&](uint32_t i) { return i != group[0] && connectivity(i, numbers) != first; });
    }
    return groups;
  }

  /// Area of the clusters' boxes over that of the box around all of them.
  double area_ratio(std::span<const uint32_t> triangles, const Clusters& clusters) const {
    TreeBox all = box_of(g_, triangles[0]);
    double sum = 0.0;
    uint32_t k = 0;
    for (const uint32_t end : clusters.ends) {
      TreeBox box = box_of(g_, triangles[clusters.order[k]]);
      for (; k < end; ++k) box.extend(box_of(g_, triangles[clusters.order[k]]));
      sum += box.half_area(), all.extend(box);
    }
    return sum / all.half_area();
  }

  /// Orders the triangles of each cluster as their strips will.
  void order_by_strips(std::span<const uint32_t> triangles, Clusters& clusters) const {
    NodeGroups groups;
    Renumbering numbers(kMaxClusterVertices);
    std::vector<Triangle> local;
    std::vector<LatticePoint> places;
    uint32_t begin = 0;
    for (const uint32_t end : clusters.ends) {
      const std::span<uint32_t> order = std::span(clusters.order).subspan(begin, end - begin);
      numbers.clear(), local.clear(), places.clear();
      for (const uint32_t k : order) {
        Triangle t{};
        for (int corner = 0; corner < 3; ++corner) t[corner] = numbers(g_.triangles[triangles[k]][corner]);
        local.push_back(t);
      }
      for (const uint32_t v : numbers.values) places.push_back(g_.positions[g_.vertices[v].position]);
      groups.find(places, local);
      const Strips strips = find_strips(groups.triangles(), static_cast<uint32_t>(places.size()), groups.ends());
      const std::vector<uint32_t> before(order.begin(), order.end());
      for (size_t i = 0; i < order.size(); ++i) order[i] = before[groups.order()[strips.triangle_order[i]]];
      begin = end;
    }
  }

  /// Extent of a part along each axis; four lattice steps, so that rounding rarely makes a difference.
  std::array<int64_t, 3> size_of(const RepeatedPart& part) const {
    std::array<int64_t, 3> size{};
    for (size_t axis = 0; axis < 3; ++axis) {
      int64_t lo = std::numeric_limits<int64_t>::max(), hi = std::numeric_limits<int64_t>::min();
      for (const uint32_t t : part.triangles)
        for (int corner = 0; corner < 3; ++corner) {
          const int64_t x = g_.positions[g_.vertices[g_.triangles[t][corner]].position][axis];
          lo = std::min(lo, x), hi = std::max(hi, x);
        }
      size[axis] = (hi - lo) / 4;
    }
    return size;
  }

  /// Cuts components of equal connectivity. Returns no parts if fewer than two of them can be cut alike.
  std::vector<RepeatedPart> cut_alike(const std::vector<uint32_t>& group) const {
    std::vector<RepeatedPart> parts;
    Clusters clusters; // of the first
    double first_ratio = 0.0;
    for (const uint32_t number : group) {
      std::vector<uint32_t> free;
      for (const uint32_t t : components_.of(components_.list[number]))
        if (taken_[t] == 0) free.push_back(t);
      if (number == group[0]) {
        clusters = cut_triangles(g_, free);
        first_ratio = area_ratio(free, clusters);
        order_by_strips(free, clusters);
      } else if (!(area_ratio(free, clusters) <= kMaxAreaRatio * first_ratio)) { // also if an area is 0
        continue;
      }
      RepeatedPart& part = parts.emplace_back();
      for (const uint32_t k : clusters.order) part.triangles.push_back(free[k]);
      part.ends = clusters.ends;
    }
    if (parts.size() < 2) return {};
    std::ranges::stable_sort(parts, {}, [&](const RepeatedPart& part) { return size_of(part); });
    return parts;
  }

  const QuantizedGeometry& g_;
  const std::span<const uint8_t> taken_;
  const Components components_;
};

} // namespace

std::vector<RepeatedPart> find_repeated_parts(const QuantizedGeometry& geometry, std::span<const uint8_t> taken) {
  return PartFinder(geometry, taken).run();
}

} // namespace packtrace
