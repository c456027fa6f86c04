#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

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

/// A hostile scene with the expected diagnostics and the expected result of its import.
struct HostileCase {
  std::string name;
  std::string scene;       ///< text of scene.pbrt
  std::string diagnostics; ///< all diagnostics in order as a user sees them, without the folder's path
  Kept kept;
  std::vector<std::pair<std::string, std::string>> files = {}; ///< names and contents of files next to scene.pbrt
  ImportOptions options = {};
  /// Kind of the error that the import throws with `diagnostics` as its text; unset: none.
  std::optional<ErrorKind> refused = {};
};

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

/// Imports again with ImportOptions::strict. The import must fail if and only if there was a warning or an error, with
/// the first of them as its message.
inline void expect_strict_agrees(const HostileCase& test_case, const std::filesystem::path& scene,
                                 const Imported& lenient) {
  ImportOptions options = test_case.options;
  options.strict = true;
  const auto first = std::find_if(lenient.diagnostics.begin(), lenient.diagnostics.end(),
                                  [](const Diagnostic& d) { return d.severity != Severity::kNote; });
  try {
    (void)import_file(scene, options);
    EXPECT_EQ(first, lenient.diagnostics.end()) << "strict mode accepted it";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    ASSERT_NE(first, lenient.diagnostics.end()) << error.what();
    EXPECT_EQ(std::string(error.what()).find(to_string(first->location) + ": " + first->message), 0u) << error.what();
  }
}

/// Imports the scene of a case and compares all results with the expected ones.
inline void run(const HostileCase& test_case) {
  const SceneFolder folder;
  for (const auto& [name, content] : test_case.files) folder.write(name, content);
  const std::filesystem::path scene = folder.write("scene.pbrt", test_case.scene);
  try {
    const Imported imported = import_file(scene, test_case.options);
    EXPECT_FALSE(test_case.refused) << "accepted";
    EXPECT_EQ(without_folder(imported.text(), folder), test_case.diagnostics);
    EXPECT_EQ(kept_of(imported), test_case.kept);
    expect_sound(imported.scene);
    expect_strict_agrees(test_case, scene, imported);
  } catch (const Error& error) {
    ASSERT_TRUE(test_case.refused) << error.what();
    EXPECT_EQ(error.kind(), *test_case.refused);
    EXPECT_EQ(without_folder(error.what(), folder), test_case.diagnostics);
  }
}

/// A test that runs one case.
class HostileTest : public testing::Test {
public:
  explicit HostileTest(const HostileCase& test_case) : case_(test_case) {}
  void TestBody() override { run(case_); }

private:
  const HostileCase& case_; ///< outlives the test
};

/// Registers a test "suite.name" for each case.
/// @return true, so that it can initialise a constant
inline bool register_cases(const char* suite, const std::vector<HostileCase>& cases, const char* file) {
  for (const HostileCase& test_case : cases)
    testing::RegisterTest(suite, test_case.name.c_str(), nullptr, nullptr, file, 0,
                          [shared = std::make_shared<const HostileCase>(test_case)]() -> HostileTest* {
                            return new HostileTest(*shared);
                          });
  return true;
}

} // namespace packtrace
