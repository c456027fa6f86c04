#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <set>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "compress/exchange/scene/obj_export.h"
#include "compress/exchange/scene/pbrt_export.h"
#include "compress/exchange/scene/stream_export.h"
#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/import_scene.h"
#include "tests/compress/test_scenes.h"
#include "tests/compress/world_faces.h"
#include "tests/sanitized.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

std::filesystem::path write(const TemporaryFolder& folder, const SceneExport& result) {
  for (const ExportedFile& file : result.files) {
    const std::filesystem::path path = folder.path() / file.name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(file.bytes.data()), static_cast<std::streamsize>(file.bytes.size()));
  }
  return folder.path() / result.files.back().name;
}

/// The export with its main file, which is streamed.
SceneExport whole_obj(const BakedFile& file, const std::string& stem, Progress& progress) {
  std::vector<std::byte> main;
  SceneExport result = export_obj(file, stem, progress, [&](std::span<const std::byte> bytes) {
    main.insert(main.end(), bytes.begin(), bytes.end());
  });
  result.files.push_back({stem + ".obj", std::move(main)});
  uint64_t total = 0;
  for (const ExportedFile& f : result.files) total += f.bytes.size();
  EXPECT_EQ(result.report.file_bytes, total);
  return result;
}

Scene import_again(const std::filesystem::path& path) {
  Diagnostics diagnostics;
  Progress progress;
  ImportResult result = import_scene(path, {}, diagnostics, progress);
  for (const Diagnostic& d : diagnostics.entries()) EXPECT_NE(d.severity, Severity::kError) << d.message;
  return std::move(result.scene);
}

/// A scene on lattices that baking would not choose.
BakedScene coarse_scene() {
  BakeConfig config;
  config.precision_kind = PrecisionKind::kPositionBits;
  config.precision = 11;
  Scene scene = test::mixed_scene();
  scene.materials[0].name = "b\xe4um \"\\\n\xff";
  Camera camera;
  camera.world_from_camera = *look_at({3, 4, -9}, {0.5, 0, 0}, {0, 1, 0});
  camera.fov_degrees = 50.0;
  scene.cameras.push_back(camera);
  return test::bake(scene, config);
}

TEST(PbrtExport, BakingAgainGivesTheSamePositions) {
  const BakedScene baked = coarse_scene();
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  Progress progress;
  const TemporaryFolder folder;
  const Scene scene = import_again(write(folder, export_pbrt(file, "a \"\\\xc3\xa9", progress)));
  const BakedScene again = test::bake(scene);
  const BakedFile back = BakedFile::from_bytes(again.bytes);
  EXPECT_EQ(test::world_faces(back), test::world_faces(file));
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_NEAR(scene.cameras[0].world_from_camera[3].x, 3.0, 1e-6);
  EXPECT_NEAR(scene.cameras[0].fov_degrees, 50.0, 1e-5);
  EXPECT_EQ(scene.masks.size(), file.sections().masks.size());
  std::multiset<MaterialFlags> before, after;
  for (const Material& material : file.materials()) before.insert(material.flags);
  for (const Material& material : scene.materials) after.insert(material.flags);
  EXPECT_EQ(before, after);
}

TEST(PbrtExport, AnAskedPrecisionReplacesTheLattice) {
  const BakedScene baked = coarse_scene();
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  Progress progress;
  const TemporaryFolder folder;
  BakeConfig config;
  config.precision_kind = PrecisionKind::kPositionBits;
  config.precision = 9;
  const BakedScene again = test::bake(import_again(write(folder, export_pbrt(file, "a", progress))), config);
  EXPECT_NE(test::world_faces(BakedFile::from_bytes(again.bytes)), test::world_faces(file));
}

