#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// What is left of a triangle after parts of it over other triangles were taken away, as convex polygons. Parts are
/// exact, so triangles that cover a flat part leave nothing of it, however their borders cross it.
class TriangleSubtraction {
public:
  /// Has at most nine corners after all cuts; polygons that would get more are kept whole.
  struct Polygon {
    std::array<DVec3, 12> corners;
    uint32_t count = 0;
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
    next_.clear();
    for (const Polygon& polygon : rest_) {
      const size_t before = next_.size();
      const Polygon inside = split(polygon, prism);
      const double distance = prism.largest_height(inside);
      if (inside.count >= 3 && accept(distance)) {
        taken(distance);
      } else {
        next_.resize(before);
        next_.push_back(polygon);
      }
    }
    std::swap(rest_, next_);
  }

  const std::vector<Polygon>& rest() const { return rest_; }

  /// Largest distance of the polygon from a triangle.
  static double distance(const Polygon& polygon, const std::array<DVec3, 3>& triangle);

private:
  /// The planes through a triangle's sides along its normal, and its own.
  struct Prism {
    std::array<DVec3, 3> inwards;
    std::array<double, 3> limits; ///< of dot(inwards, p)
    DVec3 normal;
    double offset;
    bool set(const std::array<DVec3, 3>& triangle); ///< returns false without area
    double largest_height(const Polygon& polygon) const;
  };

  /// Returns the part inside and appends the other parts to next_.
  Polygon split(const Polygon& polygon, const Prism& prism);

  std::vector<Polygon> rest_, next_;
};

} // namespace packtrace
