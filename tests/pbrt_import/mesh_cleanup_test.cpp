#include "pbrt_import/shapes/mesh_cleanup.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

namespace packtrace {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Report {
  Severity severity;
  std::string message;
};

class MeshCleanup : public testing::Test {
protected:
  uint64_t clean(Mesh& mesh) {
    reports_.clear();
    return clean_up_mesh(mesh, [this](Severity severity, uint32_t line, std::string message) {
      EXPECT_EQ(line, 0u);
      reports_.push_back({severity, std::move(message)});
    });
  }
  std::vector<Report> reports_;
};

Mesh square() {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TEST_F(MeshCleanup, LeavesAGoodMeshAlone) {
  Mesh mesh = square();
  mesh.normals.assign(4, Vec3(0.6f, 0.0f, 0.8f));
  mesh.uvs.assign(4, Vec2(0.25f));
  EXPECT_EQ(clean(mesh), 0u);
  EXPECT_EQ(mesh.positions, square().positions);
  EXPECT_EQ(mesh.triangles, square().triangles);
  EXPECT_EQ(mesh.normals, std::vector<Vec3>(4, Vec3(0.6f, 0.0f, 0.8f)));
  EXPECT_TRUE(reports_.empty());
}

TEST_F(MeshCleanup, DropsEachKindWithOneReport) {
  Mesh mesh = square();
  mesh.positions.insert(mesh.positions.end(), {{kNan, 0, 0}, {0, kInfinity, 0}, {0, 0, -kInfinity}});
  mesh.triangles = {{0, 1, 2}, {0, 1, 7}, {0, 1, ~0u}, {2, 2, 3}, {0, 1, 4},
                    {0, 5, 1}, {6, 0, 1}, {0, 2, 3},   {3, 1, 3}};
  EXPECT_EQ(clean(mesh), 7u);
  EXPECT_EQ(mesh.triangles, square().triangles);
  EXPECT_EQ(mesh.positions, square().positions) << "vertices that only bad triangles used are gone";
  ASSERT_EQ(reports_.size(), 3u);
  EXPECT_EQ(reports_[0].message, "2 triangles (the first is number 1) dropped: vertex index out of range");
  EXPECT_EQ(reports_[1].message, "2 triangles (the first is number 3) dropped: repeated vertex index");
  EXPECT_EQ(reports_[2].message, "3 triangles (the first is number 4) dropped: vertex position not finite");
  for (const Report& report : reports_) EXPECT_EQ(report.severity, Severity::kWarning);
}

TEST_F(MeshCleanup, KeepsTrianglesWithoutAreaButSaysSo) {
  Mesh mesh = square();
  mesh.positions.push_back(mesh.positions[1]);
  mesh.triangles.push_back({1, 2, 4});
  EXPECT_EQ(clean(mesh), 0u);
  EXPECT_EQ(mesh.triangles.size(), 3u);
  ASSERT_EQ(reports_.size(), 1u);
  EXPECT_EQ(reports_[0].severity, Severity::kNote);
  EXPECT_EQ(reports_[0].message, "1 triangle (number 2) without area kept: two corners coincide");
}

TEST_F(MeshCleanup, RemovesUnusedVerticesInOrder) {
  Mesh mesh;
  for (int i = 0; i < 6; ++i) {
    mesh.positions.emplace_back(i, i * i, 0);
    mesh.normals.emplace_back(i % 2, (i + 1) % 2, 0);
    mesh.uvs.emplace_back(i, -i);
  }
  mesh.triangles = {{5, 1, 4}};
  EXPECT_EQ(clean(mesh), 0u);
  EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{1, 1, 0}, {4, 16, 0}, {5, 25, 0}}));
  EXPECT_EQ(mesh.normals, (std::vector<Vec3>{{1, 0, 0}, {0, 1, 0}, {1, 0, 0}}));
  EXPECT_EQ(mesh.uvs, (std::vector<Vec2>{{1, -1}, {4, -4}, {5, -5}}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{2, 0, 1}}));
}

TEST_F(MeshCleanup, NormalsBecomeUnitLength) {
  Mesh mesh = square();
  mesh.normals = {{0, 0, 5}, {1e30f, 0, 0}, {0, -1e-30f, 0}, {3, 0, 4}};
  clean(mesh);
  EXPECT_EQ(mesh.normals, (std::vector<Vec3>{{0, 0, 1}, {1, 0, 0}, {0, -1, 0}, {0.6f, 0, 0.8f}}));
  EXPECT_TRUE(reports_.empty());
}

