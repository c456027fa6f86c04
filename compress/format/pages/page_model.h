#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "compress/format/pages/normal_predictor.h"
#include "compress/format/pages/page_cluster.h"
#include "compress/format/pages/page_contexts.h"

namespace packtrace {

/// Codes the values of a page's clusters: their order, and the prediction of each value. The same code encodes and
/// decodes. A coder's functions take the value and return it; decoders ignore the argument.
///
/// A Coder has:
///   static constexpr bool kDecodes;
///   uint32_t symbol(uint32_t context, uint32_t value);              values 0..15
///   uint64_t raw(uint32_t context, uint64_t value, uint32_t bits);  0..32 bits; the context only assigns a stream
///   uint32_t find_point(const LatticePoint&);                       encoders: the page's point there, or kNoPoint
///   void add_point(const LatticePoint&, uint32_t point);            encoders
/// Decoded values stay within the arrays that they index, for any bytes; fault() reports invalid data.
///
/// Points are the distinct vertex positions of a page, in order of first use. The border of the triangles coded so far
/// is stored as up to two outgoing and two incoming edges per point. A triangle that continues the surface closes a
/// border edge, so the end point of that edge predicts its third corner, both within and across clusters.
template <class Coder>
class PageModel {
public:
  explicit PageModel(Coder& coder) : coder_(coder) {}

  /// Call before the first cluster of each page.
  void begin() {
    points_.clear();
    cluster_ = 0;
    last_ = {};
    normals_.begin();
    fault_ = false;
  }

  /// Codes one cluster.
  /// @param values input of encoders, output of decoders
  void code_cluster(const baked::GeometryRecord& geometry, ClusterValues& values) {
    ++cluster_;
    values_ = &values;
    encoding_ = static_cast<NormalEncoding>(geometry.normal_encoding);
    reserve();
    code_header();
    code_triangles();
    if (values.has_normals && !fault_) code_normals();
    if (values.has_uvs && !fault_) code_uvs();
    last_.material = values.material;
    last_.has_normals = values.has_normals, last_.has_uvs = values.has_uvs;
  }

  bool fault() const { return fault_; }

private:
  static constexpr bool kDecodes = Coder::kDecodes;
  static constexpr uint32_t kNone = ~0u;
  static constexpr uint16_t kNoVertex = 0xffff;
  static constexpr uint32_t kMaxExtent = 19;
  static constexpr uint32_t kExplicitWidth = 15; ///< magnitudes of this many bits and more store their width explicitly

  /// Border edges at a point, newest first. Two surfaces that touch in a point have one each; kNone marks unused
  /// entries.
  using Ends = std::array<uint32_t, 2>;
  static constexpr Ends kNoEnds = {kNone, kNone};

  struct Point {
    LatticePoint position;
    Ends next = kNoEnds;                 ///< end points of border edges that begin here, newest first
    Ends previous = kNoEnds;             ///< start points of border edges that end here, newest first
    Ends apex = kNoEnds;                 ///< third corners of the triangles at the edges to `next`
    uint32_t cluster = 0;                ///< last cluster with a vertex here
    uint16_t vertex = 0;                 ///< newest vertex of that cluster here
    uint16_t normal_count = 0;           ///< 0..2
    std::array<NormalFields, 2> normals; ///< the last two different normals, newest first
    Vec3 unit_normal{0.0f};              ///< the newest, decoded
  };
  /// A vertex of the current cluster.
  struct Vertex {
    uint32_t point;
    std::array<uint16_t, 2> neighbours; ///< earlier corners of the triangle that first uses it, or kNoVertex
    uint32_t opposite;                  ///< point across their edge, or kNone
    uint32_t triangle_count;            ///< triangles of the cluster that use it
    DVec3 face_sum;                     ///< sum of their cross products, in lattice steps
    Vec3 unit_normal;                   ///< decoded
  };
  /// A triangle corner: a point, and the cluster's vertex at that point.
  struct Corner {
    uint32_t point = 0;
    uint16_t vertex = 0;
  };

  void reserve() {
    if (points_.capacity() < points_.size() + kMaxClusterVertices)
      points_.reserve(2 * points_.capacity() + kMaxClusterVertices);
  }

  uint32_t flag(uint32_t context, bool value) { return coder_.symbol(context, value ? 1 : 0) & 1u; }

