#include "pbrt_import/files/ply.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "tests/pbrt_import/ply_writer.h"
#include "tests/sanitized.h"

namespace packtrace::ply_test {
namespace {

void expect_square(const PlyMesh& ply) {
  const std::vector<Vec3> corners{{0, 0, 5}, {1, 0, 5}, {1, 1, 5}, {0, 1, 5}};
  EXPECT_EQ(ply.mesh.positions, corners);
  EXPECT_EQ(ply.mesh.normals, std::vector<Vec3>(4, Vec3(0, 0, 1)));
  EXPECT_EQ(ply.mesh.uvs, (std::vector<Vec2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
  EXPECT_EQ(ply.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(ply.dropped_triangles, 0u);
}

TEST(Ply, EveryFormatAndTypeGivesTheSameMesh) {
  constexpr std::array kReals{"float", "float32", "double", "float64", "int8", "uchar", "int16", "ushort", "int32"};
  constexpr std::array kIntegers{"char", "int8",   "uchar", "uint8", "short", "int16",
                                 "int",  "ushort", "int32", "uint",  "uint32"};
  for (const Format format : kFormats) {
    for (const char* real : kReals) expect_square(read(square(format, real)));
    for (const char* length : kIntegers)
      for (const char* index : kIntegers) expect_square(read(square(format, "float", length, index)));
    expect_square(read(square(format, "float", "uchar", "float")));
  }
}

TEST(Ply, StripsTurnEverySecondTriangleAndStartAnewAtMinusOne) {
  const std::vector<Triangle> expected{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {5, 6, 7}, {1, 2, 3}};
  for (const Format format : kFormats) {
    for (const char* const index : {"int", "short", "char", "uint", "float"}) {
      const double restart = index == std::string("uint") ? 4294967295.0 : -1.0;
      const PlyMesh ply =
          read(strips(format, index, {{0, 1, 2, 3, 4, restart, 5, 6, 7, restart, restart}, {1, 2, 3}, {}}));
      EXPECT_EQ(ply.mesh.triangles, expected) << index;
      EXPECT_EQ(ply.dropped_triangles, 0u);
    }
  }
}

TEST(Ply, StripsMayRepeatAnIndexToGoOnElsewhere) {
  Reports reports;
  const PlyMesh ply = read(strips(Format::kLittle, "int", {{0, 1, 2, 2, 5, 5, 6, 7}}), &reports);
  // The repeated corners 2 and 5 give no triangles, so vertices 3 and 4 are unused and dropped.
  EXPECT_EQ(ply.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {4, 3, 5}}));
  EXPECT_EQ(reports.messages, std::vector<std::string>{});
}

TEST(Ply, FacesAndStripsAreAddedUp) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 1\nproperty list int int vertex_index\nproperty uchar group\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0 1 0 0 0 1 0 1 1 0\n4 0 1 2 3 7\n3 3 2 0\n";
  EXPECT_EQ(read(text).mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}, {3, 2, 0}}));
}

TEST(Ply, ReadsFixedBytes) {
  static constexpr unsigned char kBody[] = {
      0x00, 0x00, 0x80, 0x3f, 0x00, 0x00, 0x00, 0xc0, 0x00, 0x00, 0x40, 0x40, // 1 -2 3
      0x0a, 0x0d, 0x20, 0x41, 0x00, 0x00, 0x00, 0x00, 0xff, 0xff, 0x7f, 0x7f, // 10.003183 0 FLT_MAX
      0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x80, 0xcd, 0xcc, 0xcc, 0x3d, // smallest denormal, -0, 0.1
      0x03, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00};
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                     "property float z\nelement face 1\nproperty list uint8 int vertex_indices\nend_header\n";
  text.append(reinterpret_cast<const char*>(kBody), sizeof kBody);
  const Mesh mesh = read(text).mesh;
  ASSERT_EQ(mesh.positions.size(), 3u);
  EXPECT_EQ(std::memcmp(mesh.positions.data(), kBody, 36), 0);
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{2, 0, 1}}));
}

