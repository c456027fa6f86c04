#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

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
    copy_corners(triangles, corners);
    uint16_t sum = 0;
    for (uint32_t i = 0; i < count_; ++i) {
      begins_[i] = sum;
      sum = static_cast<uint16_t>(sum + ends_[i]);
      ends_[i] = begins_[i];
      keys_[i] = kFirstKey + static_cast<int32_t>(kMaxClusterVertices - i);
    }
    std::fill_n(keys_.begin() + count_, kKeysPerStep, 0);
    std::fill_n(keys_.begin() + kOld, kNobody + 1 - kOld, 0);
    for (uint32_t i = 0; i < 3; ++i) ends_[kOld + i] = sum;
    for (uint32_t c = 0; c < corners; c += 3) {
      const std::array<uint32_t, 3> old{is_old(c), is_old(c + 1), is_old(c + 2)};
      add_corner(c, old[1] + old[2]);
      add_corner(c + 1, old[2] + old[0]);
      add_corner(c + 2, old[0] + old[1]);
    }
  }

  uint32_t count() const { return count_; }

  /// Returns the point to code next: of those of the highest rank that are not known, the first.
  uint32_t next() const {
    // Keys are compared as floats: positive floats have the order of their bits, and SSE2 has a maximum for floats
    // only. Keys of known points are negative.
    std::array<Floats, kKeysPerStep / 4> best{}, some;
    for (uint32_t i = 0; i < count_; i += kKeysPerStep) {
      std::memcpy(&some, keys_.data() + i, sizeof some);
      for (size_t k = 0; k < best.size(); ++k) best[k] = larger(some[k], best[k]);
    }
    Floats most = larger(larger(best[0], best[1]), larger(best[2], best[3]));
    most = larger(most, __builtin_shufflevector(most, most, 2, 3, 0, 1));
    most = larger(most, __builtin_shufflevector(most, most, 1, 0, 3, 2));
    // The remainder is kMaxClusterVertices - 1 - i.
    return first_point_ + kMaxClusterVertices - 1 - (std::bit_cast<uint32_t>(most[0]) - 1) % kMaxClusterVertices;
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
      advance(kNeighbours.next[c], 1), advance(kNeighbours.previous[c], 1), advance(across_[c], kAcross);
    }
  }

private:
  using Floats [[gnu::vector_size(16)]] = float;
  static Floats larger(Floats a, Floats b) { return a > b ? a : b; }

  static constexpr uint32_t kMaxCorners = 3 * kMaxClusterTriangles, kKeysPerStep = 16;
  // Numbers of points within the cluster. Points of other clusters have kOld, kOld + 1 or kOld + 2 as first, second or
  // third corner of a triangle: one counter for all would be a chain of additions that wait for each other.
  static constexpr uint32_t kOld = kMaxClusterVertices;
  static constexpr uint32_t kNobody = kOld + 3; ///< point of kNoCorner
  // Numbers of corners that lie across an edge: one of another cluster, and none.
  static constexpr uint32_t kOldCorner = kMaxCorners, kNoCorner = kMaxCorners + 1;
  static constexpr int32_t kKnown = -(1 << 30); ///< key of a known point; stays negative, whatever its corners add
  static constexpr int32_t kFirstKey = 1 << 23; ///< keys are at least this large, so they are the bits of normal floats

  // State of a corner: how many of the two other points are known, and whether the point across their edge is.
  static constexpr uint32_t kBoth = 2, kAcross = 4;
  /// Shares of a point's key by the state of each of its corners.
  static constexpr std::array<int32_t, 8> kShares = [] {
    constexpr int32_t kRank = kMaxClusterVertices;
    return std::array<int32_t, 8>{0, kRank, 16 * kRank, 0, 0, kRank, 256 * kRank, 0};
  }();

  struct Neighbours {
    std::array<uint16_t, kMaxCorners> next, previous;
  };
  static constexpr Neighbours kNeighbours = [] {
    Neighbours neighbours{};
    for (uint32_t c = 0; c < kMaxCorners; ++c) {
      neighbours.next[c] = static_cast<uint16_t>(PageTriangles::next(c));
      neighbours.previous[c] = static_cast<uint16_t>(PageTriangles::previous(c));
    }
    return neighbours;
  }();

  /// Copies the points and the corners across of the cluster's corners, as numbers within the cluster, and counts each
  /// point's corners.
  void copy_corners(const PageTriangles& triangles, uint32_t corners) {
    const uint32_t *points = triangles.points.data() + first_corner_, *across = triangles.across.data() + first_corner_;
    ends_.fill(0);
    for (uint32_t t = 0; t < corners; t += 3)
      for (uint32_t i = 0; i < 3; ++i) {
        const uint32_t c = t + i, own = across[c] - first_corner_;
        points_[c] = static_cast<uint16_t>(std::min(points[c] - first_point_, kOld + i)); // older points wrap
        ++ends_[points_[c]];
        across_[c] = static_cast<uint16_t>(own < corners ? own : across[c] == kNoPageCorner ? kNoCorner : kOldCorner);
      }
    points_[kOldCorner] = kOld, points_[kNoCorner] = kNobody;
  }

  /// Returns 1 if a corner's point is of another cluster, else 0.
  uint32_t is_old(uint32_t c) const { return points_[c] >= kOld && points_[c] < kNobody ? 1 : 0; }

  /// @param old how many of the two other points of the corner's triangle are of other clusters
  void add_corner(uint32_t c, uint32_t old) {
    const uint32_t state = old + is_old(across_[c]) * kAcross, point = points_[c];
    states_[c] = static_cast<uint8_t>(state);
    keys_[point] += kShares[state];
    corners_[ends_[point]++] = static_cast<uint16_t>(c);
  }

  void advance(uint32_t corner, uint32_t by) {
    const uint32_t before = states_[corner], now = (before + by) % 8; // only kNoCorner reaches 8
    keys_[points_[corner]] += kShares[now] - kShares[before];
    states_[corner] = static_cast<uint8_t>(now);
  }

  uint32_t first_corner_ = 0, first_point_ = 0, count_ = 0;
  std::array<uint16_t, kNobody + 1> begins_{}, ends_{}; // of a new point's corners in corners_
  /// kMaxClusterVertices x rank + kMaxClusterVertices - i + kFirstKey for new point i, so the largest key is that of
  /// the next point.
  alignas(16) std::array<int32_t, kNobody + 1 + kKeysPerStep> keys_{};
  std::array<uint16_t, kMaxCorners + 2> points_{}, across_{}; // per corner of the cluster
  std::array<uint8_t, kMaxCorners + 2> states_{};
  std::array<uint16_t, 2 * kMaxCorners> corners_{}; // by new point, then of older points
};

} // namespace packtrace
