#include "compress/format/cluster/index_codec.h"

#include <algorithm>
#include <cassert>
#include <optional>

namespace packtrace {
namespace {

constexpr uint16_t kNone = 0xffff;
constexpr uint32_t kTableSize = 1024; // power of two, above twice the number of directed edges of a full cluster

/// Finds the triangle across each edge. Edge e of a triangle runs from its corner e to corner e + 1; its number is 3
/// triangle + e. An edge has at most one partner: the first unpaired edge in the opposite direction.
class EdgePartners {
public:
  explicit EdgePartners(std::span<const Triangle> triangles) {
    partner_.fill(kNone);
    table_.fill(kNone);
    for (uint32_t t = 0; t < triangles.size(); ++t)
      for (uint32_t e = 0; e < 3; ++e) {
        const auto edge = static_cast<uint16_t>(3 * t + e);
        const uint32_t from = triangles[t][static_cast<int>(e)], to = triangles[t][static_cast<int>((e + 1) % 3)];
        ends_[edge] = {from, to};
        if (from == to) continue;
        if (const uint16_t match = find_unpaired(to, from, t); match != kNone) {
          partner_[match] = edge;
          partner_[edge] = match;
        } else {
          uint32_t slot = hash(from, to);
          while (table_[slot] != kNone) slot = (slot + 1) % kTableSize;
          table_[slot] = edge;
        }
      }
  }
  uint16_t operator[](uint32_t edge) const { return partner_[edge]; }

private:
  static uint32_t hash(uint32_t from, uint32_t to) { return ((from * 0x9e3779b1u) ^ (to * 0x85ebca6bu)) >> 22; }

  uint16_t find_unpaired(uint32_t from, uint32_t to, uint32_t other_than) const {
    for (uint32_t slot = hash(from, to); table_[slot] != kNone; slot = (slot + 1) % kTableSize) {
      const uint16_t edge = table_[slot];
      if (ends_[edge][0] == from && ends_[edge][1] == to && partner_[edge] == kNone && edge / 3u != other_than)
        return edge;
    }
    return kNone;
  }

  std::array<uint16_t, kMaxClusterCorners> partner_;
  std::array<std::array<uint32_t, 2>, kMaxClusterCorners> ends_;
  std::array<uint16_t, kTableSize> table_;
};

/// Builds strips triangle by triangle.
class StripWriter {
public:
  StripWriter(size_t triangle_count, uint32_t vertex_count) : number_(vertex_count, ~0u) {
    const size_t corners = triangle_count + triangle_count / 2;
    strips_.restart.reserve(triangle_count), strips_.left.reserve(triangle_count);
    strips_.triangle_order.reserve(triangle_count);
    strips_.corners.reserve(corners), strips_.vertex_order.reserve(std::min(vertex_count, kMaxClusterVertices));
  }

  size_t triangle_count() const { return strips_.triangle_order.size(); }

  /// Adds a triangle. Call add_corner() for its new corners next: three after a restart, else one.
  void add_triangle(uint32_t triangle, bool restart, bool left) {
    strips_.triangle_order.push_back(triangle);
    strips_.restart.push_back(restart);
    strips_.left.push_back(left);
    restart_count_ += restart;
  }

  void add_corner(uint32_t vertex) {
    if (number_[vertex] == ~0u) {
      number_[vertex] = static_cast<uint32_t>(strips_.vertex_order.size());
      strips_.vertex_order.push_back(vertex);
    }
    strips_.corners.push_back(number_[vertex]);
  }

  Strips finish() {
    strips_.layout = {static_cast<uint32_t>(triangle_count()), static_cast<uint32_t>(strips_.vertex_order.size()),
                      restart_count_};
    return std::move(strips_);
  }

private:
  std::vector<uint32_t> number_; // old vertex -> new vertex, ~0 if not used yet
  uint32_t restart_count_ = 0;
  Strips strips_;
};

/// Builds strips greedily. It always moves to the triangle with the fewest unvisited neighbours, so that few triangles
/// are left isolated. It leaves a group only when all of the group's triangles are visited.
class StripWalk {
public:
  StripWalk(std::span<const Triangle> triangles, uint32_t vertex_count, std::span<const uint32_t> group_ends)
      : triangles_(triangles), partners_(triangles), strips_(triangles.size(), vertex_count) {
    for (uint32_t group = 0, t = 0; group < group_ends.size(); ++group) {
      group_begin_[group] = static_cast<uint8_t>(t);
      for (; t < group_ends[group]; ++t) group_of_[t] = static_cast<uint8_t>(group), ++left_in_group_[group];
      group_size_[group] = left_in_group_[group];
    }
    for (uint32_t t = 0; t < triangles.size(); ++t)
      for (uint32_t e = 0; e < 3; ++e) unvisited_neighbours_[t] += is_in_same_group(t, partners_[3 * t + e]);
  }

  Strips run() {
    while (strips_.triangle_count() < triangles_.size()) walk_from(pick_start());
    return strips_.finish();
  }

private:
  /// Whether an unvisited triangle is allowed next: the current group is finished, or contains it.
  bool is_allowed_next(uint32_t triangle) const { return left_in_group_[group_] == 0 || group_of_[triangle] == group_; }

