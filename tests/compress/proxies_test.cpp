#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compress/bake/proxies/build_proxies.h"
#include "compress/bake/proxies/geometry_voxels.h"
#include "compress/format/file/file_summary.h"
#include "compress/format/voxels/proxy_section.h"
#include "tests/compress/file_damage.h"
#include "tests/compress/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

BakeConfig proxy_config(uint32_t voxels = 40) {
  BakeConfig config;
  config.proxy.use = ProxyUse::kVoxels;
  config.proxy.voxels = voxels;
  return config;
}

std::vector<Proxy> proxies_of(const BakedScene& baked) {
  return read_proxies(proxy_bytes(BakedFile::from_bytes(baked.bytes)));
}

TEST(Proxies, ErrorsOfConservativeVoxelsStayWithinHalfADiagonal) {
  for (const uint32_t voxels : {1u, 7u, 40u, 100u}) {
    const std::vector<Proxy> proxies =
        proxies_of(test::bake(test::scene_of(test::sphere_mesh(40)), proxy_config(voxels)));
    ASSERT_EQ(proxies.size(), 1u);
    const voxels::ProxyRecord& r = proxies[0].record;
    const double half_diagonal = 0.5 * std::sqrt(3.0) * r.edge;
    EXPECT_NEAR(r.edge, 2.0 / voxels, 0.02 / voxels);
    EXPECT_LE(r.surface_error, half_diagonal * (1 + 1e-9));
    EXPECT_LE(r.voxel_error, half_diagonal * (1 + 1e-6));
    EXPECT_GT(r.surface_error, 0.3 * half_diagonal);
    EXPECT_GT(r.voxel_error, 0.3 * half_diagonal);
    EXPECT_NE(r.flags & voxels::kClosedSource, 0u);
  }
}

TEST(Proxies, StatedErrorsHoldForAnIndependentSample) {
  BakeConfig config = proxy_config(30);
  for (const VoxelRule rule : {VoxelRule::kConservative, VoxelRule::kSeparating}) {
    config.proxy.rule = rule;
    const BakedScene baked = test::bake(test::scene_of(test::sphere_mesh(60)), config);
    const Proxy proxy = proxies_of(baked).at(0);
    const VoxelSet set = decode_occupancy(proxy.voxels);
    std::vector<DVec3> centers;
    set.for_each([&](VoxelIndex v) {
      centers.push_back(proxy.frame().center(v));
      EXPECT_LE(std::abs(glm::length(centers.back()) - 1.0), proxy.record.voxel_error + 0.003); // facets of the sphere
    });
    test::Random random(5);
    for (int i = 0; i < 2000; ++i) {
      const DVec3 p = glm::normalize(DVec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)) + 1e-9);
      double nearest = 1e300;
      for (const DVec3& c : centers) nearest = std::min(nearest, glm::distance(c, p));
      EXPECT_LE(nearest, proxy.record.surface_error * 1.02 + 0.003);
    }
  }
}

/// Mean area that a set hides, in object units squared, from random lines within a radius of the origin.
double hidden_area(const Proxy& proxy, double radius) {
  const VoxelSet set = decode_occupancy(proxy.voxels);
  test::Random random(11);
  constexpr uint32_t kLines = 15000;
  uint32_t met = 0;
  for (uint32_t n = 0; n < kLines; ++n) {
    DVec3 along(2.0), aside(2.0);
    while (!(glm::length(along) <= 1.0)) along = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    while (!(glm::length(aside) <= 1.0)) aside = {random.uniform(-1, 1), random.uniform(-1, 1), 0.0};
    along = glm::normalize(along);
    const DVec3 right = glm::normalize(glm::cross(along, DVec3(0.3, 0.5, 0.8))), up = glm::cross(along, right);
    for (double t = -radius; t < radius; t += 0.1 * proxy.record.edge) {
      const DVec3 p = radius * (aside.x * right + aside.y * up) + t * along;
      const DVec3 v = glm::floor((p - proxy.frame().origin) / proxy.record.edge);
      if (!set.contains(static_cast<int64_t>(v.x), static_cast<int64_t>(v.y), static_cast<int64_t>(v.z))) continue;
      ++met;
      break;
    }
  }
  return 3.14159265 * radius * radius * met / kLines;
}

