#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "compress/format/pages/page_border.h"
#include "compress/format/pages/page_cluster.h"
#include "compress/format/pages/page_contexts.h"
#include "compress/format/pages/value_coder.h"

namespace packtrace {

/// Codes the triangles of a page's clusters and the positions of their vertices. See PageModel for Coder.
///
/// Points are the distinct vertex positions of a page, in order of first use. The border of the triangles coded so far
/// is stored as up to two outgoing and two incoming edges per point. A triangle that continues the surface closes a
/// border edge, so the end point of that edge predicts its third corner, both within and across clusters.
template <class Coder>
class PageSurface : public ValueCoder<Coder> {
public:
  using ValueCoder<Coder>::ValueCoder;

protected:
  using Values = ValueCoder<Coder>;
  using Values::coder_, Values::fault_, Values::kDecodes;
  using Values::difference, Values::flag, Values::magnitude;

  static constexpr uint32_t kNone = kNoPagePoint;
  static constexpr uint16_t kNoVertex = 0xffff;

  /// A vertex of the current cluster.
  struct Vertex {
    uint32_t point;
    std::array<uint16_t, 2> neighbours; ///< earlier corners of the triangle that first uses it, or kNoVertex
    uint32_t opposite;                  ///< point across their edge, or kNone
    uint32_t triangle_count;            ///< triangles of the cluster that use it
    DVec3 face_sum;                     ///< sum of their cross products, in lattice steps
    Vec3 unit_normal;                   ///< decoded
  };

  /// Call before the first cluster of each page.
  void begin_surface() {
    points_.clear();
    cluster_ = 0;
    fault_ = false;
  }

  /// Codes the triangles of the next cluster: its turns, corners and positions.
  void code_triangles(ClusterValues& c) {
    ++cluster_;
    values_ = &c;
    reserve();
    const uint32_t triangle_count = c.triangle_count;
    vertex_count_ = 0, corner_count_ = 0;
    uint32_t restarts = 0;
    std::array<Corner, 3> t{};
    uint32_t turns = 8; // the last two turns as base-3 digits; 2 is a restart
    for (uint32_t i = 0; i < triangle_count && !fault_; ++i) {
      Turn turn = Turn::kRestart;
      if (i > 0) {
        const uint32_t open_right = points_[t[1].point].next.has(t[2].point),
                       open_left = points_[t[2].point].next.has(t[0].point);
        turn = static_cast<Turn>(std::min(
            coder_.symbol(context::kTurn + 36 * (c.has_normals ? 1u : 0u) + turns * 4 + open_right + 2 * open_left,
                          static_cast<uint32_t>(c.turns[i])),
            2u));
      }
      c.turns[i] = turn;
      turns = (turns * 3 + static_cast<uint32_t>(turn)) % 9;
      if (turn == Turn::kRestart) {
        ++restarts;
        code_restart(t);
      } else {
        const size_t left = turn == Turn::kLeft ? 1 : 0; // an index, because a branch would be unpredictable
        const Corner opposite = t[left];
        t = {t[2 - 2 * left], t[1 + left], {}};
        guess_third(t, opposite.point);
        basis_ = {t[0].point, t[1].point, opposite.point};
        t[2] = code_corner(context::kStripNaming + 12 * (2 * history_ + (c.turns[i] == c.turns[i - 1] ? 1 : 0)),
                           context::kStripCorner, {t[0].vertex, t[1].vertex});
      }
      corners_of_[i] = {t[0].vertex, t[1].vertex, t[2].vertex};
      close_edges(points_, {t[0].point, t[1].point, t[2].point});
    }
    c.vertex_count = vertex_count_;
    c.corner_count = corner_count_;
    c.strip_count = restarts;
  }

  ClusterValues* values_ = nullptr;
  std::vector<PagePoint> points_;
  uint32_t vertex_count_ = 0;
  std::array<Vertex, kMaxClusterVertices> vertices_;
  std::array<std::array<uint16_t, 3>, kMaxClusterTriangles> corners_of_;

private:
  static constexpr uint32_t kMaxExtent = 19;

  /// A triangle corner: a point, and the cluster's vertex at that point.
  struct Corner {
    uint32_t point = 0;
    uint16_t vertex = 0;
  };

  void reserve() {
    if (points_.capacity() < points_.size() + kMaxClusterVertices)
      points_.reserve(2 * points_.capacity() + kMaxClusterVertices);
  }

