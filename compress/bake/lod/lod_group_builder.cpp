#include "compress/bake/lod/lod_group_builder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "compress/bake/clusters/morton.h"
#include "compress/bake/clusters/renumbering.h"
#include "compress/bake/lod/bound/direct_bound.h"
#include "compress/bake/lod/bound/stated_error.h"
#include "compress/bake/lod/bound/surface_bound.h"
#include "compress/bake/lod/level_clusters.h"
#include "compress/bake/lod/loose_pieces.h"
#include "compress/bake/lod/simplify/simplify.h"
#include "compress/format/cluster/normal_codec.h"
#include "pbrt_import/base/weld_table.h"

namespace packtrace {
namespace {

class GroupBuilder {
public:
  explicit GroupBuilder(const LodGroupInput& input) : in_(input), encoding_(input.geometry.normal_encoding) {
    for (const LodCluster* c : in_.clusters) out_.source_triangles += c->range.triangle_count;
  }

  SimplifiedGroup run() {
    gather();
    SimplifyConfig config;
    config.target_triangles = share_of_triangles(in_.kept);
    config.seam_of_kind = in_.seam_of_kind;
    config.keep_points = keep_points_;
    const std::vector<DVec3> points = mesh_.points;
    std::vector<LodTriangle> triangles = mesh_.triangles;
    triangles.insert(triangles.end(), lines_.begin(), lines_.end());
    simplify(mesh_, config);
    numbers_.insert(numbers_.end(), line_numbers_.begin(), line_numbers_.end());
    links_ = bound_errors(points, triangles, mesh_);
    if (mesh_.triangles.size() > config.target_triangles) drop_pieces(config.target_triangles);
    bound_directly({in_.levels, center_, points, triangles, numbers_, in_.floor, dropped_}, mesh_, links_);
    for (const LodTriangle& t : mesh_.triangles) out_.error = std::max(out_.error, t.error);
    number_vertices();
    split();
    list_below();
    return std::move(out_);
  }

private:
  void drop_pieces(uint32_t target) {
    std::vector<double> errors;
    for (const LodTriangle& t : mesh_.triangles) errors.push_back(t.error);
    const std::vector<TriangleSubstitute> stands = drop_loose_pieces(mesh_, {target, share_of_triangles(kWorthwhile)});
    const std::vector<double> bounds = links_.bounds;
    for (SurfaceLink& link : links_.links) {
      const TriangleSubstitute& stand = stands[link.simplified];
      link.simplified = stand.triangle;
      double& bound = links_.bounds[link.source];
      dropped_ |= stand.dropped;
      if (stand.dropped) bound = std::max(bound, stated_error(stand.distance, bounds[link.source]));
    }
    // Dropping pieces does not change the distance of the remaining triangles from the surface that they represent.
    for (size_t i = 0; i < stands.size(); ++i)
      if (!stands[i].dropped) mesh_.triangles[stands[i].triangle].error = errors[i];
  }

  /// Lists, for each remaining triangle, the group's triangles that it may represent.
  void list_below() {
    const auto [ends, found] = links_.by_simplified(mesh_.triangles.size());
    // per source triangle: the last triangle whose list it was added to
    std::vector<uint32_t> last(numbers_.size(), Wedge::kNone);
    for (const uint32_t s : order_) {
      for (uint32_t i = ends[s]; i < ends[s + 1]; ++i)
        if (std::exchange(last[found[i]], s) != s) out_.below.push_back(numbers_[found[i]]);
      out_.below_ends.push_back(static_cast<uint32_t>(out_.below.size()));
    }
  }

  uint32_t share_of_triangles(double share) const {
    return static_cast<uint32_t>(share * static_cast<double>(out_.source_triangles));
  }