TEST(Proxies, MatchedVoxelsHideWhatTheTrianglesHide) {
  BakeConfig config = proxy_config(12), conservative = config;
  config.proxy.rule = VoxelRule::kMatched;
  const Scene ball = test::scene_of(test::sphere_mesh(40)), sheet = test::scene_of(test::grid_mesh(4));
  const Proxy matched = proxies_of(test::bake(ball, config)).at(0);
  EXPECT_EQ(matched.record.flags, voxels::kMatched | voxels::kFilled | voxels::kClosedSource);
  EXPECT_NEAR(hidden_area(matched, 1.3), 3.14159265, 0.03 * 3.14159265);
  EXPECT_GT(hidden_area(proxies_of(test::bake(ball, conservative)).at(0), 1.3), 1.15 * 3.14159265);
  // By Cauchy's formula, a sheet of area 1 hides 1 / 2.
  const Proxy open = proxies_of(test::bake(sheet, config)).at(0);
  EXPECT_EQ(open.record.flags, voxels::kMatched);
  EXPECT_NEAR(hidden_area(open, 1.5), 0.5, 0.03);
  EXPECT_GT(hidden_area(proxies_of(test::bake(sheet, conservative)).at(0), 1.5), 0.55);
}

/// Two closed slabs far thinner than a voxel beside a ball that erosion alone would match.
TEST(Proxies, MatchedVoxelsAreNearEverySurface) {
  Mesh mesh = test::sphere_mesh(40);
  mesh.normals.clear(), mesh.uvs.clear();
  const auto add = [&](std::array<Vec3, 3> corners) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), corners.begin(), corners.end());
    mesh.triangles.emplace_back(first, first + 1, first + 2);
    mesh.triangles.emplace_back(first, first + 2, first + 1); // every edge twice: closed
  };
  add({Vec3(2, 0, 0), Vec3(4, 0, 0), Vec3(4, 0.01f, 0)});
  add({Vec3(2, 0, 2), Vec3(2, 0.01f, 4), Vec3(2, 0, 4)});
  BakeConfig config = proxy_config(20);
  config.proxy.rule = VoxelRule::kMatched;
  const Proxy proxy = proxies_of(test::bake(test::scene_of(mesh), config)).at(0);
  EXPECT_NE(proxy.record.flags & voxels::kFilled, 0u);
  EXPECT_LE(proxy.record.surface_error, 1.5 * std::sqrt(3.0) * proxy.record.edge);
}

/// A triangle in the corner of a voxel does not touch the octahedron that the separating rule tests.
TEST(Proxies, SmallPartsFarFromOthersHaveAVoxel) {
  Mesh mesh = test::sphere_mesh(40);
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (const Vec3 p : {Vec3(-1, -1, -1), Vec3(-0.995f, -1, -1), Vec3(-1, -0.995f, -1)}) mesh.positions.push_back(p);
  if (!mesh.normals.empty()) mesh.normals.resize(mesh.positions.size(), Vec3(0, 0, -1));
  if (!mesh.uvs.empty()) mesh.uvs.resize(mesh.positions.size());
  mesh.triangles.emplace_back(first, first + 2, first + 1);
  BakeConfig config = proxy_config(40);
  config.proxy.rule = VoxelRule::kSeparating;
  const Proxy proxy = proxies_of(test::bake(test::scene_of(mesh), config)).at(0);
  EXPECT_TRUE(decode_occupancy(proxy.voxels).contains(0, 0, 0));
  EXPECT_LE(proxy.record.surface_error, std::sqrt(3.0) * proxy.record.edge);
}

TEST(Proxies, ClosedGeometriesAreFilledAndOpenOnesReported) {
  BakeConfig config = proxy_config();
  config.proxy.fill = true;
  const BakedScene closed = test::bake(test::scene_of(test::sphere_mesh(40)), config);
  EXPECT_TRUE(closed.report.warnings.empty());
  const Proxy ball = proxies_of(closed).at(0);
  EXPECT_NE(ball.record.flags & voxels::kFilled, 0u);
  EXPECT_TRUE(ball.voxels.test({20, 20, 20}));
  EXPECT_NEAR(static_cast<double>(decode_occupancy(ball.voxels).count()), 4.18879 * 8000 * 1.11, 1500);

  const BakedScene open = test::bake(test::scene_of(test::grid_mesh(20, 0.3f)), config);
  ASSERT_EQ(open.report.warnings.size(), 1u);
  EXPECT_NE(open.report.warnings[0].find("1 of 1 geometries are not closed"), std::string::npos);
  EXPECT_EQ(proxies_of(open).at(0).record.flags & (voxels::kFilled | voxels::kClosedSource), 0u);
}