  /// Bit width of the span of three coordinates.
  static uint32_t extent(int64_t a, int64_t b, int64_t c) {
    const int64_t lo = std::min({a, b, c}), hi = std::max({a, b, c});
    return static_cast<uint32_t>(std::bit_width(wrap(hi) - wrap(lo)));
  }

  void guess_third(const std::array<Corner, 3>& t, uint32_t opposite) {
    guess_ = {points_[t[1].point].previous.pick(opposite), points_[t[0].point].next.pick(opposite)};
  }

  void code_restart(std::array<Corner, 3>& t) {
    const Corner before = t[2];
    const bool first = points_.empty();
    guess_ = {kNone, kNone};
    if (first) {
      basis_ = {kNone, kNone, kNone};
      extent_ = {kMaxExtent, kMaxExtent, kMaxExtent};
    } else {
      guess_ = {points_[before.point].previous[0], points_[before.point].next[0]};
      basis_ = {before.point, kNone, kNone};
    }
    t[0] = code_corner(context::kNaming, context::kFirstCorner, {kNoVertex, kNoVertex});
    const PagePoint& p = points_[t[0].point];
    guess_ = {p.previous[0], p.next[0]};
    basis_ = {t[0].point, kNone, kNone};
    t[1] = code_corner(context::kNaming + 12, context::kSecondCorner, {t[0].vertex, kNoVertex});
    const PagePoint& b = points_[t[1].point];
    // Third corner of the triangle on the other side of the first two corners, if there is one.
    const uint32_t apex = b.next.has(t[0].point) ? b.apex[b.next[0] == t[0].point ? 0 : 1] : kNone;
    guess_third(t, apex);
    basis_ = {t[0].point, t[1].point, apex != kNone ? apex : t[0].point};
    t[2] = code_corner(context::kNaming + 24, context::kThirdCorner, {t[0].vertex, t[1].vertex});
  }

  /// Predicts a new point: at p + q - o of the basis, or at p, or at 0. Also sets extent_, the spans that select the
  /// contexts of the errors.
  std::array<uint64_t, 3> predict() {
    std::array<uint64_t, 3> prediction{};
    if (basis_[0] == kNone) return prediction;
    const LatticePoint& p = points_[basis_[0]].position;
    if (basis_[1] == kNone) return {wrap(p[0]), wrap(p[1]), wrap(p[2])}; // extent_ keeps the last span
    const LatticePoint &q = points_[basis_[1]].position, &o = points_[basis_[2]].position;
    for (size_t axis = 0; axis < 3; ++axis) {
      prediction[axis] = wrap(p[axis]) + wrap(q[axis]) - wrap(o[axis]);
      extent_[axis] = std::min(extent(p[axis], q[axis], o[axis]), kMaxExtent);
    }
    return prediction;
  }

  /// Symbols that name a corner.
  enum Naming : uint32_t { kNewPoint, kGuess0, kGuess1, kOfCluster, kOfPage, kCreaseOfCluster };

  uint32_t guess_state(uint32_t guess) const {
    return guess == kNone ? 0u : points_[guess].cluster == cluster_ ? 1u : 2u;
  }

  /// How a corner is coded.
  struct CornerName {
    uint32_t naming = kNewPoint, point = kNone;
    uint16_t vertex = 0;
    bool fresh = true; ///< whether the corner is the first of a vertex
  };

  /// Returns the name of the next corner; decoders return the default.
  CornerName name_corner() {
    CornerName name;
    if constexpr (!kDecodes) {
      name.vertex = values_->corners[corner_count_];
      name.fresh = name.vertex == vertex_count_;
      name.point = name.fresh ? coder_.find_point(values_->positions[name.vertex]) : vertices_[name.vertex].point;
      if (name.point != kNone)
        name.naming = name.point == guess_[0]                   ? kGuess0
                      : name.point == guess_[1]                 ? kGuess1
                      : points_[name.point].cluster != cluster_ ? kOfPage
                      : name.fresh                              ? kCreaseOfCluster
                                                                : kOfCluster;
    }
    return name;
  }