  void gather() {
    Renumbering point_numbers(out_.source_triangles), vertex_numbers(out_.source_triangles),
        wedge_numbers(out_.source_triangles);
    std::vector<uint32_t> point_of_vertex; // by number in vertex_numbers
    point_of_vertex.reserve(out_.source_triangles);
    mesh_.triangles.reserve(out_.source_triangles);
    for (size_t i = 0; i < in_.clusters.size(); ++i) {
      const LodCluster& c = *in_.clusters[i];
      const TriangleKind& kind = in_.geometry.kinds[c.range.kind];
      keep_points_ |= kind.uvs;
      const bool plain = kind.flat && !kind.uvs;
      for (uint32_t k = 0; k < c.range.triangle_count; ++k) {
        const Triangle& v = in_.levels.triangles[c.range.first_triangle + k];
        LodTriangle t{{}, Triangle(Wedge::kNone), c.range.kind, in_.levels.errors[c.range.first_triangle + k]};
        for (int corner = 0; corner < 3; ++corner) {
          const uint32_t vertex = vertex_numbers(v[corner]);
          if (vertex == point_of_vertex.size())
            point_of_vertex.push_back(point_numbers(in_.levels.vertices[v[corner]].position));
          t.points[corner] = point_of_vertex[vertex];
          if (!plain) t.wedges[corner] = wedge_numbers(v[corner]);
        }
        const bool line = t.points.x == t.points.y || t.points.y == t.points.z || t.points.z == t.points.x;
        if (!line)
          mesh_.triangles.push_back(t), numbers_.push_back(c.range.first_triangle + k);
        else if (!in_.lines.holds(points_of(v)))
          lines_.push_back(t), line_numbers_.push_back(c.range.first_triangle + k);
      }
    }
    positions_ = std::move(point_numbers.values);
    for (const uint32_t vertex : wedge_numbers.values)
      mesh_.wedges.push_back({DVec3(decode_normal(encoding_, in_.levels.vertices[vertex].normal_code)), vertex});
    place_points();
  }

  Triangle points_of(const Triangle& v) const {
    return {in_.levels.vertices[v.x].position, in_.levels.vertices[v.y].position, in_.levels.vertices[v.z].position};
  }

  /// Sets the points relative to the centre of the group, which keeps coordinates small.
  void place_points() {
    for (size_t axis = 0; axis < 3; ++axis) {
      int64_t lo = std::numeric_limits<int64_t>::max(), hi = std::numeric_limits<int64_t>::min();
      for (const uint32_t p : positions_)
        lo = std::min(lo, in_.levels.positions[p][axis]), hi = std::max(hi, in_.levels.positions[p][axis]);
      center_[axis] = lo + (hi - lo) / 2;
    }
    for (const uint32_t p : positions_) {
      DVec3 d;
      for (size_t axis = 0; axis < 3; ++axis)
        d[static_cast<int>(axis)] = static_cast<double>(in_.levels.positions[p][axis] - center_[axis]);
      mesh_.points.push_back(d);
      mesh_.locked.push_back(in_.owner[p] == kShared || in_.locked_for_ever[p] != 0);
    }
  }

  /// Number of a corner's vertex. The last result per point or wedge is cached: adjacent triangles mostly share it.
  uint32_t vertex_number(uint32_t point, uint32_t wedge, const TriangleKind& kind) {
    KnownVertex& known = known_vertices_[wedge == Wedge::kNone ? point : mesh_.points.size() + wedge];
    if (known.point != point || known.wedge != wedge || known.flat != kind.flat)
      known = {point, wedge, find_vertex(point, wedge, kind), kind.flat};
    return known.vertex;
  }

  /// Reuses the existing vertex if nothing changed, otherwise adds a new one.
  uint32_t find_vertex(uint32_t point, uint32_t wedge, const TriangleKind& kind) {
    QuantizedVertex v{position_number(point), 0, {}};
    if (wedge != Wedge::kNone) {
      const Wedge& w = mesh_.wedges[wedge];
      if (w.source != Wedge::kNone) {
        const QuantizedVertex& source = in_.levels.vertices[w.source];
        if (source.position == v.position) return w.source;
        v.normal_code = source.normal_code, v.uv = source.uv;
      } else if (!kind.flat) {
        v.normal_code = encode_normal(encoding_, w.normal);
      }
    }
    const auto next = static_cast<uint32_t>(out_.new_vertices.size());
    const uint64_t uv = static_cast<uint32_t>(v.uv[0]) | (uint64_t{static_cast<uint32_t>(v.uv[1])} << 32);
    const uint32_t number = vertex_table_->find_or_add(mix_words(v.position, v.normal_code, uv), next,
                                                       [&](uint32_t other) { return out_.new_vertices[other] == v; });
    if (number == next) out_.new_vertices.push_back(v);
    return kNewNumber + number;
  }

  uint32_t position_number(uint32_t point) {
    if (mesh_.moved[point] == 0) return positions_[point];
    uint32_t& number = new_position_[point];
    if (number == Wedge::kNone) {
      number = kNewNumber + static_cast<uint32_t>(out_.new_positions.size());
      LatticePoint p{};
      for (size_t axis = 0; axis < 3; ++axis)
        p[axis] = center_[axis] + static_cast<int64_t>(mesh_.points[point][static_cast<int>(axis)]);
      out_.new_positions.push_back(p);
    }
    return number;
  }

