#pragma once

#include <algorithm>
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {

/// Counts of what an import keeps of a scene.
struct Kept {
  uint64_t shapes = 0;            ///< shapes with all instances counted
  uint64_t triangles = 0;         ///< triangles with all instances counted
  uint64_t skipped_shapes = 0;    ///< ImportStatistics::shapes_skipped
  uint64_t dropped_triangles = 0; ///< Scene::dropped_triangles
  bool operator==(const Kept&) const = default;
};

inline std::ostream& operator<<(std::ostream& out, const Kept& kept) {
  return out << kept.shapes << " shapes, " << kept.triangles << " triangles, " << kept.skipped_shapes << " skipped, "
             << kept.dropped_triangles << " dropped";
}

/// A world whose body starts in line 2, followed by a valid triangle that must survive whatever the body contains.
inline std::string world(const std::string& body) {
  return "WorldBegin\n" + body + "\n" + std::string(kTriangle) + "\nWorldEnd\n";
}

inline std::string without_folder(std::string text, const SceneFolder& folder) {
  const std::string path = folder.path().string() + "/";
  for (size_t at = text.find(path); at != text.npos; at = text.find(path, at)) text.erase(at, path.size());
  return text;
}

inline Kept kept_of(const Imported& imported) {
  const Scene& scene = imported.scene;
  uint64_t shapes = scene.shapes.size();
  for (const Instance& instance : scene.instances) shapes += scene.objects[instance.object].shapes.size();
  return {shapes, placed_triangle_count(scene), imported.statistics.shapes_skipped, scene.dropped_triangles};
}

/// Checks that all indices are in range and all numbers are finite.
inline void expect_sound(const Scene& scene) {
  const auto check = [&](const Shape& shape) {
    ASSERT_LT(shape.mesh, scene.meshes.size());
    ASSERT_LT(shape.material, scene.materials.size());
    for (int column = 0; column < 4; ++column) EXPECT_TRUE(is_finite(shape.parent_from_mesh[column]));
  };
  for (const Shape& shape : scene.shapes) check(shape);
  for (const Object& object : scene.objects)
    for (const Shape& shape : object.shapes) check(shape);
  for (const Instance& instance : scene.instances) ASSERT_LT(instance.object, scene.objects.size());
  for (const Mesh& mesh : scene.meshes) {
    EXPECT_FALSE(mesh.triangles.empty());
    for (const Triangle& t : mesh.triangles) ASSERT_LT(std::max({t.x, t.y, t.z}), mesh.positions.size());
    for (const Vec3 p : mesh.positions) ASSERT_TRUE(is_finite(p));
    for (const Vec3 n : mesh.normals) ASSERT_NEAR(glm::length(n), 1.0f, 1e-5f);
    EXPECT_TRUE(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size());
    EXPECT_TRUE(mesh.uvs.empty() || mesh.uvs.size() == mesh.positions.size());
  }
  for (const Material& material : scene.materials) {
    EXPECT_TRUE(is_finite(material.albedo));
    EXPECT_EQ(material.albedo, glm::clamp(material.albedo, Vec3(0.0f), Vec3(1.0f)));
  }
}

} // namespace packtrace
