#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "compress/format/pages/page_border.h"
#include "compress/format/pages/page_cluster.h"
#include "compress/format/pages/page_contexts.h"
#include "compress/format/pages/point_order.h"
#include "compress/format/pages/position_predictor.h"
#include "compress/format/pages/value_coder.h"

namespace packtrace {

/// Codes the triangles of a page's clusters, then the positions of their new points. See PageModel for Coder.
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
    triangles_.clear();
    predictor_.begin();
    cluster_ = 0;
    last_strips_ = {};
    repeats_ = false;
    fault_ = false;
  }

  /// Codes the triangles of the next cluster: their number, turns, corners and positions.
  void code_triangles(ClusterValues& c) {
    ++cluster_;
    values_ = &c;
    reserve();
    code_repeat(c);
    if (!repeats_) code_triangle_count(c);
    const auto first_point = static_cast<uint32_t>(points_.size());
    const uint32_t first_corner = triangles_.count();
    const uint32_t triangle_count = c.triangle_count;
    vertex_count_ = 0, corner_count_ = 0;
    uint32_t restarts = 0;
    std::array<Corner, 3> t{};
    for (uint32_t i = 0; i < triangle_count && !fault_; ++i) {
      Turn turn = Turn::kRestart;
      if (repeats_) {
        turn = c.turns[i];
      } else if (i > 0) {
        const PagePoint &p = points_[t[0].point], &q = points_[t[1].point], &r = points_[t[2].point];
        const uint32_t open = (q.next.has(t[2].point) ? 1u : 0u) + (r.next.has(t[0].point) ? 2u : 0u);
        const uint32_t context = context::kTurn + (open * 8 + p.triangles) * 8 + q.triangles;
        turn = static_cast<Turn>(std::min(coder_.symbol(context, static_cast<uint32_t>(c.turns[i])), 2u));
      }
      c.turns[i] = turn;
      if (turn == Turn::kRestart) {
        ++restarts;
        code_restart(t);
      } else {
        const size_t left = turn == Turn::kLeft ? 1 : 0; // an index, because a branch would be unpredictable
        const Corner opposite = t[left];
        t = {t[2 - 2 * left], t[1 + left], {}};
        guess_third(t, opposite.point);
        const uint32_t before = std::clamp<uint32_t>(points_[t[0].point].triangles, 3, 6) - 3;
        t[2] = code_corner({context::kStripNaming + points_[t[1].point].triangles * 4 + before, 32},
                           context::kStripCorner, {t[0].vertex, t[1].vertex}, opposite.point);
      }
      corners_of_[i] = {t[0].vertex, t[1].vertex, t[2].vertex};
      add_triangle(points_, triangles_, {t[0].point, t[1].point, t[2].point});
    }
    c.vertex_count = vertex_count_;
    c.corner_count = corner_count_;
    c.strip_count = restarts;
    if (fault_) return;
    if (!repeats_) remember_strips(c);
    code_positions(first_point, first_corner);
    for (uint32_t v = 0; v < vertex_count_; ++v) c.positions[v] = points_[vertices_[v].point].position;
  }

  ClusterValues* values_ = nullptr;
  std::vector<PagePoint> points_;
  uint32_t vertex_count_ = 0;
  std::array<Vertex, kMaxClusterVertices> vertices_;
  std::array<std::array<uint16_t, 3>, kMaxClusterTriangles> corners_of_;

