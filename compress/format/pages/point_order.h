#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "compress/format/cluster/index_codec.h"
#include "compress/format/pages/page_border.h"

namespace packtrace {

/// The order in which the new points of a cluster are coded: next comes the point that is enclosed best by points that
/// are known already, because it can be predicted best.
/// Source of the idea: Cohen-Or, Cohen and Irony, "Multi-way geometry encoding" (2002).
class PointOrder {
public:
  /// What is known around a corner of a new point.
  struct Corner {
    uint32_t corner; ///< of the page's triangles
    bool both;       ///< the two other points of its triangle
    bool across;     ///< these and the point across their edge
  };

  /// @param points number of the page's points; those from first_point on are new, and only triangles from first_corner
  /// on use them
  void begin(const PageTriangles& triangles, uint32_t points, uint32_t first_point, uint32_t first_corner) {
    first_corner_ = first_corner, first_point_ = first_point, count_ = points - first_point;
    const uint32_t corners = triangles.count() - first_corner;
    const uint32_t *corner_points = triangles.points.data() + first_corner,
                   *across = triangles.across.data() + first_corner;
    ends_.fill(0);
    for (uint32_t c = 0; c < corners; ++c) {
      const uint32_t point = corner_points[c];
      points_[c] = static_cast<uint16_t>(point < first_point ? kOld : point - first_point);
      ++ends_[points_[c]];
      across_[c] = static_cast<uint16_t>(across[c] - first_corner < corners ? across[c] - first_corner : kNoCorner);
    }
    uint16_t sum = 0;
    for (uint32_t i = 0; i < count_; ++i) {
      begins_[i] = sum;
      sum = static_cast<uint16_t>(sum + ends_[i]);
      ends_[i] = begins_[i];
      keys_[i] = static_cast<int32_t>(kMaxClusterVertices - i);
    }
    ends_[kOld] = sum, keys_[kOld] = 0;
    for (uint32_t c = 0; c < corners; ++c) {
      const bool old_across =
          across_[c] != kNoCorner ? points_[across_[c]] == kOld : across[c] != kNoPageCorner; // or of an older cluster
      const uint32_t old = (points_[next_of(c)] == kOld ? 1u : 0u) + (points_[previous_of(c)] == kOld ? 1u : 0u);
      states_[c] = static_cast<uint8_t>(old + (old_across ? kAcross : 0));
      keys_[points_[c]] += kShares[states_[c]];
      corners_[ends_[points_[c]]++] = static_cast<uint16_t>(c);
    }
  }

  uint32_t count() const { return count_; }

  /// Returns the point to code next: of those of the highest rank that are not known, the first.
  uint32_t next() const {
    int32_t best = 0;
    for (uint32_t i = 0; i < count_; ++i) best = std::max(best, keys_[i]);
    // The remainder is kMaxClusterVertices - 1 - i.
    return first_point_ + kMaxClusterVertices - 1 - (static_cast<uint32_t>(best) - 1) % kMaxClusterVertices;
  }

  /// Whether a point is not new, or has become known.
  bool known(uint32_t point) const { return point < first_point_ || keys_[point - first_point_] < 0; }

  /// Number of corners at a new point.
  uint32_t corner_count(uint32_t point) const {
    return uint32_t{ends_[point - first_point_]} - begins_[point - first_point_];
  }

  /// Returns corner i at a new point; they are in order.
  Corner corner(uint32_t point, uint32_t i) const {
    const uint32_t c = corners_[begins_[point - first_point_] + i];
    return {first_corner_ + c, (states_[c] & kBoth) != 0, states_[c] == (kBoth | kAcross)};
  }

  /// Call when a new point has become known.
  void learn(uint32_t point) {
    const uint32_t i = point - first_point_;
    keys_[i] = kKnown;
    for (uint32_t at = begins_[i]; at < ends_[i]; ++at) {
      const uint32_t c = corners_[at];
      advance(next_of(c), 1), advance(previous_of(c), 1);
      if (across_[c] != kNoCorner) advance(across_[c], kAcross);
    }
  }

private:
  static constexpr uint32_t kMaxCorners = 3 * kMaxClusterTriangles;
  static constexpr uint16_t kOld = kMaxClusterVertices, kNoCorner = 0xffff; // points and corners of other clusters
  static constexpr int32_t kKnown = -(1 << 30);                             // stays negative, whatever its corners add

  // State of a corner: how many of the two other points are known, and whether the point across their edge is.
  static constexpr uint32_t kBoth = 2, kAcross = 4;
  /// Shares of a point's key by the state of each of its corners.
  static constexpr std::array<int32_t, 8> kShares = [] {
    constexpr int32_t kRank = kMaxClusterVertices;
    return std::array<int32_t, 8>{0, kRank, 16 * kRank, 0, 0, kRank, 256 * kRank, 0};
  }();

  static uint32_t next_of(uint32_t c) { return c + kSteps[c % 3]; }
  static uint32_t previous_of(uint32_t c) { return c + kSteps[3 + c % 3]; }
  static constexpr std::array<uint32_t, 6> kSteps{1, 1, ~1u, 2, ~0u, ~0u}; // to the next and the previous corner

  void advance(uint32_t corner, uint32_t by) {
    const uint32_t before = states_[corner], now = before + by;
    keys_[points_[corner]] += kShares[now] - kShares[before];
    states_[corner] = static_cast<uint8_t>(now);
  }

  uint32_t first_corner_ = 0, first_point_ = 0, count_ = 0;
  std::array<uint16_t, kMaxClusterVertices + 1> begins_{}, ends_{}; // of a new point's corners in corners_
  /// kMaxClusterVertices x rank + kMaxClusterVertices - i for new point i, so the largest key is that of the next
  /// point.
  std::array<int32_t, kMaxClusterVertices + 1> keys_{};
  std::array<uint16_t, kMaxCorners> points_{}, across_{}; // per corner of the cluster
  std::array<uint8_t, kMaxCorners> states_{};
  std::array<uint16_t, kMaxCorners> corners_{}; // by new point
};

} // namespace packtrace
