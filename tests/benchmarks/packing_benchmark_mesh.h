#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

class BenchmarkOptions;

/// The data that a codec must keep.
enum class PackedStreams {
  kPositions, ///< positions and triangles; vertices with equal positions are merged
  kAll,       ///< normals and texture coordinates as well
};

/// A mesh for all codecs to pack.
struct PackingInput {
  std::string name;
  Scene scene; ///< source of the mesh
  Mesh mesh;   ///< all world shapes of the scene in world space; normals for all, UVs if any shape has them
};

/// Merges all shapes outside objects into one mesh. Shapes without normals get area-weighted ones. Shapes without
/// texture coordinates get zeros if others have them. Materials and instances are left out.
Mesh merge_world(const Scene& scene);

/// Keeps only positions and triangles, and merges vertices with equal positions. Triangles that collapse are kept.
Mesh weld_positions(const Mesh& mesh);

/// Returns an input by name: "generated" (packtrace_scenegen's displaced mesh, a ring of eroded rock with vertex
/// normals), one of grid_input_names(), "bunny", "spaceship" or "house" (a folder of `scenes`), or a scene or mesh
/// file. The scene's world is merged. The bunny is loaded without the plane below it. Throws like import_scene(), and
/// Error(kInput) if the world has no triangles.
PackingInput find_packing_input(const std::string& name, const std::filesystem::path& scenes,
                                uint64_t generated_triangles);

/// The meshes that a benchmark measures, from its command line.
struct PackingInputs {
  std::filesystem::path scenes;
  uint64_t generated_triangles = 500'000;
  std::vector<std::string> names;

  void add_to(BenchmarkOptions& command_line);
  /// Call after parsing. Selects all available inputs if none was named.
  void choose();
  PackingInput find(const std::string& name) const { return find_packing_input(name, scenes, generated_triangles); }
};

/// Median length of the triangle edges with nonzero length; 0 if there are none.
double median_edge(const Mesh& mesh);

/// Lowest corner and longest side of the bounds of all positions.
struct PackingBox {
  Vec3 lo{0.0f};
  double side = 0.0;
};
PackingBox packing_box(const Mesh& mesh);

} // namespace packtrace
