#include "runtime/ao/moved_occluders.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include "runtime/ao/visibility_curve.h"

namespace packtrace {
namespace {

/// History keeps kKept b^-3/2 frames of an estimated change b. For one change, n = v / (k b^2) frames minimise the
/// error, with the variance v of a frame's sample and the factor k by which the filter reduces it; for equal changes in
/// every frame, n^3 = v / (2 k b^2). The exponent lies between these. Exponent and factor were chosen so that a town
/// with 500 moving instances loses 0.2 dB, and a box that leaves a floor 0.01 (docs/denoiser.md).
constexpr float kKept = 0.01f;
/// Estimated change, relative to the form factor, where a box moves by half its diagonal or more and keeps its form
/// factor: it covers other directions than before.
constexpr float kSwept = 0.5f;

/// Boxes that may change less than this are left out: they would leave 40 frames.
constexpr float kMinChange = 4e-3f;

/// Sides of blocks of pixels: boxes are selected for tiles, and then for subtiles. Pixels of a cell that show the same
/// instance share a limit, since estimates from boxes are coarse.
constexpr uint32_t kTile = 64, kSubtile = 8, kCell = 4;
constexpr float kNoLimit = std::numeric_limits<float>::max();
constexpr float kPi = std::numbers::pi_v<float>;

/// A box as it is seen from points.
struct Occluder {
  Vec3 centre, half, areas; ///< areas of the faces across each axis

  explicit Occluder(const Bounds& box)
      : centre(box.centre()), half(box.extent() * 0.5),
        areas(4.0f * Vec3(half.y * half.z, half.z * half.x, half.x * half.y)) {}
};

struct MovedOccluder {
  Occluder before, after;
  float moved;
  uint32_t instance;
};

class HistoryLimiter {
public:
  HistoryLimiter(std::span<const MovedBox> boxes, const GBuffer& g, const AoConfig& config, float radius,
                 std::vector<float>& limits)
      : g_(g), curve_(config), radius_(radius), reach_(radius * curve_.end()), limits_(limits) {
    for (const MovedBox& box : boxes)
      if (!box.before.empty() && !box.after.empty())
        occluders_.push_back({Occluder(box.before), Occluder(box.after), box.moved, box.instance});
  }

  /// Writes the limits of the tile at (x0, y0).
  void limit_tile(uint32_t x0, uint32_t y0) const {
    const uint32_t x1 = std::min(x0 + kTile, g_.size.width), y1 = std::min(y0 + kTile, g_.size.height);
    std::vector<const MovedOccluder*> all, near, nearer;
    for (const MovedOccluder& occluder : occluders_) all.push_back(&occluder);
    select(bounds_of_points(x0, y0, x1, y1), all, near);
    if (near.empty()) return;
    for (uint32_t y = y0; y < y1; y += kSubtile)
      for (uint32_t x = x0; x < x1; x += kSubtile) {
        const uint32_t xe = std::min(x + kSubtile, x1), ye = std::min(y + kSubtile, y1);
        select(bounds_of_points(x, y, xe, ye), near, nearer);
        if (nearer.empty()) continue;
        for (uint32_t cy = y; cy < ye; cy += kCell)
          for (uint32_t cx = x; cx < xe; cx += kCell)
            limit_cell(cx, cy, std::min(cx + kCell, xe), std::min(cy + kCell, ye), nearer);
      }
  }

private:
  struct Points {
    Vec3 lo{std::numeric_limits<float>::max()}, hi{std::numeric_limits<float>::lowest()};
  };

  Points bounds_of_points(uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1) const {
    Points points;
    for (uint32_t y = y0; y < y1; ++y)
      for (size_t i = size_t{y} * g_.size.width + x0; i < size_t{y} * g_.size.width + x1; ++i)
        if (g_.instance[i] != kNoInstance)
          points.lo = glm::min(points.lo, g_.position[i]), points.hi = glm::max(points.hi, g_.position[i]);
    return points;
  }

  /// Largest form factor that a box may have at points.
  float bound(const Points& points, const Occluder& box) const {
    const Vec3 gap = glm::max(glm::max(box.centre - box.half - points.hi, points.lo - box.centre - box.half), Vec3(0));
    const float d2 = glm::dot(gap, gap);
    if (!(d2 < reach_ * reach_)) return 0.0f;
    const float area = glm::length(box.areas);
    return area / (area + kPi * d2) * occlusion(std::sqrt(d2));
  }

  void select(const Points& points, const std::vector<const MovedOccluder*>& from,
              std::vector<const MovedOccluder*>& chosen) const {
    chosen.clear();
    for (const MovedOccluder* occluder : from)
      if (std::max(bound(points, occluder->before), bound(points, occluder->after)) *
              std::min(1.0f, 4.0f * occluder->moved) >
          kMinChange)
        chosen.push_back(occluder);
  }