TEST(Proxies, GeometryThatOccludesNothingGetsNone) {
  Scene scene = test::scene_of(test::sphere_mesh(10));
  for (Material& material : scene.materials) material.flags |= kTransmissive;
  const BakedScene baked = test::bake(scene, proxy_config());
  EXPECT_TRUE(proxies_of(baked).empty());
  ASSERT_EQ(baked.report.warnings.size(), 1u);
  EXPECT_NE(baked.report.warnings[0].find("nothing that occludes"), std::string::npos);
  EXPECT_TRUE(proxies_of(test::bake(Scene{}, proxy_config())).empty());
}

TEST(Proxies, GeometriesWithoutTrianglesAreSaid) {
  Mesh point;
  point.positions = {Vec3(1.0f), Vec3(1.0f), Vec3(1.0f)};
  point.triangles = {Triangle(0, 1, 2)};
  BakeConfig config;
  config.proxy.use = ProxyUse::kVoxels;
  const std::vector<std::string> warnings = test::bake(test::scene_of(point), config).report.warnings;
  EXPECT_TRUE(std::ranges::any_of(
      warnings, [](const std::string& warning) { return warning.find("gets no proxy") != std::string::npos; }));
}

TEST(Proxies, FlatGeometryHasOneLayerOfVoxels) {
  const Proxy proxy = proxies_of(test::bake(test::scene_of(test::grid_mesh(4)), proxy_config(16))).at(0);
  EXPECT_EQ(proxy.voxels.size(), (VoxelIndex{16, 16, 1}));
  EXPECT_EQ(decode_occupancy(proxy.voxels).count(), 256u);
}

TEST(Proxies, VoxelsOfSharedNodesAndOfFullCellsAreCounted) {
  BakeConfig config = proxy_config(64);
  config.proxy.dag = true;
  const BakedFile flat = BakedFile::from_bytes(test::bake(test::scene_of(test::grid_mesh(4)), config).bytes);
  const ProxySummary shared = summarize(flat).proxies.at(0);
  EXPECT_EQ(shared.voxels, 64u * 64u);
  EXPECT_LT(shared.stored_voxels * 4, shared.voxels);
  config.proxy.dag = false, config.proxy.fill = true;
  const BakedFile ball = BakedFile::from_bytes(test::bake(test::scene_of(test::sphere_mesh(40)), config).bytes);
  const ProxySummary filled = summarize(ball).proxies.at(0);
  EXPECT_EQ(filled.voxels, decode_occupancy(read_proxies(proxy_bytes(ball)).at(0).voxels).count());
  EXPECT_LT(filled.stored_voxels * 2, filled.voxels);
}

TEST(Proxies, MasksLeaveHoles) {
  const Scene scene = test::mixed_scene();
  const BakedScene baked = test::bake(scene, proxy_config(64));
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const std::vector<std::vector<uint32_t>> runs = material_runs(file.sections());
  uint64_t masked = 0;
  for (uint32_t g = 0; g < file.base_geometry_count(); ++g) {
    OccludingTriangles source = occluding_triangles(file, g, runs[g]);
    std::erase_if(source.triangles, [](const OccludingTriangle& t) { return !t.masked; });
    if (source.triangles.empty()) continue;
    ProxyConfig config;
    config.voxels = test::sanitized() ? 100 : 200;
    const uint64_t with = voxelize(file, runs[g], source, config, MemoryBudget(), "masked").set.count();
    for (OccludingTriangle& t : source.triangles) t.masked = false;
    const uint64_t without = voxelize(file, runs[g], source, config, MemoryBudget(), "masked").set.count();
    EXPECT_LT(with * 10, without * 9);
    EXPECT_GT(with, 0u);
    ++masked;
  }
  EXPECT_GT(masked, 0u);
}

TEST(Proxies, MaterialsBecomeSwatches) {
  Scene scene = test::scene_of(test::sphere_mesh(30));
  scene.materials[0].albedo = Vec3(1, 0, 0);
  BakeConfig config = proxy_config();
  config.proxy.materials = true;
  const Proxy proxy = proxies_of(test::bake(scene, config)).at(0);
  ASSERT_EQ(proxy.palette.size(), 1u);
  EXPECT_EQ(proxy.palette[0], 0xffu);
}

