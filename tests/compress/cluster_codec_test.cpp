#include "compress/format/cluster_codec.h"

#include <gtest/gtest.h>

#include "compress/format/bit_stream.h"
#include "compress/format/normal_codec.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

struct Case {
  std::vector<Triangle> triangles;
  std::vector<LatticePoint> positions;
  std::vector<uint32_t> codes;
  std::vector<UvLattice> uvs;
  baked::GeometryRecord geometry{};

  Case() { geometry.step_mantissa = 8, geometry.step_exponent = -10; }
};

/// Encodes, checks that the fault finder agrees, and compares every way of reading with what went in.
std::vector<uint8_t> expect_round_trip(const Case& c) {
  const Strips strips = find_strips(c.triangles, static_cast<uint32_t>(c.positions.size()));
  std::vector<LatticePoint> positions;
  std::vector<uint32_t> codes;
  std::vector<UvLattice> uvs;
  for (const uint32_t v : strips.vertex_order) {
    positions.push_back(c.positions[v]);
    if (!c.codes.empty()) codes.push_back(c.codes[v]);
    if (!c.uvs.empty()) uvs.push_back(c.uvs[v]);
  }
  BitWriter writer;
  const baked::ClusterRecord record =
      encode_cluster({&strips, positions, codes, uvs, 5, c.geometry.origin, c.geometry.anchor_shift}, writer);
  std::vector<uint8_t> bytes = writer.bytes();
  const uint64_t payload_bytes = bytes.size();
  bytes.resize(bytes.size() + kReadSlackBytes);
  EXPECT_EQ(find_cluster_fault(c.geometry, record, bytes.data(), payload_bytes), std::nullopt);
  if (payload_bytes >= 4) {
    EXPECT_TRUE(find_cluster_fault(c.geometry, record, bytes.data(), payload_bytes - 4));
  }
  const ClusterView view(c.geometry, record, bytes.data());
  EXPECT_EQ(view.material(), 5u);
  EXPECT_EQ(view.has_normals(), !c.codes.empty());
  EXPECT_EQ(view.has_uvs(), !c.uvs.empty());
  EXPECT_EQ((view.stream_bits().total() + 31) / 32 * 4, payload_bytes);
  std::vector<Vec3> all(view.vertex_count()), normals(view.vertex_count());
  std::vector<Vec2> all_uvs(view.vertex_count());
  decode_positions(view, all);
  if (view.has_normals()) decode_normals(view, normals);
  if (view.has_uvs()) decode_uvs(view, all_uvs);
  Vec3 lo, hi;
  view.bounds(lo, hi);
  for (uint32_t v = 0; v < view.vertex_count(); ++v) {
    EXPECT_EQ(view.lattice(v), positions[v]);
    EXPECT_EQ(view.position(v), all[v]);
    EXPECT_TRUE(glm::all(glm::lessThanEqual(lo, all[v])) && glm::all(glm::lessThanEqual(all[v], hi)));
    if (view.has_normals()) {
      EXPECT_EQ(view.normal_code(v), codes[v]);
      EXPECT_EQ(normals[v], decode_zsign32(codes[v]));
    }
    if (view.has_uvs()) {
      EXPECT_EQ(view.uv(v), all_uvs[v]);
      const float u_step = std::ldexp(1.0f, c.geometry.uv_exponent[0]),
                  v_step = std::ldexp(1.0f, c.geometry.uv_exponent[1]);
      EXPECT_EQ(view.uv(v), Vec2(from_uv_lattice(uvs[v][0], u_step), from_uv_lattice(uvs[v][1], v_step)));
    }
  }
  return bytes;
}

Case random_case(test::Random& random, uint32_t vertices) {
  Case c;
  for (uint32_t i = 0; i < 100; ++i)
    c.triangles.emplace_back(random.bits() % vertices, random.bits() % vertices, random.bits() % vertices);
  for (uint32_t v = 0; v < vertices; ++v)
    c.positions.push_back({random.bits() % 1000, random.bits() % 3, -int64_t{random.bits() % 100000}});
  return c;
}

TEST(ClusterCodec, EveryStreamRoundTrips) {
  test::Random random(9);
  for (const uint32_t vertices : {1u, 2u, 3u, 64u, 200u, 256u})
    for (const bool normals : {false, true})
      for (const bool uvs : {false, true}) {
        Case c = random_case(random, vertices);
        for (uint32_t v = 0; v < vertices && normals; ++v) c.codes.push_back(random.bits());
        for (uint32_t v = 0; v < vertices && uvs; ++v)
          c.uvs.push_back({static_cast<int32_t>(random.bits() % (2u * kMaxUvLattice + 1)) - kMaxUvLattice, 7});
        c.geometry.uv_exponent = {-12, 3};
        expect_round_trip(c);
      }
}