TEST_F(MeshCleanup, BadNormalsAreRecomputedFromTheFacesAround) {
  Mesh mesh = square();
  mesh.positions[3] = {0, 0, 2}; // the second triangle has twice the area of the first and another orientation
  mesh.normals = {{0, 0, 0}, {kNan, 0, 1}, {0, 1, 0}, {0, kInfinity, 0}};
  clean(mesh);
  const Vec3 first(0, 0, 1), second(2, -2, 0);
  EXPECT_NEAR(glm::distance(mesh.normals[0], glm::normalize(first + second)), 0.0f, 1e-6f);
  EXPECT_EQ(mesh.normals[1], first);
  EXPECT_EQ(mesh.normals[2], Vec3(0, 1, 0));
  EXPECT_NEAR(glm::distance(mesh.normals[3], glm::normalize(second)), 0.0f, 1e-6f);
  ASSERT_EQ(reports_.size(), 1u);
  EXPECT_EQ(reports_[0].message,
            "3 vertex normals (the first is number 0) zero or not finite: recomputed from the faces around");
}

TEST_F(MeshCleanup, AttributesOfTheWrongLengthAreIgnored) {
  Mesh mesh = square();
  mesh.normals.assign(3, Vec3(0, 0, 1));
  mesh.uvs.assign(5, Vec2(0));
  clean(mesh);
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_TRUE(mesh.uvs.empty());
  ASSERT_EQ(reports_.size(), 2u);
  EXPECT_EQ(reports_[0].message, "3 normals for 4 vertices: ignored");
}

TEST_F(MeshCleanup, UvsThatAreNotFiniteBecomeZero) {
  Mesh mesh = square();
  mesh.uvs = {{0.5f, 0.5f}, {kNan, 1}, {1, kInfinity}, {1, 1}};
  clean(mesh);
  EXPECT_EQ(mesh.uvs, (std::vector<Vec2>{{0.5f, 0.5f}, {0, 0}, {0, 0}, {1, 1}}));
  EXPECT_EQ(reports_.size(), 1u);
}

TEST_F(MeshCleanup, LargeMeshesAreCheckedLikeSmallOnes) {
  constexpr uint32_t kVertices = 100'000, kLost = 50'000; // enough for several parallel pieces
  Mesh mesh;
  for (uint32_t i = 0; i < kVertices; ++i) mesh.positions.emplace_back(i, i % 2, 0);
  for (uint32_t i = 0; i + 2 < kVertices; ++i) mesh.triangles.emplace_back(i, i + 1, i + 2);
  mesh.normals.assign(kVertices, Vec3(0, 0, 2));
  mesh.uvs.assign(kVertices, Vec2(0.5f));
  std::vector<Triangle> expected;
  for (Triangle t : mesh.triangles) {
    if (t.x == 40'000 || t.x == 70'001 || t.x == 70'003 || (t.x <= kLost && kLost <= t.z)) continue;
    for (int k = 0; k < 3; ++k) t[k] -= t[k] > kLost;
    expected.push_back(t);
  }
  mesh.triangles[40'000].y = kVertices;
  mesh.triangles[70'001].y = mesh.triangles[70'001].z;
  mesh.triangles[70'003].y = mesh.triangles[70'003].x;
  mesh.positions[kLost].z = kNan;
  mesh.normals[33'000] = mesh.normals[80'000] = Vec3(0.0f);
  mesh.uvs[34'000].x = mesh.uvs[99'999].y = kInfinity;
  EXPECT_EQ(clean(mesh), 6u);
  EXPECT_TRUE(mesh.triangles == expected);
  EXPECT_EQ(mesh.positions.size(), kVertices - 1);
  EXPECT_EQ(mesh.positions[kLost], Vec3(kLost + 1, 1, 0));
  EXPECT_EQ(std::count(mesh.normals.begin(), mesh.normals.end(), Vec3(0, 0, 1)) +
                std::count(mesh.normals.begin(), mesh.normals.end(), Vec3(0, 0, -1)),
            kVertices - 1);
  EXPECT_EQ(std::count(mesh.uvs.begin(), mesh.uvs.end(), Vec2(0.5f)), kVertices - 3);
  ASSERT_EQ(reports_.size(), 5u);
  EXPECT_EQ(reports_[0].message, "1 triangle (number 40000) dropped: vertex index out of range");
  EXPECT_EQ(reports_[1].message, "2 triangles (the first is number 70001) dropped: repeated vertex index");
  EXPECT_EQ(reports_[2].message, "3 triangles (the first is number 49998) dropped: vertex position not finite");
  EXPECT_EQ(reports_[3].message,
            "2 vertex normals (the first is number 33000) zero or not finite: recomputed from the faces around");
  EXPECT_EQ(reports_[4].message, "2 uvs (the first is number 34000) not finite: set to zero");
}

TEST_F(MeshCleanup, NothingLeftIsAnEmptyMesh) {
  Mesh mesh = square();
  mesh.triangles = {{0, 0, 1}, {9, 8, 7}};
  EXPECT_EQ(clean(mesh), 2u);
  EXPECT_TRUE(mesh.positions.empty() && mesh.triangles.empty());
  Mesh empty;
  EXPECT_EQ(clean_up_mesh(empty, {}), 0u);
}

} // namespace
} // namespace packtrace
