#include "tests/benchmarks/packing_benchmark_cracks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <unordered_map>
#include <vector>

#include "compress/bake/bake_scene.h"
#include "compress/bake/grid/collapsed_triangles.h"
#include "compress/format/cluster/position_grid.h"
#include "compress/format/file/baked_file.h"

namespace packtrace {
namespace {

constexpr uint64_t mix(uint64_t hash, uint64_t word) {
  hash = (hash ^ word) * 0x9e3779b97f4a7c15u;
  return hash ^ (hash >> 32);
}

template <typename Point>
struct PointHash {
  size_t operator()(const Point& p) const {
    uint64_t hash = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double d = double{p[axis]} + 0.0; // turns -0 into 0
      uint64_t bits = 0;
      std::memcpy(&bits, &d, sizeof(bits));
      hash = mix(hash, bits);
    }
    return hash;
  }
};

/// A key of three positions, whatever the first corner and the winding.
uint64_t triangle_key(const std::array<Vec3, 3>& corners) {
  std::array<uint64_t, 3> keys{};
  std::transform(corners.begin(), corners.end(), keys.begin(), PointHash<Vec3>());
  std::sort(keys.begin(), keys.end());
  return mix(mix(keys[0], keys[1]), keys[2]);
}

/// Per triangle key: occurrences in the file that no source triangle has claimed yet.
using Census = std::unordered_map<uint64_t, int64_t>;

/// The users of a position: one or several.
struct Holder {
  uint32_t first = 0;
  bool several = false;
  void add(uint32_t holder) { several = several || holder != first; }
};

class CrackCounter {
public:
  CrackCounter(const Scene& scene, const BakedFile& file) : scene_(scene), file_(file) {}

  CrackCounts count() {
    for (uint32_t s = 0; s < scene_.shapes.size(); ++s) {
      if (in_world(s))
        place(s);
      else
        ++counts_.instanced_shapes;
    }
    count_decoded();
    for (uint32_t s = 0; s < scene_.shapes.size(); ++s)
      if (in_world(s)) follow(s);
    finish();
    return counts_;
  }

private:
  struct Source {
    Holder shapes;
    bool cracked = false;
    Vec3 own_box{0.0f}; ///< position decoded from a 16-bit box of the first shape
    bool own_box_differs = false;
  };

  uint32_t geometry_of(uint32_t shape) const { return file_.instances()[shape].geometry; }
  bool in_world(uint32_t shape) const {
    return (file_.geometries()[geometry_of(shape)].flags & baked::kWorldSpace) != 0;
  }
  DVec3 placed(const Shape& shape, uint32_t vertex) const {
    return transform_point(shape.parent_from_mesh, DVec3(scene_.meshes[shape.mesh].positions[vertex])) + 0.0;
  }

  void place(uint32_t s) {
    const Shape& shape = scene_.shapes[s];
    const Mesh& mesh = scene_.meshes[shape.mesh];
    Bounds box;
    for (const Triangle& t : mesh.triangles)
      for (int corner = 0; corner < 3; ++corner) box.extend(placed(shape, t[corner]));
    const DVec3 step = glm::max(box.extent() / 65535.0, DVec3(1e-300));
    for (const Triangle& t : mesh.triangles)
      for (int corner = 0; corner < 3; ++corner) {
        const DVec3 p = placed(shape, t[corner]);
        const Vec3 own_box(box.lo + step * glm::round((p - box.lo) / step));
        const auto [entry, is_new] = sources_.try_emplace(p, Source{{s, false}, false, own_box, false});
        entry->second.shapes.add(s);
        entry->second.own_box_differs = entry->second.own_box_differs || entry->second.own_box != own_box;
      }
    counts_.triangles += mesh.triangles.size();
  }

  void count_decoded() {
    std::unordered_map<Vec3, Holder, PointHash<Vec3>> holders;
    std::vector<Vec3> positions;
    std::vector<Triangle> triangles;
    uint32_t number = 0; // number of the cluster within the file
    for (uint32_t g = 0; g < file_.geometries().size(); ++g) {
      if ((file_.geometries()[g].flags & baked::kWorldSpace) == 0) continue;
      for (uint32_t c = 0; c < file_.geometries()[g].cluster_count; ++c, ++number) {
        const ClusterView cluster = file_.cluster(g, c);
        positions.resize(cluster.vertex_count());
        triangles.resize(cluster.triangle_count());
        decode_positions(cluster, positions);
        decode_indices(cluster, 0, triangles);
        for (const Vec3 p : positions) holders.try_emplace(p, Holder{number, false}).first->second.add(number);
        for (const Triangle& t : triangles) ++census_[triangle_key({positions[t.x], positions[t.y], positions[t.z]})];
      }
    }
    for (const auto& [position, holder] : holders) counts_.shared_between_clusters += holder.several;
  }

  void follow(uint32_t s) {
    const Shape& shape = scene_.shapes[s];
    const baked::GeometryRecord& geometry = file_.geometries()[geometry_of(s)];
    const double step = PositionGrid{geometry.step_mantissa, geometry.step_exponent}.step();
    for (const Triangle& t : scene_.meshes[shape.mesh].triangles) {
      std::array<LatticePoint, 3> points{};
      std::array<Vec3, 3> corners{};
      for (int corner = 0; corner < 3; ++corner) {
        const DVec3 p = placed(shape, t[corner]);
        const auto at = static_cast<size_t>(corner);
        for (int axis = 0; axis < 3; ++axis) {
          const int64_t q = to_lattice(p[axis], step);
          points[at][static_cast<size_t>(axis)] = q, corners[at][axis] = from_lattice(q, step);
        }
      }
      const auto found = census_.find(triangle_key(corners));
      if (found != census_.end()) {
        if (found->second-- <= 0) ++counts_.coinciding_triangles;
      } else if (!has_area(points[0], points[1], points[2])) {
        ++counts_.collapsed_triangles;
      } else {
        ++counts_.lost_triangles;
        for (int corner = 0; corner < 3; ++corner) sources_.at(placed(shape, t[corner])).cracked = true;
      }
    }
  }

  void finish() {
    for (const auto& [position, source] : sources_) {
      counts_.shared_between_meshes += source.shapes.several;
      counts_.cracked_between_clusters += source.cracked;
      counts_.cracked_between_meshes += source.cracked && source.shapes.several;
      counts_.own_box_cracked_between_meshes += source.own_box_differs && source.shapes.several;
    }
  }

  const Scene& scene_;
  const BakedFile& file_;
  std::unordered_map<DVec3, Source, PointHash<DVec3>> sources_;
  Census census_;
  CrackCounts counts_;
};

} // namespace

CrackCounts count_cracks(const Scene& scene, const BakeConfig& config) {
  Diagnostics diagnostics;
  Progress progress;
  const BakedScene baked = bake_to_bytes(scene, config, diagnostics, progress);
  return CrackCounter(scene, BakedFile::borrow_bytes(baked.bytes)).count();
}

} // namespace packtrace
