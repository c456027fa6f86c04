#pragma once

#include <algorithm>
#include <array>
#include <map>

#include "tests/compress/test_scenes.h"

namespace packtrace::test {

using LatticeTriangle = std::array<LatticePoint, 3>;

/// Counts triangles by their lattice corners, rotated to start at the smallest. Equal counts mean equal triangles with
/// equal winding.
class TriangleCensus {
public:
  void add(LatticeTriangle t, int by) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    // If two corners are equally small, two rotations qualify; take the smaller one.
    const LatticeTriangle second = {t[1], t[2], t[0]}, third = {t[2], t[0], t[1]};
    counts_[std::min({t, second, third})] += by;
  }
  bool balanced() const {
    return std::all_of(counts_.begin(), counts_.end(), [](const auto& entry) { return entry.second == 0; });
  }

private:
  std::map<LatticeTriangle, int> counts_;
};

/// Whether geometry `g` holds exactly the mesh's triangles, with each corner at the nearest lattice point.
inline bool holds(const BakedFile& file, uint32_t g, const Mesh& mesh, const DAffine& transform = DAffine(1.0),
                  bool flip = false) {
  const baked::GeometryRecord& record = file.geometries()[g];
  const double step = PositionGrid{record.step_mantissa, record.step_exponent}.step();
  TriangleCensus census;
  for (const Triangle& t : mesh.triangles) {
    LatticeTriangle lattice;
    for (size_t corner = 0; corner < 3; ++corner) {
      const DVec3 p = transform_point(transform, DVec3(mesh.positions[t[static_cast<int>(corner)]]));
      lattice[corner] = {to_lattice(p.x, step), to_lattice(p.y, step), to_lattice(p.z, step)};
    }
    if (flip) std::swap(lattice[1], lattice[2]);
    census.add(lattice, 1);
  }
  for (uint32_t c = 0; c < file.clusters(g).size(); ++c) {
    const ClusterView view = file.cluster(g, c);
    for (uint32_t i = 0; i < view.triangle_count(); ++i) {
      const Triangle t = view.triangle(i);
      census.add({view.lattice(t.x), view.lattice(t.y), view.lattice(t.z)}, -1);
    }
  }
  return census.balanced();
}

inline BakeConfig precision(PrecisionKind kind, double value) {
  BakeConfig config;
  config.precision_kind = kind;
  config.precision = value;
  return config;
}

/// A grid shape; the materials include one with a mask and one of glass.
inline Scene masked_scene() {
  Scene scene = scene_of(grid_mesh(12));
  scene.masks.push_back(striped_mask());
  scene.materials.push_back({"leaf", kAlphaMask, Vec3(0.5f), 0, kNoMask});
  scene.materials.push_back({"glass", kTransmissive, Vec3(0.5f), kNoMask, kNoMask});
  return scene;
}

/// Smallest cosine between a triangle's winding normal and its direction from the origin.
inline double winding_agreement(const Decoded& all) {
  double worst = 1.0;
  for (const Triangle& t : all.triangles) {
    const DVec3 a(all.positions[t.x]), b(all.positions[t.y]), c(all.positions[t.z]);
    worst = std::min(worst, glm::dot(glm::normalize(glm::cross(b - a, c - a)), glm::normalize(a + b + c)));
  }
  return worst;
}

} // namespace packtrace::test
