// The place of a hit that the driver's traversal found.
#include "scene.glsl"
#include "unit_ray.glsl"
#include "found.glsl"

layout(std430, binding = 12) readonly restrict buffer Ranges { RangeRecord ranges[]; };
layout(std430, binding = 13) readonly restrict buffer Instances { InstanceRecord instances[]; };
layout(location = 0) rayPayloadInEXT Found found;
hitAttributeEXT vec2 weights; // of the second and third vertex

// Placement, cluster and triangle of the cluster.
uvec3 place_of_hit() {
  InstanceRecord placed = instances[gl_InstanceID];
  uint triangle = uint(gl_PrimitiveID), begin = placed.first_range[gl_GeometryIndexEXT];
  uint end = begin + placed.range_count[gl_GeometryIndexEXT];
  while (end - begin > 1u) { // the last range that begins at or before the triangle
    uint middle = begin + (end - begin) / 2u;
    if (ranges[middle].first_triangle <= triangle)
      begin = middle;
    else
      end = middle;
  }
  return uvec3(placed.placement, ranges[begin].cluster, triangle - ranges[begin].first_triangle);
}