  /// Codes any 64-bit value; small values take few bits. A symbol holds the bit width, raw bits hold everything below
  /// the leading one.
  uint64_t magnitude(uint32_t context, uint64_t value) {
    const auto bits = static_cast<uint32_t>(std::bit_width(value));
    const uint32_t width = coder_.symbol(context, std::min(bits, kExplicitWidth));
    if (width == kExplicitWidth) return wide_magnitude(context, value, bits);
    // Without a branch on the width, which is unpredictable.
    const uint64_t first = (uint64_t{1} << width) >> 1;
    return first | coder_.raw(context, value - (kDecodes ? 0 : first), width - (width != 0 ? 1 : 0));
  }

  uint64_t wide_magnitude(uint32_t context, uint64_t value, uint32_t bits) {
    const auto width = kExplicitWidth + static_cast<uint32_t>(coder_.raw(context, bits - kExplicitWidth, 6));
    if (width > 64) {
      fault_ = true;
      return 0;
    }
    const uint32_t low = std::min(width - 1, 32u), high = width - 1 - low;
    const uint64_t top = coder_.raw(context, (value >> low) & ((uint64_t{1} << high) - 1), high);
    return ((uint64_t{1} << high | top) << low) | coder_.raw(context, value & ((uint64_t{1} << low) - 1), low);
  }

  int64_t difference(uint32_t context, int64_t value) {
    const auto shifted = static_cast<uint64_t>(value) << 1;
    const uint64_t zigzag = magnitude(context, value < 0 ? ~shifted : shifted);
    return static_cast<int64_t>((zigzag >> 1) ^ (0 - (zigzag & 1u)));
  }

  void code_header() {
    ClusterValues& c = *values_;
    if (flag(context::kSameMaterial, c.material == last_.material) != 0)
      c.material = last_.material;
    else
      c.material = static_cast<uint32_t>(coder_.raw(context::kSameMaterial, c.material, 32));
    c.has_normals = flag(context::kHasNormals + (last_.has_normals ? 1 : 0), c.has_normals) != 0;
    c.has_uvs = flag(context::kHasUvs + (last_.has_uvs ? 1 : 0), c.has_uvs) != 0;
    if (flag(context::kFull, c.triangle_count == kMaxClusterTriangles) != 0)
      c.triangle_count = kMaxClusterTriangles;
    else
      c.triangle_count = 1 + static_cast<uint32_t>(coder_.raw(context::kFull, c.triangle_count - 1, 7));
    if (c.has_normals) {
      c.normal_chart = coder_.symbol(context::kNormalChart, c.normal_chart);
      c.normal_palette = flag(context::kNormalPalette, c.normal_palette) != 0;
    }
  }