TEST(Proxies, AGridBeyondTheMemoryNamesTheLargestThatFits) {
  const BakedFile file = BakedFile::from_bytes(test::bake(test::scene_of(test::sphere_mesh(10))).bytes);
  ProxyConfig config;
  config.use = ProxyUse::kVoxels;
  config.voxels = 4096;
  Progress progress;
  const MemoryBudget budget(uint64_t{64} << 20);
  std::string message;
  try {
    build_proxies(file, config, budget, progress, [](const std::string&) {});
  } catch (const MemoryError& error) {
    message = error.what();
  }
  const size_t at = message.find("the largest that fits is --proxy-voxels ");
  ASSERT_NE(at, std::string::npos) << message;
  const auto largest = static_cast<uint32_t>(std::stoul(message.substr(at + 40)));
  config.voxels = largest;
  EXPECT_NO_THROW(build_proxies(file, config, budget, progress, [](const std::string&) {}));
  config.voxels = largest + 1;
  EXPECT_THROW(build_proxies(file, config, budget, progress, [](const std::string&) {}), MemoryError);
  config.voxels = 4097;
  EXPECT_THROW(build_proxies(file, config, budget, progress, [](const std::string&) {}), Error);
}

TEST(Proxies, EveryPrefixAndEveryChangedByteOfTheStreamIsHandled) {
  Scene scene = test::mixed_scene();
  BakeConfig config = proxy_config(12);
  config.proxy.materials = true;
  const BakedScene baked = test::bake(scene, config);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const std::span<const uint8_t> bytes = proxy_bytes(file);
  const std::vector<uint8_t> stream(bytes.begin(), bytes.end());
  EXPECT_EQ(find_proxy_fault(stream, file.geometries().size()), std::nullopt);
  EXPECT_NE(find_proxy_fault(stream, 0), std::nullopt);
  for (size_t n = 0; n < stream.size(); ++n)
    EXPECT_NE(find_proxy_fault(std::span(stream).first(n), ~0ull), std::nullopt) << n;
  uint64_t accepted = 0;
  for (size_t bit = 0; bit < 8 * stream.size(); ++bit) {
    std::vector<uint8_t> changed = stream;
    changed[bit / 8] ^= static_cast<uint8_t>(1u << (bit % 8));
    if (find_proxy_fault(changed, ~0ull)) continue;
    ++accepted;
    for (const Proxy& proxy : read_proxies(changed)) EXPECT_GT(proxy.voxels.size()[0], 0u);
  }
  EXPECT_LT(accepted, 8 * stream.size() / 2);
}

TEST(Proxies, ADamagedProxyIsAFaultOfTheFile) {
  const BakedScene baked = test::bake(test::scene_of(test::sphere_mesh(10)), proxy_config(20));
  std::vector<std::byte> bytes = baked.bytes;
  baked::FileHeader header;
  std::memcpy(&header, bytes.data(), sizeof header);
  const size_t end = header.sections[baked::kTextureBytes].bytes;
  EXPECT_NE(test::message_after(bytes, baked::kTextureBytes, end - 8, 1u << 30).find("proxies 0: extent"),
            std::string::npos);
  EXPECT_NE(test::message_after(bytes, baked::kTextureBytes, 8, 77).find("proxies 0: geometry"), std::string::npos);
}

TEST(Proxies, OtherPartsOfTheFileStayAsTheyAre) {
  const Scene scene = test::mixed_scene();
  for (const PageCodec codec : {PageCodec::kNone, PageCodec::kSmall}) {
    BakeConfig config = proxy_config(16);
    config.codec = codec;
    const BakedFile with = BakedFile::from_bytes(test::bake(scene, config).bytes);
    config.proxy.use = ProxyUse::kOff;
    const BakedFile without = BakedFile::from_bytes(test::bake(scene, config).bytes);
    EXPECT_TRUE(proxy_bytes(without).empty());
    EXPECT_FALSE(proxy_bytes(with).empty());
    EXPECT_EQ(with.sections().texture_bytes.size(), without.sections().texture_bytes.size());
    EXPECT_TRUE(std::ranges::equal(with.sections().payload, without.sections().payload));
    EXPECT_LE(with.file_bytes(), without.file_bytes() + proxy_bytes(with).size() + 128);
  }
}

} // namespace
} // namespace packtrace