TEST(ObjExport, FacesComeBack) {
  const BakedScene baked = coarse_scene();
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  Progress progress;
  const TemporaryFolder folder;
  const Scene scene = import_again(write(folder, whole_obj(file, "a", progress)));
  std::multiset<test::WorldFace> after;
  for (const Shape& shape : scene.shapes)
    for (const Triangle& t : scene.meshes[shape.mesh].triangles) {
      test::WorldFace face;
      for (int k = 0; k < 3; ++k) {
        const DVec3 p = transform_point(shape.parent_from_mesh, DVec3(scene.meshes[shape.mesh].positions[t[k]]));
        face[static_cast<size_t>(k)] = {static_cast<float>(p.x) + 0.0f, static_cast<float>(p.y) + 0.0f,
                                        static_cast<float>(p.z) + 0.0f};
      }
      std::swap(face[1], face[2]); // the file is mirrored
      after.insert(test::face_of(face));
    }
  std::multiset<test::WorldFace> mirrored; // the faces of mirroring instances have the other winding
  for (const bool mirrors : {false, true})
    for (test::WorldFace face : test::world_faces(file, mirrors)) {
      if (mirrors) std::swap(face[1], face[2]);
      mirrored.insert(test::face_of(face));
    }
  EXPECT_EQ(after, mirrored);
}

/// Readers multiply the texture (map_Kd) by the diffuse colour (Kd).
TEST(ObjExport, ColoursOfImagesComeBack) {
  Scene scene = test::scene_of(test::grid_mesh(4));
  scene.meshes[0].uvs.assign(scene.meshes[0].positions.size(), Vec2(0.5f));
  AlbedoTexture texture;
  texture.width = texture.height = 4;
  texture.rgb.assign(3 * 4 * 4, 100); // an sRGB value
  scene.textures.push_back(std::move(texture));
  constexpr float kLinear = 0.127f;
  scene.materials[0].albedo = Vec3(kLinear);
  scene.materials[0].albedo_texture = 0;
  scene.materials[0].flags |= kAlbedoTexture;
  BakeConfig config;
  config.purpose = baked::kShading;
  config.textures = true;
  const BakedScene baked = test::bake(scene, config);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.sections().textures.size(), 1u);
  Progress progress;
  const TemporaryFolder folder;
  const Scene back = import_again(write(folder, whole_obj(file, "a", progress)));
  ASSERT_EQ(back.materials.size(), 1u);
  EXPECT_NEAR(back.materials[0].albedo.x, kLinear, 0.01f);
}

TEST(ObjExport, CompanionsAreKnownBefore) {
  Scene scene = test::mixed_scene();
  const BakedScene baked = test::bake(std::move(scene));
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_FALSE(file.sections().textures.empty() && file.sections().masks.empty());
  Progress progress;
  std::vector<std::string> names;
  for (const ExportedFile& f : export_obj(file, "a", progress, [](std::span<const std::byte>) {}).files)
    names.push_back(f.name);
  EXPECT_EQ(obj_companions(file, "a"), names);
}

/// What the export holds at a time does not grow with the number of instances.
TEST(ObjExport, InstancesAreStreamed) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  Scene scene = test::mixed_scene();
  ASSERT_FALSE(scene.instances.empty());
  for (int i = 0; i < 500; ++i) {
    scene.instances.push_back(scene.instances.back());
    scene.instances.back().world_from_object[3] += Vec3(1.0f, 0.0f, 0.0f);
  }
  const BakedScene baked = test::bake(scene);
  Progress progress;
  uint64_t total = 0;
  size_t largest = 0;
  export_obj(BakedFile::from_bytes(baked.bytes), "a", progress, [&](std::span<const std::byte> bytes) {
    total += bytes.size();
    largest = std::max(largest, bytes.size());
  });
  EXPECT_GT(total, uint64_t{3} << 20);
  EXPECT_LT(largest, size_t{2} << 20);
}

