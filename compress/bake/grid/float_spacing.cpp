#include "compress/bake/grid/float_spacing.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace packtrace {
namespace {

double stretch_of(const DAffine& map) {
  return std::sqrt(std::max({glm::dot(map[0], map[0]), glm::dot(map[1], map[1]), glm::dot(map[2], map[2])}));
}

} // namespace

double float_spacing(const Bounds& box) {
  if (box.empty()) return 0.0;
  const DVec3 largest = glm::max(glm::abs(box.lo), glm::abs(box.hi));
  const auto furthest = static_cast<float>(std::max({largest.x, largest.y, largest.z}));
  return static_cast<double>(std::nextafter(furthest, HUGE_VALF) - furthest);
}

double largest_mesh_spacing(const Scene& scene) {
  std::vector<double> stretch(scene.meshes.size(), 0.0), of_object(scene.objects.size(), 0.0);
  const auto add = [&](const std::vector<Shape>& shapes, double factor) {
    for (const Shape& shape : shapes)
      stretch[shape.mesh] = std::max(stretch[shape.mesh], factor * stretch_of(shape.parent_from_mesh));
  };
  for (const Instance& instance : scene.instances)
    of_object[instance.object] = std::max(of_object[instance.object], stretch_of(DAffine(instance.world_from_object)));
  add(scene.shapes, 1.0);
  for (size_t i = 0; i < of_object.size(); ++i) add(scene.objects[i].shapes, of_object[i]);
  double largest = 0.0;
  for (size_t i = 0; i < stretch.size(); ++i)
    if (stretch[i] > 0.0) largest = std::max(largest, stretch[i] * float_spacing(bounds_of(scene.meshes[i].positions)));
  return largest;
}

} // namespace packtrace
