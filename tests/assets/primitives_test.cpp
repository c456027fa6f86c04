#include <array>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "assets/generator/boats.h"
#include "assets/generator/facade.h"
#include "assets/generator/foliage.h"
#include "assets/generator/house.h"
#include "assets/generator/masonry.h"
#include "assets/generator/primitives.h"
#include "assets/generator/props.h"

namespace packtrace::scenegen {
namespace {

double signed_volume(const Mesh& mesh) {
  double sum = 0.0;
  for (const Triangle& t : mesh.triangles) {
    const DVec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
    sum += glm::dot(a, glm::cross(b, c)) / 6.0;
  }
  return sum;
}

/// Every directed edge is met by exactly one in the other direction.
bool is_closed(const Mesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  for (const Triangle& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    const auto twin = edges.find({edge.second, edge.first});
    if (count != 1 || twin == edges.end()) return false;
  }
  return !edges.empty();
}

const DAffine kTurned = compose(translation({3, -2, 5}), compose(rotation_x(0.7), rotation_z(-1.1)));

TEST(Primitives, BoxIsClosedAndFacesOut) {
  Mesh mesh;
  add_box(mesh, kTurned, {-1, 0, -2}, {1, 3, 2});
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(signed_volume(mesh), 24.0, 1e-4);
}

TEST(Primitives, LatheIsClosedAndFacesOut) {
  Mesh mesh;
  const glm::dvec2 profile[] = {{0, 0}, {1, 0}, {1, 2}, {0, 2}};
  add_lathe(mesh, kTurned, profile, 64);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(signed_volume(mesh), 2.0 * kPi, 0.02);
}

TEST(Primitives, TubeIsClosedAndFacesOutAlongABend) {
  Mesh mesh;
  const DVec3 path[] = {{0, 0, 0}, {0, 1, 0}, {1, 2, 0}, {1, 2, 3}};
  const double radii[] = {0.2, 0.2, 0.15, 0.1};
  add_tube(mesh, path, radii, 8);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_GT(signed_volume(mesh), 0.1);
}

TEST(Primitives, BlobIsClosedAndFacesOut) {
  Mesh mesh;
  add_blob(mesh, kTurned, 16, [](DVec3) { return 0.0; });
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(signed_volume(mesh), 4.0 / 3.0 * kPi, 0.05);
}

TEST(Primitives, QuadsThatRunToAPointLeaveNoEmptyTriangle) {
  Mesh mesh;
  add_quad(mesh, {0, 0, 0}, {0, 1, 0}, {0, 1, 0}, {1, 0, 0});
  EXPECT_EQ(mesh.triangles.size(), 1u);
}

TEST(Facade, WallAndOpeningsShareTheArea) {
  Model model;
  const Opening holes[] = {{OpeningKind::kRecess, 1.0, 1.0, 2.0, 2.5, false},
                           {OpeningKind::kRecess, 3.0, 1.2, 4.0, 2.0, false}};
  add_facade(model, DAffine(1.0), 5.0, 3.0, holes);
  double area = 0.0; // of everything in the wall's own plane, facing -z
  const Mesh& wall = model.flat("wall");
  for (const Triangle& t : wall.triangles) {
    const DVec3 a(wall.positions[t.x]), b(wall.positions[t.y]), c(wall.positions[t.z]);
    if (a.z == 0.0 && b.z == 0.0 && c.z == 0.0) area -= glm::cross(b - a, c - a).z / 2.0;
  }
  EXPECT_NEAR(area, 15.0 - 1.5 - 0.8, 1e-5);
}

/// What every importer is entitled to: indices in range, finite positions, no triangle without area by its corners,
/// unit normals.
void expect_sound(const Model& model, const char* what) {
  SCOPED_TRACE(what);
  EXPECT_GT(model.triangle_count(), 0u);
  for (const ModelPart& part : model.parts()) {
    const Mesh& mesh = part.mesh;
    EXPECT_EQ(mesh.normals.size(), part.smooth ? mesh.positions.size() : 0u) << part.material;
    for (const Vec3& p : mesh.positions) ASSERT_TRUE(is_finite(p)) << part.material;
    for (const Vec3& n : mesh.normals) ASSERT_NEAR(glm::length(n), 1.0f, 1e-5f) << part.material;
    for (const Triangle& t : mesh.triangles) {
      ASSERT_LT(std::max({t.x, t.y, t.z}), mesh.positions.size()) << part.material;
      ASSERT_TRUE(mesh.positions[t.x] != mesh.positions[t.y] && mesh.positions[t.y] != mesh.positions[t.z] &&
                  mesh.positions[t.z] != mesh.positions[t.x])
          << part.material;
    }
  }
}

TEST(Models, AreSound) {
  Random random(9);
  expect_sound(make_broadleaf(random, 1.0), "broadleaf");
  expect_sound(make_cypress(random, 1.0), "cypress");
  expect_sound(make_umbrella_pine(random, 1.0), "umbrella pine");
  expect_sound(make_olive(random, 1.0), "olive");
  expect_sound(make_conifer(random, 1.0), "conifer");
  expect_sound(make_palm(random, 1.0), "palm");
  expect_sound(make_blossom_bush(random, 1.0), "blossom bush");
  expect_sound(make_rowing_boat(random), "rowing boat");
  expect_sound(make_fishing_boat(random), "fishing boat");
  expect_sound(make_sailing_boat(random), "sailing boat");
  expect_sound(make_church(random), "church");
  expect_sound(make_lighthouse(random), "lighthouse");
  expect_sound(make_windmill(random), "windmill");
  expect_sound(make_market_stall(random), "market stall");
  expect_sound(make_laundry(random), "laundry");
  expect_sound(make_rope_coil(), "rope coil");
  expect_sound(make_pier(random), "pier");
  expect_sound(make_stairs(21, 0.2, 0.27, 2.2), "stairs");
  for (const RoofKind roof : {RoofKind::kGable, RoofKind::kGableToFront, RoofKind::kHip, RoofKind::kTerrace}) {
    for (const double depth : {5.0, 9.0}) { // hips run either way
      expect_sound(make_house({7.0, depth, 3, 3, roof, true, true, true}, random).model, "house");
    }
  }
}

} // namespace
} // namespace packtrace::scenegen