TEST(Ply, PolygonsBecomeFansInOrder) {
  for (const Format format : kFormats) {
    Writer writer(format);
    writer.line("element vertex 6").line("property float x").line("property float y").line("property float z");
    writer.line("element face 5").line("property list uchar int vertex_index").line("end_header");
    for (int i = 0; i < 6; ++i) writer.row("float", {i * 1.0, i * i * 1.0, 0});
    writer.list("uchar", "int", {0, 1, 2}).list("uchar", "int", {5, 4, 3, 2}).list("uchar", "int", {0, 1, 2, 3, 4});
    writer.list("uchar", "int", {1, 2}).list("uchar", "int", {3, 1, 5});
    Reports reports;
    const PlyMesh ply = read(writer.text(), &reports);
    EXPECT_EQ(ply.mesh.triangles,
              (std::vector<Triangle>{{0, 1, 2}, {5, 4, 3}, {5, 3, 2}, {0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {3, 1, 5}}));
    EXPECT_EQ(ply.dropped_triangles, 0u);
    ASSERT_EQ(reports.messages.size(), 1u);
    EXPECT_NE(reports.messages[0].find("1 faces have fewer than three"), std::string::npos);
  }
}

TEST(Ply, SkipsWhatItDoesNotKnow) {
  for (const Format format : kFormats) {
    Writer writer(format);
    writer.line("comment made by hand").line("obj_info num_cols 512").line("");
    writer.line("element material 2").line("property uchar red").line("property list ushort double weights");
    writer.line("element camera 1").line("property double fov");
    writer.line("element vertex 3").line("property list uchar short bones").line("property float z");
    writer.line("property uchar alpha").line("property double y").line("property float x").line("property float u");
    writer.line("element nothing 4000000000000");
    writer.line("element face 1").line("property list uchar uint face_indices").line("property short group");
    writer.line("property list uchar int vertex_indices").line("property list uchar float texcoord");
    writer.line("element edge 9").line("property int vertex1").line("end_header");
    writer.put("uchar", 255).list("ushort", "double", {1, 2}).put("uchar", 0).list("ushort", "double", {});
    writer.put("double", 45);
    for (int i = 0; i < 3; ++i) {
      if (i == 1)
        writer.list("uchar", "short", {7, 8});
      else
        writer.list("uchar", "short", {});
      writer.put("float", i).put("uchar", 9).put("double", 10 + i).put("float", 20 + i * i).put("float", 0.5);
    }
    writer.list("uchar", "uint", {77, 78}).put("short", -3).list("uchar", "int", {2, 1, 0});
    writer.list("uchar", "float", {0, 0, 1, 0, 1, 1}); // the body has no edge elements, which are not needed
    const Mesh mesh = read(writer.text()).mesh;
    EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{20, 10, 0}, {21, 11, 1}, {24, 12, 2}}));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{2, 1, 0}}));
    EXPECT_TRUE(mesh.normals.empty());
    EXPECT_TRUE(mesh.uvs.empty()) << "u without v";
  }
}

TEST(Ply, ColoursAreReported) {
  Writer writer(kFormats[0]);
  writer.line("element vertex 3").line("property float x").line("property float y").line("property float z");
  writer.line("property uchar red").line("element face 1").line("property list uchar int vertex_indices");
  writer.line("end_header");
  for (int i = 0; i < 3; ++i) writer.put("float", i).put("float", i * i).put("float", 0).put("uchar", 255);
  writer.list("uchar", "int", {0, 1, 2});
  Reports reports;
  read(writer.text(), &reports);
  ASSERT_EQ(reports.messages.size(), 1u);
  EXPECT_EQ(reports.messages[0], "colours of the element 'vertex' are left out");
}