  void code_triangles() {
    ClusterValues& c = *values_;
    const uint32_t triangle_count = c.triangle_count;
    vertex_count_ = 0, corner_count_ = 0;
    uint32_t restarts = 0;
    std::array<Corner, 3> t{};
    uint32_t turns = 8; // the last two turns as base-3 digits; 2 is a restart
    for (uint32_t i = 0; i < triangle_count && !fault_; ++i) {
      Turn turn = Turn::kRestart;
      if (i > 0) {
        const uint32_t open_right = has(points_[t[1].point].next, t[2].point),
                       open_left = has(points_[t[2].point].next, t[0].point);
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
      close_edges(t);
    }
    c.vertex_count = vertex_count_;
    c.corner_count = corner_count_;
    c.strip_count = restarts;
  }

  static uint64_t wrap(int64_t value) { return static_cast<uint64_t>(value); }

  /// Bit width of the span of three coordinates.
  static uint32_t extent(int64_t a, int64_t b, int64_t c) {
    const int64_t lo = std::min({a, b, c}), hi = std::max({a, b, c});
    return static_cast<uint32_t>(std::bit_width(wrap(hi) - wrap(lo)));
  }

  static bool has(const Ends& ends, uint32_t point) { return (ends[0] == point) | (ends[1] == point); }
  /// Adds an edge and drops the older of two.
  static void push(Ends& ends, uint32_t point) { ends = {point, ends[0]}; }
  static void erase(Ends& ends, size_t at) { ends = {at == 0 ? ends[1] : ends[0], kNone}; }
  /// Newest entry that differs from `other_than`.
  static uint32_t pick(const Ends& ends, uint32_t other_than) { return ends[0] != other_than ? ends[0] : ends[1]; }

  void guess_third(const std::array<Corner, 3>& t, uint32_t opposite) {
    guess_ = {pick(points_[t[1].point].previous, opposite), pick(points_[t[0].point].next, opposite)};
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
    const Point& p = points_[t[0].point];
    guess_ = {p.previous[0], p.next[0]};
    basis_ = {t[0].point, kNone, kNone};
    t[1] = code_corner(context::kNaming + 12, context::kSecondCorner, {t[0].vertex, kNoVertex});
    const Point& b = points_[t[1].point];
    // Third corner of the triangle on the other side of the first two corners, if there is one.
    const uint32_t apex = has(b.next, t[0].point) ? b.apex[b.next[0] == t[0].point ? 0 : 1] : kNone;
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

  Corner code_corner(uint32_t names, uint32_t kind, std::array<uint16_t, 2> neighbours) {
    ClusterValues& c = *values_;
    uint32_t naming = kNewPoint, point = kNone;
    uint16_t vertex = 0;
    bool fresh = true;
    if constexpr (!kDecodes) {
      vertex = c.corners[corner_count_];
      fresh = vertex == vertex_count_;
      point = fresh ? coder_.find_point(c.positions[vertex]) : vertices_[vertex].point;
      if (point != kNone)
        naming = point == guess_[0]                   ? kGuess0
                 : point == guess_[1]                 ? kGuess1
                 : points_[point].cluster != cluster_ ? kOfPage
                 : fresh                              ? kCreaseOfCluster
                                                      : kOfCluster;
    }
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

  void close_edges(const std::array<Corner, 3>& t) {
    for (uint32_t i = 0; i < 3; ++i) {
      const uint32_t from = t[i].point, to = t[(i + 1) % 3].point;
      Point &a = points_[from], &b = points_[to];
      if (has(a.previous, to) && has(b.next, from)) {
        const size_t out = b.next[0] == from ? 0 : 1;
        erase(a.previous, a.previous[0] == to ? 0 : 1), erase(b.next, out), erase(b.apex, out);
      } else {
        push(a.next, to), push(a.apex, t[(i + 2) % 3].point), push(b.previous, from);
      }
    }
  }

  void code_normals() {
    ClusterValues& c = *values_;
    sum_face_normals();
    uint32_t last = 0;
    for (uint32_t v = 0; v < vertex_count_; ++v) {
      Point& point = points_[vertices_[v].point];
      std::array<const NormalFields*, 4> candidates{};
      uint32_t count = 0, known = 0;
      const auto offer = [&](const NormalFields& fields) {
        for (uint32_t i = 0; i < count; ++i)
          if (*candidates[i] == fields) return;
        candidates[count++] = &fields;
      };
      for (uint32_t i = 0; i < point.normal_count; ++i) offer(point.normals[i]);
      known = count;
      for (const uint16_t n : vertices_[v].neighbours)
        if (n != kNoVertex) offer(c.normals[n]);
      NormalFields fields = c.normals[v];
      uint32_t choice = count;
      if constexpr (!kDecodes) {
        for (choice = 0; choice < count && !(*candidates[choice] == fields);) ++choice;
        choice = choice == count ? 0 : choice + 1;
      }
      choice = coder_.symbol(context::kNormalChoice + (last * 3 + known) * 3 + count - known, choice);
      last = std::min(choice > known ? 2u : choice, 2u);
      if (choice > count) {
        fault_ = true;
        return;
      }
      c.normals[v] =
          choice > 0 ? *candidates[choice - 1] : code_normal(fields, normals_.predict(encoding_, surroundings(v)));
      vertices_[v].unit_normal = decode_normal(encoding_, c.normals[v]);
      if (choice == 0) normals_.learn(DVec3(vertices_[v].unit_normal));
      if (choice == 0 || choice > known || choice == 2) {
        point.normals[1] = point.normals[0];
        point.normals[0] = c.normals[v];
        point.unit_normal = vertices_[v].unit_normal;
        point.normal_count = static_cast<uint16_t>(std::min(point.normal_count + 1, 2));
      }
    }
  }

  NormalFields code_normal(NormalFields fields, NormalFields predicted) {
    const NormalFormat& format = format_of(encoding_);
    uint32_t chart = predicted.chart;
    NormalFields flat{};
    if constexpr (!kDecodes) {
      const auto unfolded = unfold_normal(encoding_, fields, chart);
      flat = unfolded ? *unfolded : fields;
    }
    if (format.charts > 1 && flag(context::kNormalSeam, flat.chart != chart) != 0)
      chart = std::min(static_cast<uint32_t>(coder_.raw(context::kNormalSeam, flat.chart, 3)), format.charts - 1);
    const int64_t dx = difference(context::kNormalX + normals_.expected_error(), flat.x - predicted.x);
    const auto width = static_cast<uint32_t>(std::bit_width(wrap(dx < 0 ? ~dx : dx)));
    const int64_t dy = difference(context::kNormalY + std::min(width, 15u), flat.y - predicted.y);
    const auto limit = [](int64_t value) {
      return static_cast<int32_t>(std::clamp<int64_t>(value, -(1 << 28), 1 << 28));
    };
    return fold_normal(encoding_, {chart, limit(predicted.x + limit(dx)), limit(predicted.y + limit(dy))});
  }

  /// Vector between two points; a difference of more than 63 bits wraps.
  static DVec3 steps_between(const LatticePoint& from, const LatticePoint& to) {
    DVec3 steps;
    for (size_t axis = 0; axis < 3; ++axis)
      steps[static_cast<int>(axis)] = static_cast<double>(static_cast<int64_t>(wrap(to[axis]) - wrap(from[axis])));
    return steps;
  }

  NormalSurroundings surroundings(uint32_t v) const {
    const Vertex& vertex = vertices_[v];
    NormalSurroundings s{.face_sum = vertex.face_sum, .triangle_count = vertex.triangle_count};
    for (const uint16_t n : vertex.neighbours) {
      if (n == kNoVertex) break;
      s.neighbours[s.neighbour_count] = DVec3(vertices_[n].unit_normal);
      s.edges[s.neighbour_count++] = steps_between(values_->positions[n], values_->positions[v]);
    }
    if (s.neighbour_count == 2 && vertex.opposite != kNone && points_[vertex.opposite].normal_count > 0) {
      s.has_opposite = true;
      s.opposite = DVec3(points_[vertex.opposite].unit_normal);
    }
    return s;
  }

  /// Sums the cross products of the cluster's triangles at their vertices.
  void sum_face_normals() {
    const auto& positions = values_->positions;
    for (uint32_t i = 0; i < values_->triangle_count; ++i) {
      const auto& [a, b, c] = corners_of_[i];
      const DVec3 normal =
          glm::cross(steps_between(positions[a], positions[b]), steps_between(positions[a], positions[c]));
      for (const uint16_t corner : corners_of_[i]) {
        vertices_[corner].face_sum += normal;
        ++vertices_[corner].triangle_count;
      }
    }
  }

  void code_uvs() {
    ClusterValues& c = *values_;
    UvLattice last{};
    for (uint32_t v = 0; v < vertex_count_; ++v) {
      const uint16_t near = vertices_[v].neighbours[0];
      const UvLattice from = near != kNoVertex ? c.uvs[near] : last;
      for (size_t axis = 0; axis < 2; ++axis) {
        const int64_t delta =
            difference(context::kUv + static_cast<uint32_t>(axis), int64_t{c.uvs[v][axis]} - from[axis]);
        c.uvs[v][axis] = static_cast<int32_t>(static_cast<uint32_t>(static_cast<uint64_t>(from[axis]) + wrap(delta)));
      }
      last = c.uvs[v];
    }
  }

  Coder& coder_;
  ClusterValues* values_ = nullptr;
  NormalEncoding encoding_{};
  std::vector<Point> points_;
  uint32_t cluster_ = 0;
  bool fault_ = false;
  struct {
    uint32_t material = 0;
    bool has_normals = false, has_uvs = false;
  } last_;
  uint32_t vertex_count_ = 0, corner_count_ = 0;
  std::array<Vertex, kMaxClusterVertices> vertices_;
  std::array<std::array<uint16_t, 3>, kMaxClusterTriangles> corners_of_;
  NormalPredictor normals_;
  std::array<uint32_t, 2> guess_{};
  uint32_t history_ = 0;             // bits: whether the last two corners were new points
  std::array<uint32_t, 3> basis_{};  // points that the next new point is predicted from
  std::array<uint32_t, 3> extent_{}; // per axis: bit width of the span of the last three basis points
};

} // namespace packtrace
