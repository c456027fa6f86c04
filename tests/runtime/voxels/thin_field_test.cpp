#include <array>

#include <gtest/gtest.h>

#include "compress/bake/proxies/geometry_field.h"
#include "runtime/voxels/field_tracer.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

void add_box(Mesh& mesh, Vec3 lo, Vec3 hi) {
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (int c = 0; c < 8; ++c)
    mesh.positions.push_back({(c & 1) != 0 ? hi.x : lo.x, (c & 2) != 0 ? hi.y : lo.y, (c & 4) != 0 ? hi.z : lo.z});
  constexpr std::array<std::array<uint32_t, 4>, 6> kSides = {
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& s : kSides) {
    mesh.triangles.push_back({first + s[0], first + s[1], first + s[2]});
    mesh.triangles.push_back({first + s[0], first + s[2], first + s[3]});
  }
}

GeometryField built_of(const Mesh& mesh) {
  const BakedFile file = BakedFile::from_bytes(test::bake(test::scene_of(mesh)).bytes);
  const OccludingTriangles source = occluding_triangles(file, 0, material_runs(file.sections())[0]);
  EXPECT_TRUE(source.closed);
  ProxyConfig config;
  config.voxels = 16, config.field_bits = 16;
  return build_field(source, config, MemoryBudget(), "test");
}

TEST(ThinField, ClosedPartsThinnerThanAVoxelStayVisible) {
  Mesh mesh;
  add_box(mesh, Vec3(0.0f), Vec3(1.0f, 1.0f, 0.5f));
  EXPECT_TRUE(built_of(mesh).has_sign);                            // in spite of its edges and corners
  add_box(mesh, Vec3(0.0f, 0.0f, 0.78f), Vec3(1.0f, 1.0f, 0.80f)); // a third of a voxel
  const GeometryField built = built_of(mesh);
  EXPECT_FALSE(built.has_sign);
  const FieldTracer tracer(built.field, built.has_sign);
  const auto grid = [&](DVec3 p) { return (p - built.origin) / built.edge; };
  for (double x = 0.1; x < 0.95; x += 0.0137)
    for (double y = 0.1; y < 0.95; y += 0.0171) {
      const auto hit = tracer.first_hit(grid({x, y, 1.2}), {0.0, 0.0, -1.0}, 0.0, 100.0);
      ASSERT_TRUE(hit);
      ASSERT_NEAR(1.2 - hit->t * built.edge, 0.8, built.edge); // the thin wall, not what is below it
    }
}

} // namespace
} // namespace packtrace
