#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/import_scene.h"
#include "tests/temporary_folder.h"

namespace packtrace {

/// A temporary folder for one test, which the destructor removes.
class SceneFolder : public TemporaryFolder {
public:
  std::filesystem::path write(const std::string& name, std::string_view content) const {
    const std::filesystem::path file = *this / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary).write(content.data(), static_cast<std::streamsize>(content.size()));
    return file;
  }
};

/// Appends a number to a name: "name", 7 -> "name7".
inline std::string numbered(std::string name, int number) { return name += std::to_string(number); }

/// Result of an import with its diagnostics.
struct Imported {
  Scene scene;
  ImportStatistics statistics;
  std::vector<Diagnostic> diagnostics;

  uint64_t count(Severity severity) const {
    uint64_t total = 0;
    for (const Diagnostic& diagnostic : diagnostics) total += diagnostic.severity == severity ? diagnostic.count : 0;
    return total;
  }
  /// The diagnostics as "file:line:column: severity: message" lines.
  std::string text() const {
    std::string all;
    for (const Diagnostic& diagnostic : diagnostics) all += to_string(diagnostic) + "\n";
    return all;
  }
  bool reported(std::string_view part) const { return text().find(part) != std::string::npos; }
};

inline Imported import_file(const std::filesystem::path& file, const ImportOptions& options = {}) {
  Diagnostics diagnostics;
  Progress progress;
  ImportResult result = import_scene(file, options, diagnostics, progress);
  return {std::move(result.scene), std::move(result.statistics), diagnostics.entries()};
}

/// Imports text as scene.pbrt of the folder.
inline Imported import_text(const SceneFolder& folder, std::string_view text, const ImportOptions& options = {}) {
  return import_file(folder.write("scene.pbrt", text), options);
}

/// Imports the content of a world; its first line is line 1 of the file.
inline Imported import_world(const SceneFolder& folder, std::string_view world, const ImportOptions& options = {}) {
  return import_text(folder, "WorldBegin " + std::string(world) + "\nWorldEnd\n", options);
}

inline constexpr std::string_view kTriangle =
    " Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0  1 0 0  0 1 0] ";

/// A PLY file with this triangle, and the shape that refers to it.
inline constexpr std::string_view kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
inline std::string ply_shape(const std::string& file) {
  return "Shape \"plymesh\" \"string filename\" \"" + file + "\"\n";
}

/// Position of a shape's vertex in its parent's space.
inline DVec3 placed(const Shape& shape, const Scene& scene, size_t vertex) {
  return transform_point(shape.parent_from_mesh, DVec3(scene.meshes[shape.mesh].positions[vertex]));
}

/// The only material of a scene; fails if there is any other number of them.
inline Material only_material(const Imported& imported) {
  EXPECT_EQ(imported.scene.materials.size(), 1u) << imported.text();
  return imported.scene.materials.empty() ? Material{} : imported.scene.materials[0];
}

} // namespace packtrace
