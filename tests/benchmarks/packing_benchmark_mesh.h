#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// What a codec is asked to keep.
enum class PackedStreams {
  kPositions, ///< positions and triangles; vertices at one place are one vertex
  kAll,       ///< normals and texture coordinates as well
};

/// One mesh that every codec packs.
struct PackingInput {
  std::string name;
  Scene scene; ///< where the mesh came from
  Mesh mesh;   ///< all shapes of the scene's world in world space; normals everywhere, uvs where any shape has them
};

/// All shapes outside objects as one mesh. Shapes without normals get area-weighted ones, shapes without texture
/// coordinates zeros where others have them. Materials and instances are left out.
Mesh merge_world(const Scene& scene);

/// Only positions and triangles, vertices with equal positions merged; triangles that lose a corner by it are kept.
Mesh weld_positions(const Mesh& mesh);

/// By name: "generated" (packtrace_scenegen's displaced mesh: a ring of eroded rock with vertex normals), or a folder
/// of `scenes`; of the bunny without the plane below it. The scene's world is merged. Throws as import_scene() does.
PackingInput find_packing_input(const std::string& name, const std::filesystem::path& scenes,
                                uint64_t generated_triangles);

/// Which meshes a benchmark takes, from its command line.
struct PackingInputs {
  std::filesystem::path scenes;
  uint64_t generated_triangles = 500'000;
  std::vector<std::string> names;

  void add_to(CLI::App& app);
  /// After parsing: all that there are where none was named.
  void choose();
  PackingInput find(const std::string& name) const { return find_packing_input(name, scenes, generated_triangles); }
};

/// Median length of the triangles' edges, those of length 0 left out; 0 if there are none.
double median_edge(const Mesh& mesh);

/// Lowest corner and longest side of the box around the positions.
struct PackingBox {
  Vec3 lo{0.0f};
  double side = 0.0;
};
PackingBox packing_box(const Mesh& mesh);

} // namespace packtrace