  /// Returns the triangle that is allowed next and has the fewest unvisited neighbours; the first of several.
  uint32_t pick_start() const {
    const bool any = left_in_group_[group_] == 0;
    const uint32_t begin = any ? 0 : group_begin_[group_];
    const uint32_t end = any ? static_cast<uint32_t>(triangles_.size()) : begin + group_size_[group_];
    uint32_t best = ~0u, fewest = 4; // more than a triangle has
    for (uint32_t t = begin; t < end && fewest > 0; ++t)
      if (!visited_[t] && unvisited_neighbours_[t] < fewest) best = t, fewest = unvisited_neighbours_[t];
    return best;
  }

  /// Whether the triangle of `edge` belongs to the same group as `from`.
  bool is_in_same_group(uint32_t from, uint16_t edge) const {
    return edge != kNone && group_of_[edge / 3u] == group_of_[from];
  }

  /// Returns the partner of an edge if its triangle is unvisited and allowed next, else kNone.
  uint16_t across(uint32_t edge) const {
    const uint16_t partner = partners_[edge];
    return partner != kNone && !visited_[partner / 3u] && is_allowed_next(partner / 3u) ? partner : kNone;
  }

  void visit(uint32_t triangle, bool restart, bool left) {
    visited_[triangle] = true;
    for (uint32_t e = 0; e < 3; ++e)
      if (const uint16_t partner = partners_[3 * triangle + e]; is_in_same_group(triangle, partner))
        --unvisited_neighbours_[partner / 3u];
    strips_.add_triangle(triangle, restart, left);
    group_ = group_of_[triangle];
    --left_in_group_[group_];
  }

  void add_corner(uint32_t triangle, uint32_t corner) {
    strips_.add_corner(triangles_[triangle][static_cast<int>(corner % 3)]);
  }

  void walk_from(uint32_t triangle) {
    visit(triangle, true, false);
    // Choose the first corner such that the best exit is a right turn: across the edge that ends in the newest corner.
    uint32_t exit = 0;
    for (uint32_t e = 1; e < 3; ++e)
      if (better(across(3 * triangle + e), across(3 * triangle + exit))) exit = e;
    uint32_t newest = (exit + 1) % 3;
    for (uint32_t i = 1; i <= 3; ++i) add_corner(triangle, newest + i);
    for (;;) {
      const uint16_t right = across(3 * triangle + (newest + 2) % 3), left = across(3 * triangle + newest);
      if (right == kNone && left == kNone) return;
      const bool go_left = better(left, right);
      const uint32_t entry = go_left ? left : right;
      triangle = entry / 3;
      newest = (entry + 2) % 3; // 3 t + e + 2 = e + 2 (mod 3)
      visit(triangle, false, go_left);
      add_corner(triangle, newest);
    }
  }

  bool better(uint16_t a, uint16_t b) const {
    if (a == kNone || b == kNone) return b == kNone && a != kNone;
    return unvisited_neighbours_[a / 3u] < unvisited_neighbours_[b / 3u];
  }

  std::span<const Triangle> triangles_;
  EdgePartners partners_;
  std::array<uint8_t, kMaxClusterTriangles>
      unvisited_neighbours_{}; // by triangle: number of unvisited neighbours in its group
  std::array<bool, kMaxClusterTriangles> visited_{};
  std::array<uint8_t, kMaxClusterTriangles> group_of_{};
  std::array<uint8_t, kMaxClusterTriangles> left_in_group_{};          // by group: number of unvisited triangles
  std::array<uint8_t, kMaxClusterTriangles> group_begin_, group_size_; // by group: range of its triangles
  uint32_t group_ = 0; // group of the last triangle; initially the first group
  StripWriter strips_;
};

/// Returns the third corner of a triangle, if the triangle has the edge from `from` to `to`.
std::optional<uint32_t> third_corner(const Triangle& t, uint32_t from, uint32_t to) {
  for (int e = 0; e < 3; ++e)
    if (t[e] == from && t[(e + 1) % 3] == to) return t[(e + 2) % 3];
  return std::nullopt;
}

} // namespace

Strips strips_in_order(std::span<const Triangle> triangles, uint32_t vertex_count) {
  assert(!triangles.empty() && triangles.size() <= kMaxClusterTriangles);
  StripWriter strips(triangles.size(), vertex_count);
  std::array<uint32_t, 3> last{}; // corners of the last triangle, newest last
  for (uint32_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    const std::optional<uint32_t> right = i == 0 ? std::nullopt : third_corner(t, last[2], last[1]);
    const std::optional<uint32_t> left = i == 0 ? std::nullopt : third_corner(t, last[0], last[2]);
    strips.add_triangle(i, !right && !left, !right && left);
    if (right || left) {
      last = right ? std::array{last[2], last[1], *right} : std::array{last[0], last[2], *left};
      strips.add_corner(last[2]);
      continue;
    }
    last = {t.x, t.y, t.z};
    // Rotate the corners so that the next triangle, if it is a neighbour, follows by a right turn.
    if (i + 1 < triangles.size())
      for (uint32_t k = 0; k < 3 && !third_corner(triangles[i + 1], last[2], last[1]); ++k)
        last = {last[1], last[2], last[0]};
    for (const uint32_t vertex : last) strips.add_corner(vertex);
  }
  return strips.finish();
}

Strips find_strips(std::span<const Triangle> triangles, uint32_t vertex_count, std::span<const uint32_t> group_ends) {
  assert(!triangles.empty() && triangles.size() <= kMaxClusterTriangles);
  const auto all = static_cast<uint32_t>(triangles.size());
  assert(group_ends.empty() || group_ends.back() == all);
  return StripWalk(triangles, vertex_count, group_ends.empty() ? std::span(&all, 1) : group_ends).run();
}

} // namespace packtrace
