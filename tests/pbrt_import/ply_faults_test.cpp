// Tests PLY files that are cut off, damaged or contradict themselves.

#include <random>
#include <string>

#include <gtest/gtest.h>

#include "tests/pbrt_import/ply_writer.h"

namespace packtrace::ply_test {
namespace {

TEST(Ply, BadStripsAreCounted) {
  Reports reports;
  const PlyMesh ply = read(strips(Format::kAscii, "int", {{0, 1, 2, 99, 3, -2, 4}, {1, 2, -1, 3}, {-1}}), &reports);
  EXPECT_EQ(ply.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  EXPECT_EQ(ply.dropped_triangles, 4u);
  ASSERT_EQ(reports.messages.size(), 2u);
  EXPECT_EQ(reports.messages[0], "2 strips have fewer than three corners: ignored");
}

TEST(Ply, EveryTruncationOfStripsIsRefused) {
  for (const Format format : {Format::kLittle, Format::kBig}) {
    const std::string whole = strips(format, "int", {{0, 1, 2, 3}, {4, 5, 6}});
    for (size_t size = 0; size < whole.size(); ++size) EXPECT_NE(error_of(whole.substr(0, size)), "") << size;
  }
  EXPECT_EQ(error_of(strips(Format::kAscii, "int", {})), "no faces");
}

TEST(Ply, EveryTruncatedPrefixIsAnError) {
  for (const Format format : kFormats) {
    std::string text = square(format);
    if (format == Format::kAscii) text.pop_back(); // the blank after the last number
    for (size_t size = 0; size < text.size(); ++size) EXPECT_NE(error_of(text.substr(0, size)), "") << size;
    EXPECT_EQ(error_of(text), "");
  }
}

TEST(Ply, CountsBeyondTheFileAreRejectedBeforeAllocating) {
  for (const char* count : {"2000000000", "18446744073709551615", "6148914691236517206"}) {
    for (const Format format : kFormats) {
      std::string vertices = square(format), faces = vertices;
      vertices.replace(vertices.find("vertex 4") + 7, 1, count);
      faces.replace(faces.find("face 2") + 5, 1, count);
      EXPECT_NE(error_of(vertices), "") << count;
      EXPECT_NE(error_of(faces), "") << count;
    }
  }
  EXPECT_NE(error_of("ply\nformat ascii 1.0\nelement vertex 18446744073709551616\nend_header\n"), "");
  EXPECT_NE(error_of("ply\nformat ascii 1.0\nelement vertex -3\nend_header\n"), "");
}

TEST(Ply, ListLengthsBeyondTheFileAreRejected) {
  for (const Format format : kFormats) {
    for (const double length : {4294967280.0, 2147483648.0, 40.0}) {
      Writer writer(format);
      writer.line("element vertex 3").line("property float x").line("property float y").line("property float z");
      writer.line("element face 1").line("property list uint int vertex_indices").line("end_header");
      writer.row("float", {0, 0, 0, 1, 0, 0, 0, 1, 0}).put("uint", length).row("int", {0, 1, 2});
      EXPECT_NE(error_of(writer.text()).find("list is longer"), std::string::npos);
    }
    Writer negative(format);
    negative.line("element x 1").line("property list int int nothing");
    negative.line("element vertex 1").line("property float x").line("property float y").line("property float z");
    negative.line("element face 1").line("property list int int vertex_indices").line("end_header").put("int", -1);
    negative.row("float", {0, 0, 0}).list("int", "int", {0, 0, 0});
    EXPECT_NE(error_of(negative.text()).find("not a count"), std::string::npos);
  }
}

TEST(Ply, BadIndicesCostTheirTriangleAndOneReport) {
  for (const Format format : kFormats) {
    for (const char* type : {"int", "double"}) {
      Writer writer(format);
      writer.line("element vertex 4").line("property float x").line("property float y").line("property float z");
      writer.line("element face 5").line(std::string("property list uchar ") + type + " vertex_indices");
      writer.line("end_header").row("float", {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
      writer.list("uchar", type, {0, 1, -1}).list("uchar", type, {0, 1, 2, 4}).list("uchar", type, {0, 2, 2147483647});
      writer.list("uchar", type, {1, 1, 2}).list("uchar", type, {3, 1, 2});
      Reports reports;
      const PlyMesh ply = read(writer.text(), &reports);
      EXPECT_EQ(ply.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 1, 2}}));
      EXPECT_EQ(ply.dropped_triangles, 4u);
      ASSERT_EQ(reports.messages.size(), 2u);
      EXPECT_EQ(reports.messages[0], "3 triangles (the first is number 0) dropped: vertex index out of range");
      EXPECT_EQ(reports.messages[1], "1 triangle (number 4) dropped: repeated vertex index");
    }
  }
}

TEST(Ply, MalformedHeadersAreErrorsWithTheirLine) {
  const std::string ok = square(Format::kAscii);
  EXPECT_EQ(error_of(""), "not a PLY file: it does not begin with 'ply'");
  EXPECT_NE(error_of("plywood\n" + ok), "");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = ok;
    text.replace(text.find(from), from.size(), to);
    return error_of(text);
  };
  EXPECT_EQ(with("ascii", "utf8"), "line 2: unknown format \"utf8\"");
  EXPECT_EQ(with("1.0", "2.0"), "line 2: expected 'format NAME 1.0'");
  EXPECT_EQ(with("format ascii 1.0\n", ""), "line 13: the header has no 'format'");
  EXPECT_EQ(with("float x", "half x"), "line 4: unknown type \"half\"");
  EXPECT_EQ(with("float x", "float x extra"), "line 4: expected 'property TYPE NAME'");
  EXPECT_EQ(with("element vertex 4", "element vertex 4k"), "line 3: expected 'element NAME COUNT'");
  EXPECT_EQ(with("list uchar int", "list float int"), "line 13: the length of a list must have an integer type");
  EXPECT_EQ(with("element face", "elephant face"), "line 12: unknown keyword \"elephant\"");
  EXPECT_EQ(with("float x", "h\x1b[31mf x"), "line 4: unknown type \"h\\x1b[31mf\"")
      << "control bytes must not reach a terminal";
  EXPECT_EQ(with("float x", "float q"), "the vertices have no x, y and z");
  EXPECT_EQ(with("vertex_indices", "face_indices"), "the faces have no list vertex_indices or vertex_index");
  EXPECT_EQ(with("element vertex 4", "element face 0\nelement vertex 4"), "more than one element 'face'");
  EXPECT_EQ(with("element vertex 4", "element vertex 0"), "no vertices");
  EXPECT_EQ(with("element face 2", "element polygon 2"), "no faces");
}

/// Checks that any bytes give an Error or a mesh that fulfils its contract.
void expect_error_or_sound_mesh(const std::string& text) {
  try {
    const Mesh mesh = read(text).mesh;
    EXPECT_LE(mesh.triangles.size(), text.size());
    EXPECT_TRUE(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size());
    EXPECT_TRUE(mesh.uvs.empty() || mesh.uvs.size() == mesh.positions.size());
    for (const Triangle& t : mesh.triangles)
      ASSERT_TRUE(t.x < mesh.positions.size() && t.y < mesh.positions.size() && t.z < mesh.positions.size());
    for (const Vec3& p : mesh.positions) ASSERT_TRUE(is_finite(p));
    for (const Vec3& n : mesh.normals) ASSERT_NEAR(glm::length(n), 1.0f, 1e-5f);
  } catch (const Error&) {
  }
}

TEST(Ply, DamagedFilesNeverGiveABrokenMesh) {
  std::mt19937 random(7);
  for (const Format format : kFormats) {
    const std::string whole = square(format);
    for (int i = 0; i < 4000; ++i) {
      std::string text = whole;
      for (uint32_t flips = 1 + random() % 4; flips > 0; --flips)
        text[random() % text.size()] ^= static_cast<char>(1u << random() % 8);
      if (random() % 4 == 0) text.erase(random() % text.size(), random() % 8);
      expect_error_or_sound_mesh(text);
    }
  }
}

} // namespace
} // namespace packtrace::ply_test