private:
  /// A triangle corner: a point, and the cluster's vertex at that point.
  struct Corner {
    uint32_t point = 0;
    uint16_t vertex = 0;
  };

  /// Strips of the last cluster of the page.
  struct LastStrips {
    uint32_t triangle_count = 0, corner_count = 0; ///< 0 before the first cluster
    std::array<Turn, kMaxClusterTriangles> turns;
    std::array<uint16_t, kMaxClusterCorners> corners;
  };

  /// Codes whether the cluster has the same strips as the last one, which is true of the blocks of a regular grid. If
  /// so, decoders copy the last strips.
  void code_repeat(ClusterValues& c) {
    const LastStrips& last = last_strips_;
    const auto same = [&] {
      return c.triangle_count == last.triangle_count && c.corner_count == last.corner_count &&
             std::equal(c.turns.begin(), c.turns.begin() + c.triangle_count, last.turns.begin()) &&
             std::equal(c.corners.begin(), c.corners.begin() + c.corner_count, last.corners.begin());
    };
    repeats_ = flag(context::kRepeats + (repeats_ ? 1 : 0), !kDecodes && same()) != 0;
    if (!kDecodes || !repeats_) return;
    if (last.triangle_count == 0) fault_ = true;
    c.triangle_count = last.triangle_count;
    std::copy_n(last.turns.begin(), last.triangle_count, c.turns.begin());
    std::copy_n(last.corners.begin(), last.corner_count, c.corners.begin());
  }

  void code_triangle_count(ClusterValues& c) {
    if (flag(context::kFull, c.triangle_count == kMaxClusterTriangles) != 0)
      c.triangle_count = kMaxClusterTriangles;
    else
      c.triangle_count = 1 + static_cast<uint32_t>(coder_.raw(context::kFull, c.triangle_count - 1, 7));
  }

  void remember_strips(const ClusterValues& c) {
    last_strips_.triangle_count = c.triangle_count, last_strips_.corner_count = c.corner_count;
    std::copy_n(c.turns.begin(), c.triangle_count, last_strips_.turns.begin());
    std::copy_n(c.corners.begin(), c.corner_count, last_strips_.corners.begin());
  }

  void reserve() {
    if (points_.capacity() < points_.size() + kMaxClusterVertices)
      points_.reserve(2 * points_.capacity() + kMaxClusterVertices);
  }

  void guess_third(const std::array<Corner, 3>& t, uint32_t opposite) {
    guess_ = {points_[t[1].point].previous.pick(opposite), points_[t[0].point].next.pick(opposite)};
  }

  void code_restart(std::array<Corner, 3>& t) {
    const Corner before = t[2];
    guess_ = {kNone, kNone};
    if (!points_.empty()) guess_ = {points_[before.point].previous[0], points_[before.point].next[0]};
    t[0] = code_corner({context::kNaming}, context::kFirstCorner, {kNoVertex, kNoVertex}, kNone);
    const PagePoint& p = points_[t[0].point];
    guess_ = {p.previous[0], p.next[0]};
    t[1] = code_corner({context::kNaming + 12}, context::kSecondCorner, {t[0].vertex, kNoVertex}, kNone);
    const PagePoint& b = points_[t[1].point];
    // Third corner of the triangle on the other side of the first two corners, if there is one.
    uint32_t apex = kNone;
    if (b.next.has(t[0].point)) apex = triangles_.points[b.apex[b.next[0] == t[0].point ? 0 : 1]];
    guess_third(t, apex);
    t[2] = code_corner({context::kNaming + 24}, context::kThirdCorner, {t[0].vertex, t[1].vertex}, apex);
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

  /// Returns the name of the next corner. Decoders return the vertex if the strips repeat, else only defaults.
  CornerName name_corner() {
    CornerName name;
    if (kDecodes && !repeats_) return name;
    name.vertex = values_->corners[corner_count_];
    name.fresh = name.vertex == vertex_count_;
    if constexpr (!kDecodes) {
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

  /// Models that code the name of a corner: one per state of the guesses, `stride` apart.
  struct NameModels {
    uint32_t first, stride = 1;
  };

  /// @param opposite point across the edge of the corners before, or kNone
  Corner code_corner(NameModels names, uint32_t kind, std::array<uint16_t, 2> neighbours, uint32_t opposite) {
    ClusterValues& c = *values_;
    auto [naming, point, vertex, fresh] = name_corner();
    if (repeats_ && !fresh) {
      ++corner_count_;
      return {vertices_[vertex].point, vertex};
    }
    const bool same = guess_[0] == guess_[1];
    const uint32_t state = guess_state(guess_[0]) * 4 + (same ? 3 : guess_state(guess_[1]));
    const uint32_t model =
        repeats_ ? context::kRepeatedNaming + names_[vertex] * 12 + state : names.first + state * names.stride;
    naming = coder_.symbol(model, naming);
    if (corner_count_ >= kMaxClusterCorners || (repeats_ && naming == kOfCluster)) naming = kInvalidNaming;
    switch (naming) {
    case kNewPoint:
      point = add_point();
      break;
    case kGuess0:
    case kGuess1:
      point = guess_[naming - kGuess0];
      if (point == kNone) return fail();
      if (points_[point].cluster == cluster_ && !repeats_)
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
      vertices_[vertex] = {point, neighbours, opposite, 0, DVec3(0.0), Vec3(0.0f)};
      names_[vertex] = static_cast<uint8_t>(naming);
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
    PagePoint& point = points_.emplace_back();
    if constexpr (!kDecodes) {
      point.position = values_->positions[vertex_count_];
      coder_.add_point(point.position, number);
    }
    return number;
  }

  /// Codes the positions of the points that the cluster's triangles added.
  void code_positions(uint32_t first_point, uint32_t first_corner) {
    order_.begin(triangles_, static_cast<uint32_t>(points_.size()), first_point, first_corner);
    for (uint32_t i = 0; i < order_.count(); ++i) {
      const uint32_t number = order_.next();
      code_position(number);
      order_.learn(number);
    }
  }

  void code_position(uint32_t number) {
    predictor_.predict(points_, triangles_, order_, number);
    PagePoint& point = points_[number];
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto [first, second, mixed] = predictor_.models(axis);
      const uint64_t predicted = wrap(predictor_.coordinate(axis));
      auto error = static_cast<int64_t>(wrap(point.position[axis]) - predicted);
      error = mixed ? difference(first, second, error) : difference(first, error);
      predictor_.learn_error(error);
      point.position[axis] = static_cast<int64_t>(predicted + wrap(error));
    }
    point.error_bits = predictor_.error_bits();
    predictor_.learn_position(point.position);
  }

  uint32_t cluster_ = 0, corner_count_ = 0;
  bool repeats_ = false; ///< whether the cluster has the same strips as the last one
  LastStrips last_strips_;
  std::array<uint8_t, kMaxClusterVertices>
      names_{}; ///< per vertex: Naming of its first corner; from the last cluster until coded
  std::array<uint32_t, 2> guess_{};
  PageTriangles triangles_;
  PointOrder order_;
  PositionPredictor predictor_;
};

} // namespace packtrace
