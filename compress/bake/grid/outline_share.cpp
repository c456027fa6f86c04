#include "compress/bake/grid/outline_share.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <tuple>
#include <vector>

#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/grid/surface_sample.h"
#include "pbrt_import/scene/angle.h"

namespace packtrace {
namespace {

constexpr uint64_t kStars = 1024; // approximate number of sampled positions
constexpr int kBucketBits = 10;

/// A triangle's edge at a sampled position.
struct StarEdge {
  uint64_t centre, end; ///< position_key()
  double length;
  uint32_t triangle; ///< number among the triangles at sampled positions
  bool outgoing;     ///< the triangle's winding runs from the centre to the end
};

class Stars {
public:
  explicit Stars(uint64_t vertices) : mask_(std::bit_ceil((vertices + kStars - 1) / kStars) - 1) {}

  void add(const Mesh& mesh, const GeometryPart& part) {
    std::vector<uint8_t> chosen(mesh.positions.size());
    const PartMap map(part);
    const auto place = [&](uint32_t v) { return map(mesh.positions[v]); };
    for (uint32_t v = 0; v < chosen.size(); ++v) chosen[v] = (position_key(place(v)) & mask_) == 0;
    for (const Triangle& t : mesh.triangles) {
      if (!(chosen[t.x] || chosen[t.y] || chosen[t.z])) continue;
      const DTriangle corners{place(t.x), place(t.y), place(t.z)};
      const DVec3 cross = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
      if (!(glm::length(cross) > 0.0)) continue;
      const auto triangle = static_cast<uint32_t>(normals_.size());
      normals_.push_back(glm::normalize(cross) * (part.flip ? -1.0 : 1.0));
      const std::array<uint64_t, 3> keys{position_key(corners[0]), position_key(corners[1]), position_key(corners[2])};
      const auto add_edge = [&](size_t centre, size_t end, bool outgoing) {
        edges_.push_back({keys[centre], keys[end], glm::distance(corners[centre], corners[end]), triangle, outgoing});
      };
      for (size_t i = 0; i < 3; ++i) {
        if (!chosen[t[static_cast<int>(i)]]) continue;
        add_edge(i, (i + 1) % 3, !part.flip);
        add_edge(i, (i + 2) % 3, part.flip);
      }
    }
  }

  double share() {
    sort();
    double outline = 0.0, all = 0.0;
    for (size_t begin = 0, end = 0; begin < edges_.size(); begin = end) {
      const StarEdge& first = edges_[begin];
      while (end < edges_.size() && edges_[end].centre == first.centre && edges_[end].end == first.end) ++end;
      double share = 1.0;
      if (end - begin > 1) {
        const StarEdge& last = edges_[end - 1]; // in the opposite direction if both triangles have the same winding
        const DVec3 &normal = normals_[first.triangle], &other = normals_[last.triangle];
        share = angle_degrees(normal, first.outgoing != last.outgoing ? other : -other) / 180.0;
      }
      outline += share * first.length;
      all += first.length;
    }
    return all > 0.0 ? outline / all : 0.0;
  }

private:
  /// Sorts edges by centre, end and direction. Keys are hashes, so their highest bits divide the edges evenly.
  void sort() {
    const auto bucket_of = [](const StarEdge& edge) { return edge.centre >> (64 - kBucketBits); };
    std::vector<size_t> ends((size_t{1} << kBucketBits) + 1);
    for (const StarEdge& edge : edges_) ++ends[bucket_of(edge) + 1];
    std::partial_sum(ends.begin(), ends.end(), ends.begin());
    std::vector<StarEdge> sorted(edges_.size());
    for (const StarEdge& edge : edges_) sorted[ends[bucket_of(edge)]++] = edge;
    edges_ = std::move(sorted);
    const auto at = [&](size_t i) { return edges_.begin() + static_cast<std::ptrdiff_t>(i); };
    for (size_t bucket = 0, begin = 0; begin < edges_.size(); begin = ends[bucket++])
      std::sort(at(begin), at(ends[bucket]), [](const StarEdge& a, const StarEdge& b) {
        return std::tie(a.centre, a.end, a.outgoing) < std::tie(b.centre, b.end, b.outgoing);
      });
  }

  uint64_t mask_;
  std::vector<StarEdge> edges_;
  std::vector<DVec3> normals_; // unit normals of the triangles at sampled positions
};

} // namespace

double outline_share(const Scene& scene, const GeometryPlan& plan) {
  uint64_t vertices = 0;
  for (const GeometryPart& part : plan.parts) vertices += scene.meshes[part.mesh].positions.size();
  if (vertices == 0) return 0.0;
  Stars stars(vertices);
  for (const GeometryPart& part : plan.parts) stars.add(scene.meshes[part.mesh], part);
  return stars.share();
}

} // namespace packtrace