  void number_vertices() {
    WeldTable table(3 * mesh_.triangles.size());
    vertex_table_ = &table;
    known_vertices_.resize(mesh_.points.size() + mesh_.wedges.size());
    vertices_.reserve(mesh_.triangles.size());
    new_position_.assign(mesh_.points.size(), Wedge::kNone);
    for (const LodTriangle& t : mesh_.triangles) {
      Triangle v{};
      for (int corner = 0; corner < 3; ++corner)
        v[corner] = vertex_number(t.points[corner], t.wedges[corner], in_.geometry.kinds[t.kind]);
      vertices_.push_back(v);
    }
  }

  /// Splits the triangles of each kind into clusters, from triangles in Morton order.
  void split() {
    std::vector<std::tuple<uint32_t, uint64_t, uint32_t>> keys; // kind, Morton code, triangle
    DVec3 lo(std::numeric_limits<double>::infinity()), hi(-lo);
    for (const DVec3& p : mesh_.points) lo = glm::min(lo, p), hi = glm::max(hi, p);
    const double extent = std::max({hi.x - lo.x, hi.y - lo.y, hi.z - lo.z, 1.0});
    const double scale = static_cast<double>((1u << kMortonBits) - 1) / (3.0 * extent);
    for (uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
      const DVec3 p = (corner_sum(i) - 3.0 * lo) * scale;
      keys.emplace_back(mesh_.triangles[i].kind,
                        morton_code(static_cast<uint64_t>(p.x), static_cast<uint64_t>(p.y), static_cast<uint64_t>(p.z)),
                        i);
    }
    std::sort(keys.begin(), keys.end());
    for (size_t begin = 0, end; begin < keys.size(); begin = end) {
      std::vector<uint32_t> triangles;
      for (end = begin; end < keys.size() && std::get<0>(keys[end]) == std::get<0>(keys[begin]); ++end)
        triangles.push_back(std::get<2>(keys[end]));
      split_kind(std::get<0>(keys[begin]), triangles);
    }
  }

  DVec3 corner_sum(uint32_t triangle) const {
    const Triangle& t = mesh_.triangles[triangle].points;
    return mesh_.points[t.x] + mesh_.points[t.y] + mesh_.points[t.z];
  }

  void split_kind(uint32_t kind, const std::vector<uint32_t>& triangles) {
    Renumbering numbers(triangles.size());
    std::vector<Triangle> vertices, points;
    std::vector<DVec3> centroids;
    for (const uint32_t triangle : triangles) {
      Triangle v{};
      for (int corner = 0; corner < 3; ++corner) v[corner] = numbers(vertices_[triangle][corner]);
      vertices.push_back(v);
      points.push_back(mesh_.triangles[triangle].points);
      centroids.push_back(corner_sum(triangle));
    }
    const Clusters clusters = split_level({vertices, points, centroids, static_cast<uint32_t>(numbers.values.size()),
                                           static_cast<uint32_t>(mesh_.points.size())},
                                          mesh_.points, !in_.geometry.kinds[kind].flat);
    const auto before = static_cast<uint32_t>(out_.triangles.size());
    for (const uint32_t member : clusters.order) {
      out_.triangles.push_back(vertices_[triangles[member]]);
      out_.errors.push_back(mesh_.triangles[triangles[member]].error);
      order_.push_back(triangles[member]);
    }
    for (const uint32_t end : clusters.ends)
      out_.cluster_ends.push_back(before + end), out_.cluster_kinds.push_back(kind);
  }

  /// The last vertex found for a point, for corners without wedge, or for a wedge.
  struct KnownVertex {
    uint32_t point = Wedge::kNone, wedge = 0, vertex = 0;
    bool flat = false;
  };

  const LodGroupInput& in_;
  NormalEncoding encoding_;
  SimplifiedGroup out_;
  SimplifyMesh mesh_;
  std::vector<LodTriangle> lines_;               // degenerate triangles that are part of the source surface
  std::vector<uint32_t> numbers_, line_numbers_; // of the source triangles, and of lines_
  SurfaceLinks links_;
  std::vector<uint32_t> order_; // remaining triangles in output order
  LatticePoint center_{};
  bool keep_points_ = false, dropped_ = false;
  std::vector<uint32_t> positions_;         // per point
  std::vector<uint32_t> new_position_;      // per moved point
  std::vector<Triangle> vertices_;          // per remaining triangle
  std::vector<KnownVertex> known_vertices_; // per point, then per wedge
  WeldTable* vertex_table_ = nullptr;
};

} // namespace

SimplifiedGroup simplify_group(const LodGroupInput& input) { return GroupBuilder(input).run(); }

} // namespace packtrace
