#include "compress/bake/proxies/occluding_triangles.h"

#include <algorithm>
#include <cmath>

namespace packtrace {
namespace {

const baked::MaterialRecord& material_at(const BakedFile& file, uint32_t run, uint32_t slot) {
  return file.sections().materials[file.sections().material_slots[run + slot]];
}

/// A corner of a clipped triangle.
struct Corner {
  DVec3 p;
  glm::dvec2 uv;
};

/// Keeps the part of a polygon where sign (p[axis] - at) >= 0.
void clip(std::vector<Corner>& polygon, int axis, double at, double sign) {
  std::vector<Corner> kept;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Corner &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double da = sign * (a.p[axis] - at), db = sign * (b.p[axis] - at);
    if (da >= 0.0) kept.push_back(a);
    if ((da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0)) {
      const double s = da / (da - db);
      kept.push_back({glm::mix(a.p, b.p, s), glm::mix(a.uv, b.uv, s)});
    }
  }
  polygon = std::move(kept);
}

/// Whether a mask is opaque somewhere on a convex polygon: at its corners and middle, and at points of a triangle fan
/// about as dense as texels, at most 32 along an edge.
bool opaque_on(const std::vector<Corner>& polygon, const AlphaMaskView& mask) {
  glm::dvec2 middle(0.0), lo(1e300), hi(-1e300);
  for (const Corner& corner : polygon) {
    middle += corner.uv / static_cast<double>(polygon.size());
    lo = glm::min(lo, corner.uv), hi = glm::max(hi, corner.uv);
  }
  const glm::dvec2 texels = glm::abs((hi - lo) * glm::dvec2(mask.uv_scale)) * glm::dvec2(mask.width, mask.height);
  const double wanted = std::max(texels.x, texels.y);
  const int steps = wanted < 32.0 ? std::max(1, static_cast<int>(std::ceil(wanted))) : 32;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec2 a = polygon[i].uv - middle, b = polygon[(i + 1) % polygon.size()].uv - middle;
    for (int u = 0; u <= steps; ++u)
      for (int v = 0; u + v <= steps; ++v)
        if (mask.opaque(
                Vec2(middle + (a * static_cast<double>(u) + b * static_cast<double>(v)) / static_cast<double>(steps))))
          return true;
  }
  return false;
}

/// Every undirected edge, as a pair of points, occurs an even number of times.
bool all_edges_even(const std::vector<OccludingTriangle>& triangles) {
  std::vector<std::array<LatticePoint, 2>> edges;
  edges.reserve(3 * triangles.size());
  for (const OccludingTriangle& t : triangles)
    for (size_t i = 0; i < 3; ++i) {
      const auto [a, b] = std::minmax(t.corners[i], t.corners[(i + 1) % 3]);
      if (a != b) edges.push_back({a, b});
    }
  std::sort(edges.begin(), edges.end());
  for (size_t i = 0; i < edges.size();) {
    size_t end = i;
    while (end < edges.size() && edges[end] == edges[i]) ++end;
    if ((end - i) % 2 != 0) return false;
    i = end;
  }
  return true;
}

} // namespace

OccludingTriangles occluding_triangles(const BakedFile& file, uint32_t geometry, std::span<const uint32_t> runs) {
  OccludingTriangles result;
  const baked::GeometryRecord& record = file.geometries()[geometry];
  result.step = PositionGrid{record.step_mantissa, record.step_exponent}.step();
  for (uint32_t c = 0; c < record.cluster_count; ++c) {
    const ClusterView cluster = file.cluster(geometry, c);
    const uint32_t slot = cluster.material_slot();
    const bool occluding =
        std::ranges::any_of(runs, [&](uint32_t run) { return occludes(material_at(file, run, slot).flags); });
    if (!occluding) continue;
    const bool masked = cluster.has_uvs() && std::ranges::all_of(runs, [&](uint32_t run) {
                          return needs_mask(material_at(file, run, slot).flags);
                        });
    for (uint32_t t = 0; t < cluster.triangle_count(); ++t) {
      const Triangle corners = cluster.triangle(t);
      OccludingTriangle& triangle = result.triangles.emplace_back();
      triangle.slot = slot, triangle.masked = masked;
      for (size_t i = 0; i < 3; ++i) {
        const auto vertex = corners[static_cast<glm::length_t>(i)];
        triangle.corners[i] = cluster.lattice(vertex);
        if (masked) triangle.uvs[i] = cluster.uv(vertex);
      }
    }
  }
  if (result.triangles.empty()) return result;
  LatticePoint high = result.low = result.triangles.front().corners[0];
  for (const OccludingTriangle& t : result.triangles)
    for (const LatticePoint& p : t.corners)
      for (size_t a = 0; a < 3; ++a) result.low[a] = std::min(result.low[a], p[a]), high[a] = std::max(high[a], p[a]);
  for (size_t a = 0; a < 3; ++a) result.extent[a] = high[a] - result.low[a];
  for (OccludingTriangle& t : result.triangles)
    for (LatticePoint& p : t.corners)
      for (size_t a = 0; a < 3; ++a) p[a] -= result.low[a];
  result.closed =
      std::ranges::none_of(result.triangles, &OccludingTriangle::masked) && all_edges_even(result.triangles);
  return result;
}

bool opaque_within(const BakedFile& file, std::span<const uint32_t> runs, const OccludingTriangle& triangle, DVec3 lo,
                   double edge) {
  std::vector<Corner> polygon;
  for (size_t i = 0; i < 3; ++i) {
    const LatticePoint& p = triangle.corners[i];
    polygon.push_back({DVec3(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])),
                       glm::dvec2(triangle.uvs[i])});
  }
  for (int axis = 0; axis < 3; ++axis) {
    clip(polygon, axis, lo[axis], 1.0);
    clip(polygon, axis, lo[axis] + edge, -1.0);
  }
  if (polygon.empty()) return true; // touched in a point that rounding loses
  return std::ranges::any_of(runs, [&](uint32_t run) {
    const baked::MaterialRecord& m = material_at(file, run, triangle.slot);
    if (!occludes(m.flags)) return false;
    const bool all_rays = (m.flags & kAlphaMask) == 0 || opaque_on(polygon, file.mask(m.alpha_mask));
    return all_rays && ((m.flags & kShadowAlphaMask) == 0 || opaque_on(polygon, file.mask(m.shadow_alpha_mask)));
  });
}

} // namespace packtrace