TEST(ClusterCodec, FewDistinctNormalsBecomeAPalette) {
  test::Random random(10);
  Case c = random_case(random, 200);
  for (uint32_t v = 0; v < 200; ++v) c.codes.push_back(0x12345678u + 0x01010101u * (random.bits() % 5));
  const size_t five = expect_round_trip(c).size();
  for (uint32_t& code : c.codes) code = random.bits();
  const size_t many = expect_round_trip(c).size();
  EXPECT_LT(five + 200 * 2, many); // 3 bits instead of 32 for those in use
  std::fill(c.codes.begin(), c.codes.end(), 0xdeadbeefu);
  const size_t one = expect_round_trip(c).size();
  c.codes.clear();
  EXPECT_EQ(one, expect_round_trip(c).size()); // no bits at all
}

TEST(ClusterCodec, FlatAxesCostNothing) {
  test::Random random(11);
  Case c = random_case(random, 100);
  const size_t full = expect_round_trip(c).size();
  for (LatticePoint& p : c.positions) p[2] = -5;
  EXPECT_LT(expect_round_trip(c).size() + 80 * 16 / 8, full); // four fifths of the vertices are in use
}

TEST(ClusterCodec, ExtentsUpToTheLatticeLimitRoundTrip) {
  test::Random random(12);
  Case c = random_case(random, 50);
  for (LatticePoint& p : c.positions)
    for (int64_t& q : p)
      q = ((int64_t{random.bits()} << 32) | random.bits()) % kMaxLattice * (random.bits() % 2 ? 1 : -1);
  c.positions[0] = {-kMaxLattice, -kMaxLattice, -kMaxLattice};
  c.positions[1] = {kMaxLattice, kMaxLattice, kMaxLattice};
  c.geometry.origin = c.positions[0];
  c.geometry.anchor_shift = 26;
  c.geometry.step_exponent = -60;
  expect_round_trip(c);
}

TEST(ClusterCodec, GoldenBytes) {
  Case c;
  c.triangles = {{0, 1, 2}, {2, 1, 3}};
  c.positions = {{100, 7, -3}, {101, 7, -3}, {100, 7, 0}, {103, 7, -1}};
  c.codes = {0x3fff7fff, 0x40017fff, 0x3fff8002, 0x40008000};
  c.uvs = {{0, 0}, {16, 0}, {0, 16}, {16, 16}};
  std::vector<uint8_t> bytes = expect_round_trip(c);
  bytes.resize(bytes.size() - kReadSlackBytes);
  const std::vector<uint8_t> expected = {0xf1,       // strips: restart 10, left 00, fresh 1111
                                         0x10, 0xbc, // positions: x - 100 and z + 3 in 2 bits each, y in none
                                         0x80, 0x53, // normals: y - 0x7fff below x - 0x3fff, 2 bits each
                                         0,    0,    0,    0,    0,    0,    0,   0, // uvs: anchors
                                         0xa5, 0x00, 0x00, 0x01, 0x80, 0x10, 0x02};  // widths 5 and 5, then u and v
  EXPECT_EQ(bytes, expected);
}

TEST(ClusterCodec, FaultsOfARecordAreFound) {
  test::Random random(13);
  const Case c = random_case(random, 64);
  const Strips strips = find_strips(c.triangles, 64);
  std::vector<LatticePoint> positions;
  for (const uint32_t v : strips.vertex_order) positions.push_back(c.positions[v]);
  BitWriter writer;
  const baked::ClusterRecord good = encode_cluster({&strips, positions, {}, {}, 0, {}, 0}, writer);
  std::vector<uint8_t> bytes = writer.bytes();
  const uint64_t size = bytes.size();
  bytes.resize(bytes.size() + kReadSlackBytes);
  const auto fault = [&](auto&& change) {
    baked::ClusterRecord record = good;
    change(record);
    return find_cluster_fault(c.geometry, record, bytes.data(), size).has_value();
  };
  EXPECT_FALSE(fault([](auto&) {}));
  EXPECT_TRUE(fault([](auto& r) { r.triangle_count = 0; }));
  EXPECT_TRUE(fault([](auto& r) { r.triangle_count = 129; }));
  EXPECT_TRUE(fault([](auto& r) { r.vertex_count = 0; }));
  EXPECT_TRUE(fault([](auto& r) { r.vertex_count = 257; }));
  EXPECT_TRUE(fault([](auto& r) { --r.vertex_count; }));
  EXPECT_TRUE(fault([](auto& r) { r.restart_count = 0; }));
  EXPECT_TRUE(fault([](auto& r) { r.restart_count = 200; }));
  EXPECT_TRUE(fault([](auto& r) { r.position_bits[1] = 58; }));
  EXPECT_TRUE(fault([](auto& r) { r.position_bits[1] = 57; })); // beyond the payload
  EXPECT_TRUE(fault([](auto& r) { r.normal_bits[0] = 1; }));
  EXPECT_TRUE(fault([](auto& r) { r.flags = 0x80; }));
  EXPECT_TRUE(fault([](auto& r) { r.flags |= baked::kClusterHasNormals, r.normal_bits[1] = 17; }));
  EXPECT_TRUE(fault([](auto& r) { r.flags |= baked::kClusterHasNormals, r.normal_palette = 300; }));
  EXPECT_TRUE(fault([](auto& r) { r.flags |= baked::kClusterHasUvs; }));
  EXPECT_TRUE(fault([](auto& r) { r.payload_offset = 0x7fffffff; }));
}

} // namespace
} // namespace packtrace
