#include "compress/bake/clusters/triangle_cutter.h"

#include <vector>

#include "compress/bake/clusters/cluster_cutter.h"
#include "compress/bake/clusters/renumbering.h"

namespace packtrace {

TreeBox box_of(const QuantizedGeometry& geometry, uint32_t triangle) {
  TreeBox box;
  for (int corner = 0; corner < 3; ++corner) {
    const LatticePoint& position = geometry.positions[geometry.vertices[geometry.triangles[triangle][corner]].position];
    TreeBox point;
    for (size_t axis = 0; axis < 3; ++axis)
      point.lo[axis] = point.hi[axis] = static_cast<float>(position[axis] - geometry.origin[axis]);
    if (corner == 0)
      box = point;
    else
      box.extend(point);
  }
  return box;
}

Clusters cut_triangles(const QuantizedGeometry& geometry, std::span<const uint32_t> triangles) {
  Renumbering vertex_numbers(triangles.size());
  std::vector<Triangle> vertices;
  std::vector<TreeBox> boxes;
  vertices.reserve(triangles.size()), boxes.reserve(triangles.size());
  for (const uint32_t t : triangles) {
    const Triangle& corners = geometry.triangles[t];
    Triangle vertex{};
    for (int corner = 0; corner < 3; ++corner) vertex[corner] = vertex_numbers(corners[corner]);
    vertices.push_back(vertex);
    boxes.push_back(box_of(geometry, t));
  }
  return cut_clusters(boxes, vertices, static_cast<uint32_t>(vertex_numbers.values.size()));
}

} // namespace packtrace