TEST(Ply, FacesMayComeBeforeVertices) {
  for (const Format format : kFormats) {
    Writer writer(format);
    writer.line("element face 2").line("property list uchar int vertex_indices");
    writer.line("element vertex 3").line("property float x").line("property float y").line("property float z");
    writer.line("end_header").list("uchar", "int", {0, 1, 2}).list("uchar", "int", {0, 2, 3});
    writer.row("float", {0, 0, 0, 1, 0, 0, 0, 1, 0});
    const PlyMesh ply = read(writer.text());
    EXPECT_EQ(ply.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
    EXPECT_EQ(ply.dropped_triangles, 1u) << "vertex 3 does not exist";
  }
}

TEST(Ply, UnderstandsAllNamesOfTextureCoordinates) {
  constexpr std::pair<const char*, const char*> kNames[] = {
      {"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}};
  for (const auto& [first, second] : kNames) {
    Writer writer(Format::kLittle);
    writer.line("element vertex 3").line("property float x").line("property float y").line("property float z");
    writer.line(std::string("property float ") + second).line("property uchar pad");
    writer.line(std::string("property float ") + first);
    writer.line("element face 1").line("property list uchar int vertex_indices").line("end_header");
    for (int i = 0; i < 3; ++i)
      writer.row("float", {i * 1.0, i * i * 1.0, 0, 0.25 * i}).put("uchar", 1).put("float", i);
    writer.list("uchar", "int", {0, 1, 2});
    EXPECT_EQ(read(writer.text()).mesh.uvs, (std::vector<Vec2>{{0, 0}, {1, 0.25f}, {2, 0.5f}})) << first;
  }
}

TEST(Ply, HeaderLinesMayEndInLfCrLfOrCr) {
  for (const Format format : kFormats) {
    const std::string text = square(format);
    const size_t body = text.find("end_header\n") + 11;
    for (const std::string line_end : {"\r\n", "\r"}) {
      std::string other;
      for (const char c : text.substr(0, body)) other += c == '\n' ? line_end : std::string(1, c);
      expect_square(read(other + text.substr(body)));
    }
  }
  // If lines end in CR alone, a line feed after the header belongs to the data.
  Writer writer(Format::kLittle);
  writer.line("element vertex 3").line("property uchar x").line("property uchar y").line("property uchar z");
  writer.line("element face 1").line("property list uchar uchar vertex_indices").line("end_header");
  std::string text = writer.text();
  std::replace(text.begin(), text.end(), '\n', '\r');
  text += std::string("\n\0\0\1\0\0\2\1\0\3\0\1\2", 13);
  EXPECT_EQ(read(text).mesh.positions[0], Vec3(10, 0, 0));
}

TEST(Ply, AsciiNumbersAreReadToTheLastBit) {
  const std::string header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                             "property double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const Mesh mesh = read(header + "0.1 -1e-3 +16777217\r\n\t1e-60 3.4028235e38 1.4e-45\n\n-0 007 .5 3 0 1 2").mesh;
  EXPECT_EQ(mesh.positions[0], Vec3(0.1f, -1e-3f, 16777216.0f));
  EXPECT_EQ(mesh.positions[1], Vec3(0.0f, std::numeric_limits<float>::max(), std::numeric_limits<float>::denorm_min()));
  EXPECT_EQ(mesh.positions[2], Vec3(0.0f, 7.0f, 0.5f));
  EXPECT_NE(error_of(header + "0 0 0 1 0 0 0 1,5 0 3 0 1 2").find("line 10: expected a number, found \"1,5\""),
            std::string::npos);
  Reports reports;
  EXPECT_EQ(read(header + "nan 0 0 1 0 1e400 -inf 1 0 3 0 1 2", &reports).dropped_triangles, 1u);
  EXPECT_EQ(reports.messages.size(), 1u);
}

std::string slurp(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Number of triangles in the existing PLY files that the plymesh lines of a scene file name.
uint64_t count_scene_triangles(const std::filesystem::path& folder) {
  std::ifstream scene(folder / "scene.pbrt");
  uint64_t count = 0;
  for (std::string line; std::getline(scene, line);) {
    const size_t shape = line.find("Shape \"plymesh\""), begin = line.find("models/");
    if (shape == line.npos || begin == line.npos || line.find('#') < shape) continue;
    const std::filesystem::path file = folder / line.substr(begin, line.find('"', begin) - begin);
    if (std::filesystem::exists(file)) count += read(slurp(file)).mesh.triangles.size();
  }
  return count;
}

TEST(Ply, RealScenesHaveTheirReferenceTriangleCounts) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const char* const scenes = std::getenv("PACKTRACE_SCENES");
  if (!scenes) GTEST_SKIP() << "PACKTRACE_SCENES is not set";
  EXPECT_EQ(count_scene_triangles(std::filesystem::path(scenes) / "house"), 1571178u);
  EXPECT_EQ(count_scene_triangles(std::filesystem::path(scenes) / "spaceship"), 318558u);
  const Mesh bunny = read(slurp(std::filesystem::path(scenes) / "bunny/bun_zipper.ply")).mesh;
  EXPECT_EQ(bunny.triangles.size(), 69451u);
  EXPECT_EQ(bunny.positions[0], Vec3(-0.0378297f, 0.12794f, 0.00447467f));
}

} // namespace
} // namespace packtrace::ply_test
