// Opens a .ptk file and decodes one of its clusters: the first of its largest geometry.
// Usage: read_cluster FILE.ptk

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/error.h"

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fprintf(stderr, "usage: read_cluster FILE.ptk\n");
    return 2;
  }
  // The file is mapped and validated as a whole, so that nothing below has to be checked again.
  const packtrace::BakedFile file = packtrace::BakedFile::open(argv[1]);

  const auto geometries = file.geometries().first(file.base_geometry_count()); // without coarser LOD levels
  const auto largest = std::max_element(geometries.begin(), geometries.end(), [](const auto& a, const auto& b) {
    return a.triangle_count < b.triangle_count;
  });
  if (largest == geometries.end() || largest->cluster_count == 0) {
    std::fprintf(stderr, "%s has no triangles\n", argv[1]);
    return 3;
  }
  const auto geometry = static_cast<uint32_t>(largest - geometries.begin());
  std::printf("geometry %u \"%s\": %u triangles in %u clusters\n", geometry,
              std::string(file.text(largest->name)).c_str(), largest->triangle_count, largest->cluster_count);

  // Either all of a cluster ...
  const packtrace::ClusterView cluster = file.cluster(geometry, 0);
  std::vector<packtrace::Vec3> positions(cluster.vertex_count());
  std::vector<packtrace::Triangle> triangles(cluster.triangle_count());
  decode_positions(cluster, positions);
  decode_indices(cluster, 0, triangles);
  double area = 0.0; // object units squared
  for (const packtrace::Triangle& t : triangles)
    area += 0.5 * static_cast<double>(
                      glm::length(glm::cross(positions[t.y] - positions[t.x], positions[t.z] - positions[t.x])));
  std::printf("cluster 0: %zu triangles, %zu vertices, area %g\n", triangles.size(), positions.size(), area);

  // ... or any vertex by itself, with the same bits.
  const uint32_t last = cluster.vertex_count() - 1;
  const packtrace::Vec3 position = cluster.position(last);
  std::printf("vertex %u at (%g, %g, %g)", last, static_cast<double>(position.x), static_cast<double>(position.y),
              static_cast<double>(position.z));
  if (cluster.has_normals()) {
    const packtrace::Vec3 normal = cluster.normal(last);
    std::printf(", normal (%.3f, %.3f, %.3f)", static_cast<double>(normal.x), static_cast<double>(normal.y),
                static_cast<double>(normal.z));
  }
  std::printf("\n");
  return position == positions[last] ? 0 : 1;
} catch (const packtrace::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return error.exit_code();
}