/// What the export holds at a time does not grow with the size of a mesh.
TEST(ObjExport, LargeMeshesAreStreamed) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const BakedScene baked = test::bake(test::scene_of(test::grid_mesh(300, 0.1f)));
  Progress progress;
  uint64_t total = 0;
  size_t largest = 0;
  export_obj(BakedFile::from_bytes(baked.bytes), "a", progress, [&](std::span<const std::byte> bytes) {
    total += bytes.size();
    largest = std::max(largest, bytes.size());
  });
  constexpr size_t kLongestLine = 128;
  EXPECT_GT(total, uint64_t{4} << 20);
  EXPECT_LE(largest, (size_t{1} << 20) + kLongestLine);
}

/// Far from the world's origin floats are coarser than the lattice.
TEST(ObjExport, PlacesFarFromTheOriginKeepTheirPrecision) {
  constexpr int kSide = 8;
  constexpr double kFar = 1 << 25; // floats are multiples of 4 here
  Scene scene = test::scene_of(test::grid_mesh(kSide));
  scene.origin = DVec3(kFar, 0.0, 0.0);
  const BakedScene baked = test::bake(scene);
  Progress progress;
  std::string text;
  export_obj(BakedFile::from_bytes(baked.bytes), "a", progress, [&](std::span<const std::byte> bytes) {
    text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  });
  std::istringstream lines(text);
  std::set<double> columns;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("v ")) continue;
    const double column = (-std::stod(line.substr(2)) - kFar) * kSide;
    EXPECT_NEAR(column, std::round(column), 0.01) << line;
    columns.insert(std::round(column));
  }
  EXPECT_EQ(columns.size(), size_t{kSide + 1});
}

TEST(StreamExport, ArraysHoldTheLattice) {
  const BakedScene baked = coarse_scene();
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  Progress progress;
  const SceneExport result = export_streams(file, "a", progress);
  const auto& text = result.files.back().bytes;
  const nlohmann::json json =
      nlohmann::json::parse(std::string_view(reinterpret_cast<const char*>(text.data()), text.size()));
  const auto data_of = [&](const char* array) {
    const auto found =
        std::ranges::find(result.files, json["arrays"][array]["file"].get<std::string>(), &ExportedFile::name);
    EXPECT_NE(found, result.files.end());
    uint16_t header = 0;
    std::memcpy(&header, found->bytes.data() + 8, sizeof header);
    EXPECT_EQ((10 + header) % 64, 0);
    return std::span(found->bytes).subspan(10u + header);
  };
  const std::span<const std::byte> positions = data_of("positions"), lattice = data_of("lattice");
  uint64_t vertices = 0;
  for (size_t g = 0; g < json["geometries"].size(); ++g) {
    const nlohmann::json& geometry = json["geometries"][g];
    const double step = PositionGrid{geometry["step"][0], geometry["step"][1]}.step();
    for (const nlohmann::json& primitive : geometry["primitives"]) {
      const size_t first = primitive["first_vertex"], count = primitive["vertices"];
      vertices += count;
      for (size_t i = 3 * first; i < 3 * (first + count); ++i) {
        int64_t q = 0;
        float p = 0.0f;
        std::memcpy(&q, lattice.data() + i * sizeof q, sizeof q);
        std::memcpy(&p, positions.data() + i * sizeof p, sizeof p);
        ASSERT_EQ(from_lattice(q, step), p);
      }
    }
  }
  EXPECT_EQ(vertices, json["arrays"]["positions"]["shape"][0].get<uint64_t>());
  EXPECT_EQ(positions.size(), vertices * 3 * sizeof(float));
}

TEST(SceneExports, BytesDoNotDependOnThreads) {
  const BakedScene baked = coarse_scene();
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  Progress progress;
  for (const auto exports : {export_pbrt, whole_obj, export_streams}) {
    const SceneExport many = exports(file, "a", progress);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const SceneExport again = exports(file, "a", progress);
    ASSERT_EQ(again.files.size(), many.files.size());
    for (size_t i = 0; i < many.files.size(); ++i) EXPECT_EQ(again.files[i].bytes, many.files[i].bytes);
  }
}

} // namespace
} // namespace packtrace
