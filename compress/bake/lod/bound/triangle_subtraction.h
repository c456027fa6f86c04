#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "compress/bake/lod/bound/triangle_distance.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// A triangle minus its parts over other triangles, as convex polygons. Parts are
/// exact, so triangles that cover a flat part leave nothing of it, however their borders cross it.
class TriangleSubtraction {
public:
  /// Has at most nine corners after all cuts; polygons that would get more are kept whole. Copying copies only the
  /// corners in use.
  struct Polygon {
    std::array<DVec3, 12> corners;
    uint32_t count = 0;
    Polygon() = default;
    Polygon(const Polygon& o) : count(o.count) { std::copy_n(o.corners.begin(), count, corners.begin()); }
    Polygon& operator=(const Polygon& o) {
      count = o.count;
      std::copy_n(o.corners.begin(), count, corners.begin());
      return *this;
    }
    void add(const DVec3& p) { corners[count++] = p; }
  };
  static constexpr size_t kMaxRest = 16; ///< polygons; the caller should give up beyond

  void begin(const std::array<DVec3, 3>& triangle);

  /// Takes away what projects into `other` along its normal, where accept(d) allows the largest distance d there from
  /// `other`. Calls taken(d) for each part.
  template <typename Accept, typename Taken>
  void subtract(const std::array<DVec3, 3>& other, const Accept& accept, const Taken& taken) {
    Prism prism;
    if (!prism.set(other)) return;
    const auto is_apart = [&](const Polygon& polygon) {
      return prism.is_beyond_a_side(polygon) || !accept(prism.least_height(polygon));
    };
    size_t first = 0;
    while (first < rest_.size() && is_apart(rest_[first])) ++first;
    if (first == rest_.size()) return;
    next_.assign(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(first));
    for (size_t i = first; i < rest_.size(); ++i) {
      const size_t before = next_.size();
      if (i == first || !is_apart(rest_[i])) {
        const Polygon inside = split(rest_[i], prism);
        const double distance = prism.largest_height(inside);
        if (inside.count >= 3 && accept(distance)) {
          taken(distance);
          continue;
        }
      }
      next_.resize(before);
      next_.push_back(rest_[i]);
    }
    std::swap(rest_, next_);
  }

  const std::vector<Polygon>& rest() const { return rest_; }

  /// Cuts a polygon through the middle of its longest side.
  static std::pair<Polygon, Polygon> halves(const Polygon& polygon);

  /// Returns the largest distance of the polygon from a triangle, or the first distance of a corner that accept()
  /// rejects.
  template <typename Accept>
  static double distance(const Polygon& polygon, const std::array<DVec3, 3>& triangle, const Accept& accept) {
    double largest2 = 0.0;
    for (uint32_t i = 0; i < polygon.count; ++i) {
      const DVec3 d = polygon.corners[i] - nearest_point(polygon.corners[i], triangle[0], triangle[1], triangle[2]);
      const double distance2 = glm::dot(d, d);
      if (distance2 <= largest2) continue;
      largest2 = distance2;
      if (!accept(std::sqrt(distance2))) break;
    }
    return std::sqrt(largest2);
  }

private:
  /// The planes through a triangle's sides along its normal, and its own.
  struct Prism {
    std::array<DVec3, 3> inwards;
    std::array<double, 3> limits; ///< of dot(inwards, p)
    DVec3 normal;
    double offset;
    bool set(const std::array<DVec3, 3>& triangle); ///< returns false without area
    double largest_height(const Polygon& polygon) const;
    double least_height(const Polygon& polygon) const; ///< smallest distance from the plane; 0 if the polygon meets it
    bool is_beyond_a_side(const Polygon& polygon) const; ///< whether all corners are beyond the same side
  };

  /// Returns the part inside and appends the other parts to next_.
  Polygon split(const Polygon& polygon, const Prism& prism);

  std::vector<Polygon> rest_, next_;
};

} // namespace packtrace