  float occlusion(float distance) const { return 1.0f - curve_.visibility(distance / radius_, 0.0f); }

  float form_factor(Vec3 point, Vec3 normal, const Occluder& box) const {
    const Vec3 line = box.centre - point;
    const float top = glm::dot(normal, line), extent = glm::dot(glm::abs(normal), box.half);
    if (!(top + extent > 0.0f)) return 0.0f;
    const Vec3 gap = glm::sign(line) * glm::max(glm::abs(line) - box.half, Vec3(0));
    const float d2 = glm::dot(gap, gap);
    if (d2 >= reach_ * reach_) return 0.0f;
    const float d = std::sqrt(d2);
    const float height = top >= extent ? top : (top + extent) * (top + extent) / (4.0f * extent);
    const float length = glm::length(line);
    float cosine = height < length ? height / length : 1.0f;
    float share = 1.0f;
    if (d > 0.0f) {
      const Vec3 towards = gap / d;
      const float area = glm::dot(glm::abs(towards), box.areas);
      share = area / (area + kPi * d2);
      cosine = larger(cosine, glm::dot(normal, towards));
    }
    return occlusion(d) * cosine * share;
  }

  void limit_cell(uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1,
                  const std::vector<const MovedOccluder*>& occluders) const {
    std::array<std::pair<uint32_t, float>, kCell * kCell> known; // instances and their limits
    size_t count = 0;
    for (uint32_t y = y0; y < y1; ++y)
      for (size_t i = size_t{y} * g_.size.width + x0; i < size_t{y} * g_.size.width + x1; ++i) {
        if (g_.instance[i] == kNoInstance) continue;
        size_t at = 0;
        while (at < count && known[at].first != g_.instance[i]) ++at;
        if (at == count) known[count++] = {g_.instance[i], limit(i, occluders)};
        limits_[i] = known[at].second;
      }
  }

  float limit(size_t i, const std::vector<const MovedOccluder*>& occluders) const {
    float squares = 0.0f;
    for (const MovedOccluder* occluder : occluders) {
      if (occluder->instance == g_.instance[i]) continue;
      const float before = form_factor(g_.position[i], g_.normal[i], occluder->before);
      const float after = form_factor(g_.position[i], g_.normal[i], occluder->after);
      const float change = std::abs(after - before) + kSwept * occluder->moved * larger(before, after);
      squares += change * change;
    }
    return squares > 0.0f ? kKept / std::sqrt(squares * std::sqrt(squares)) : kNoLimit;
  }

  const GBuffer& g_;
  const VisibilityCurve curve_;
  const float radius_, reach_;
  std::vector<MovedOccluder> occluders_;
  std::vector<float>& limits_;
};

} // namespace

MovedBox moved_box(uint32_t instance, const Bounds& object_before, const DAffine& world_before,
                   const Bounds& object_after, const DAffine& world_after) {
  MovedBox box{instance, transform_bounds(world_before, object_before), transform_bounds(world_after, object_after),
               0.0f};
  if (box.before.empty() || box.after.empty()) return box;
  double farthest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    DVec3 a = object_before.lo, b = object_after.lo;
    for (int axis = 0; axis < 3; ++axis)
      if ((corner >> axis & 1) != 0) a[axis] = object_before.hi[axis], b[axis] = object_after.hi[axis];
    farthest = std::max(farthest, glm::length(transform_point(world_after, b) - transform_point(world_before, a)));
  }
  const double size = 0.5 * std::max(box.before.diagonal(), box.after.diagonal());
  box.moved = farthest < size ? static_cast<float>(farthest / size) : 1.0f;
  return box;
}

std::vector<float> history_limits(std::span<const MovedBox> boxes, const GBuffer& gbuffer, const AoConfig& config,
                                  float radius) {
  if (boxes.empty()) return {};
  std::vector<float> limits(gbuffer.size.pixels(), kNoLimit);
  const HistoryLimiter limiter(boxes, gbuffer, config, radius, limits);
  const uint32_t columns = (gbuffer.size.width + kTile - 1) / kTile, rows = (gbuffer.size.height + kTile - 1) / kTile;
  tbb::parallel_for(tbb::blocked_range2d<uint32_t>(0, rows, 1, 0, columns, 1),
                    [&](const tbb::blocked_range2d<uint32_t>& range) {
                      for (uint32_t y = range.rows().begin(); y < range.rows().end(); ++y)
                        for (uint32_t x = range.cols().begin(); x < range.cols().end(); ++x)
                          limiter.limit_tile(x * kTile, y * kTile);
                    });
  return limits;
}

} // namespace packtrace