  Corner code_corner(uint32_t names, uint32_t kind, std::array<uint16_t, 2> neighbours) {
    ClusterValues& c = *values_;
    auto [naming, point, vertex, fresh] = name_corner();
    const bool same = guess_[0] == guess_[1];
    const uint32_t state = guess_state(guess_[0]) * 4 + (same ? 3 : guess_state(guess_[1]));
    naming = coder_.symbol(names + state, naming);
    history_ = (2 * history_ + (naming == kNewPoint ? 1 : 0)) & 3u;
    if (corner_count_ >= kMaxClusterCorners) naming = kInvalidNaming;
    switch (naming) {
    case kNewPoint:
      point = add_point();
      break;
    case kGuess0:
    case kGuess1:
      point = guess_[naming - kGuess0];
      if (point == kNone) return fail();
      if (points_[point].cluster == cluster_)
        fresh = code_vertex_at_point(fresh, point, vertex);
      else
        fresh = true;
      break;
    case kOfCluster:
    case kCreaseOfCluster: {
      if (vertex_count_ == 0) return fail();
      const uint16_t named = static_cast<uint16_t>(fresh && !kDecodes ? points_[point].vertex : vertex);
      const uint64_t back = magnitude(context::kBack + kind, wrap(vertex_count_ - 1 - named));
      if (back >= vertex_count_) return fail();
      fresh = naming == kCreaseOfCluster;
      vertex = static_cast<uint16_t>(vertex_count_ - 1 - back);
      point = vertices_[vertex].point;
      break;
    }
    case kOfPage: {
      const uint64_t back = magnitude(context::kPageBack, points_.size() - 1 - point);
      if (back >= points_.size()) return fail();
      point = static_cast<uint32_t>(points_.size() - 1 - back);
      fresh = true;
      break;
    }
    default:
      return fail();
    }
    if (fresh) {
      if (vertex_count_ >= kMaxClusterVertices) return fail();
      vertex = static_cast<uint16_t>(vertex_count_++);
      vertices_[vertex] = {point, neighbours, basis_[2] != basis_[0] ? basis_[2] : kNone, 0, DVec3(0.0), Vec3(0.0f)};
      c.positions[vertex] = points_[point].position;
      points_[point].cluster = cluster_;
      points_[point].vertex = vertex;
    }
    c.corners[corner_count_++] = vertex;
    return {point, vertex};
  }

  static constexpr uint32_t kInvalidNaming = 15;

  Corner fail() {
    fault_ = true;
    if (points_.empty()) points_.emplace_back(); // the returned corner refers to point 0
    return {};
  }

  /// Codes which of the cluster's vertices at a point is meant: the newest, an older one, or a fresh one.
  bool code_vertex_at_point(bool fresh, uint32_t point, uint16_t& vertex) {
    const uint32_t version = coder_.symbol(context::kVersion, fresh ? 2u : vertex == points_[point].vertex ? 0u : 1u);
    if (version == 0) vertex = points_[point].vertex;
    if (version == 1) {
      const uint64_t back = magnitude(context::kVertexAtPointBack, wrap(vertex_count_ - 1 - vertex));
      if (back >= vertex_count_)
        fail();
      else
        vertex = static_cast<uint16_t>(vertex_count_ - 1 - back);
    }
    return version >= 2;
  }

  uint32_t add_point() {
    const auto number = static_cast<uint32_t>(points_.size());
    LatticePoint position{};
    if constexpr (!kDecodes) position = values_->positions[vertex_count_];
    const std::array<uint64_t, 3> prediction = predict();
    uint32_t surprise = 0; // error of the axis before relative to its span; 0 for x
    for (size_t axis = 0; axis < 3; ++axis) {
      const uint32_t e = extent_[axis];
      const auto delta = static_cast<int64_t>(wrap(position[axis]) - prediction[axis]);
      const int64_t coded = difference(context::kPosition + e * 3 + surprise, delta);
      position[axis] = static_cast<int64_t>(prediction[axis] + wrap(coded));
      const auto width = static_cast<uint32_t>(std::bit_width(wrap(coded < 0 ? ~coded : coded)));
      surprise = width == 0 ? 0 : width + 2 < e ? 1 : 2;
    }
    points_.emplace_back().position = position;
    if constexpr (!kDecodes) coder_.add_point(position, number);
    return number;
  }

  uint32_t cluster_ = 0, corner_count_ = 0;
  std::array<uint32_t, 2> guess_{};
  uint32_t history_ = 0;             // bits: whether the last two corners were new points
  std::array<uint32_t, 3> basis_{};  // points that the next new point is predicted from
  std::array<uint32_t, 3> extent_{}; // per axis: bit width of the span of the last three basis points
};

} // namespace packtrace
