#include "compress/format/cluster/cluster_codec.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "compress/format/cluster/normal_codec.h"
#include "compress/format/cluster/position_kernels.h"
#include "compress/format/layout/bit_stream.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

struct Case {
  std::vector<Triangle> triangles;
  std::vector<LatticePoint> positions;
  std::vector<uint32_t> codes;
  std::vector<UvLattice> uvs;
  baked::GeometryRecord geometry{};

  Case() {
    geometry.step_mantissa = 8, geometry.step_exponent = -10;
    geometry.normal_encoding = static_cast<uint8_t>(NormalEncoding::kZsign32);
  }
  NormalEncoding encoding() const { return static_cast<NormalEncoding>(geometry.normal_encoding); }
};

/// One encoded cluster: record and payload, followed by kReadSlackBytes.
struct Encoded {
  baked::ClusterRecord record;
  std::vector<uint8_t> bytes;
  uint64_t payload_bytes() const { return bytes.size() - kReadSlackBytes; }
};

Encoded encode(const Case& c, const Strips& strips) {
  std::vector<LatticePoint> positions;
  std::vector<uint32_t> codes;
  std::vector<UvLattice> uvs;
  for (const uint32_t v : strips.vertex_order) {
    positions.push_back(c.positions[v]);
    if (!c.codes.empty()) codes.push_back(c.codes[v]);
    if (!c.uvs.empty()) uvs.push_back(c.uvs[v]);
  }
  BitWriter writer;
  const ClusterInput input{&strips, positions, codes, uvs, 5, c.geometry.origin, c.geometry.anchor_shift, c.encoding()};
  Encoded encoded{encode_cluster(input, writer), writer.bytes()};
  encoded.bytes.resize(encoded.bytes.size() + kReadSlackBytes);
  return encoded;
}

/// Encodes a cluster, checks that find_cluster_fault() accepts it, and compares all ways of decoding it with the input.
std::vector<uint8_t> expect_round_trip(const Case& c) {
  const Strips strips = find_strips(c.triangles, static_cast<uint32_t>(c.positions.size()));
  const Encoded encoded = encode(c, strips);
  const auto& [record, bytes] = encoded;
  const uint64_t payload_bytes = encoded.payload_bytes();
  EXPECT_EQ(find_cluster_fault(c.geometry, record, bytes.data(), payload_bytes), std::nullopt);
  if (payload_bytes >= 4) {
    EXPECT_TRUE(find_cluster_fault(c.geometry, record, bytes.data(), payload_bytes - 4));
  }
  const ClusterView view(c.geometry, record, bytes.data());
  EXPECT_EQ(view.material_slot(), 5u);
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
    const uint32_t source = strips.vertex_order[v];
    EXPECT_EQ(view.lattice(v), c.positions[source]);
    EXPECT_EQ(view.position(v), all[v]);
    EXPECT_TRUE(glm::all(glm::lessThanEqual(lo, all[v])) && glm::all(glm::lessThanEqual(all[v], hi)));
    if (view.has_normals()) {
      EXPECT_EQ(view.normal_code(v), c.codes[source]);
      EXPECT_EQ(normals[v], decode_normal(c.encoding(), c.codes[source]));
    }
    if (view.has_uvs()) {
      EXPECT_EQ(view.uv(v), all_uvs[v]);
      const auto encoding = static_cast<UvEncoding>(c.geometry.uv_encoding);
      const UvDecoder u(encoding, c.geometry.uv_exponent[0]), v_of(encoding, c.geometry.uv_exponent[1]);
      EXPECT_EQ(view.uv_code(v), (std::array<int64_t, 2>{c.uvs[source][0], c.uvs[source][1]}));
      EXPECT_EQ(view.uv(v), Vec2(u(c.uvs[source][0]), v_of(c.uvs[source][1])));
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
  EXPECT_LT(five + 200 * 2, many); // 3 bits instead of 32 per used vertex
  std::fill(c.codes.begin(), c.codes.end(), 0xdeadbeefu);
  const size_t one = expect_round_trip(c).size();
  c.codes.clear();
  EXPECT_EQ(one, expect_round_trip(c).size()); // one distinct normal takes no bits
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
                                         0x29, 0x33, // normals: y - 0x7ffe in 3 bits below x - 0x3ffe in 2
                                         0x09, 0,    0,    0,    0,    0,    0,   0, // uvs from bit 4 on: anchors
                                         0x50, 0x0a, 0x00, 0x10, 0x00, 0x08, 0x21};  // widths 5 and 5, then u and v
  EXPECT_EQ(bytes, expected);
}

TEST(ClusterCodec, GoldenBytesOfNormalsAcrossAnEdgeOfTheCube) {
  constexpr auto kEncoding = NormalEncoding::kAxis24;
  Case c;
  c.geometry.normal_encoding = static_cast<uint8_t>(kEncoding);
  c.triangles = {{0, 1, 2}, {2, 1, 3}};
  c.positions = {{100, 7, -3}, {101, 7, -3}, {100, 7, 0}, {103, 7, -1}};
  // On the faces +z and +x, at most three codes from their common edge. Unfolded around +x, y is
  // above 1670 beyond that edge.
  for (const NormalFields fields :
       {NormalFields{4, 1670, 835}, NormalFields{0, 835, 1670}, NormalFields{4, 1668, 836}, NormalFields{0, 836, 1669}})
    c.codes.push_back(join_normal_code(kEncoding, fields));
  const auto [record, bytes] = encode(c, find_strips(c.triangles, 4));
  EXPECT_EQ(record.flags, baked::kClusterHasNormals); // unfolded around chart 0
  EXPECT_EQ(record.normal_anchor, (std::array<int16_t, 2>{417, 834}));
  EXPECT_EQ(record.normal_bits, (std::array<uint8_t, 2>{2, 3}));
  const std::vector<uint8_t> expected = {0xf1, 0x10, 0xbc,        // as above
                                         0x4b, 0xd5, 0x08, 0, 0}; // y - 1668 below x - 834: 3, 1; 2, 1; 5, 2; 1, 2
  EXPECT_EQ(std::vector<uint8_t>(bytes.begin(), bytes.end() - kReadSlackBytes), expected);
  expect_round_trip(c);
}

TEST(ClusterCodec, FaultsOfARecordAreFound) {
  test::Random random(13);
  const Case c = random_case(random, 64);
  const auto [good, bytes] = encode(c, find_strips(c.triangles, 64));
  const uint64_t size = bytes.size() - kReadSlackBytes;
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
  EXPECT_TRUE(fault([](auto& r) { r.strip_count = 0; }));
  EXPECT_TRUE(fault([](auto& r) { r.strip_count = 200; }));
  EXPECT_TRUE(fault([](auto& r) { r.position_bits[1] = 58; }));
  EXPECT_TRUE(fault([](auto& r) { r.position_bits[1] = 57; })); // exceeds the payload
  EXPECT_TRUE(fault([](auto& r) { r.normal_bits[0] = 1; }));
  EXPECT_TRUE(fault([](auto& r) { r.normal_anchor[1] = -1; }));
  EXPECT_TRUE(fault([](auto& r) { r.flags = baked::kClusterMixedCharts; }));
  EXPECT_TRUE(fault([](auto& r) { r.flags = 1u << baked::kClusterChartShift; }));
  EXPECT_TRUE(fault([](auto& r) { r.flags = 0x80; }));
  EXPECT_TRUE(fault([](auto& r) { r.flags |= baked::kClusterHasNormals, r.normal_bits[1] = 18; }));
  EXPECT_FALSE(fault([](auto& r) { r.flags |= baked::kClusterHasNormals; })); // all normals are equal and take no bits
  EXPECT_TRUE(fault([](auto& r) { r.flags |= baked::kClusterHasNormals | (2u << baked::kClusterChartShift); }));
  EXPECT_TRUE(fault([](auto& r) { r.flags |= baked::kClusterHasNormals, r.normal_palette = 300; }));
  EXPECT_TRUE(fault([](auto& r) { r.flags |= baked::kClusterHasUvs; }));
  EXPECT_TRUE(fault([](auto& r) { r.payload_offset = 0x7fffffff; }));
}

/// Clusters with normals of one encoding, in all packings.
class ClusterNormals : public testing::TestWithParam<NormalEncoding> {
protected:
  uint32_t code(DVec3 n) const { return encode_normal(GetParam(), n); }
  Case make_case(test::Random& random) const {
    Case c = random_case(random, 60);
    c.geometry.normal_encoding = static_cast<uint8_t>(GetParam());
    return c;
  }
  static DVec3 any_direction(test::Random& random) {
    return {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
  }
  /// Random normals everywhere, and around every `stride`-th of the cube's faces, edges and corners; with 60, 7 or 1
  /// distinct normals.
  std::vector<Case> cases(test::Random& random, int stride) const {
    std::vector<DVec3> middles{DVec3(0.0)};
    for (int i = 0; i < 27; i += stride) middles.emplace_back(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    std::vector<Case> result;
    for (const DVec3 middle : middles)
      for (const uint32_t distinct : {60u, 7u, 1u}) {
        Case c = make_case(random);
        for (uint32_t v = 0; v < 60; ++v)
          c.codes.push_back(v < distinct ? code(middle * 4.0 + any_direction(random)) : c.codes[v % distinct]);
        result.push_back(c);
      }
    return result;
  }
};

TEST_P(ClusterNormals, RoundTrip) {
  test::Random random(30);
  for (const Case& c : cases(random, 1)) expect_round_trip(c);
}

TEST_P(ClusterNormals, NormalsAroundOneDirectionTakeFewBits) {
  test::Random random(31);
  Case c = make_case(random);
  const auto size = [&](DVec3 middle) {
    c.codes.clear();
    for (uint32_t v = 0; v < 60; ++v) c.codes.push_back(code(middle * 20.0 + any_direction(random)));
    return expect_round_trip(c).size();
  };
  const size_t all = size(DVec3(0.0));
  for (const DVec3 middle : {DVec3(0, 0.2, 1), DVec3(0.6, 0.1, 0.4), DVec3(0.3, 0.7, 0.3)})
    EXPECT_LT(size(middle) + 60 * 4 / 8, all); // a tenth of the sphere's width saves at least four bits per vertex
  if (format_of(GetParam()).family != NormalFamily::kAxis) return;
  for (int i = 0; i < 8; ++i) { // also across edges and corners of the cube
    const DVec3 corner(i % 2 * 2 - 1, i / 2 % 2 * 2 - 1, i / 4 * 2 - 1);
    EXPECT_LT(size(corner) + 60 * 4 / 8, all) << i;
    EXPECT_LT(size(corner * DVec3(1, 1, 0)) + 60 * 4 / 8, all) << i;
  }
}

/// Decodes all normals; they are unit vectors for any bits.
void expect_unit_normals(const Case& c, const baked::ClusterRecord& record, const uint8_t* payload) {
  const ClusterView view(c.geometry, record, payload);
  if (!view.has_normals()) return;
  for (uint32_t v = 0; v < view.vertex_count(); ++v) {
    ASSERT_NEAR(glm::length(view.normal(v)), 1.0f, 3e-7f);
    ASSERT_EQ(decode_normal(c.encoding(), view.normal_code(v)), view.normal(v));
  }
}

TEST_P(ClusterNormals, TruncatedPrefixesAreFaults) {
  test::Random random(32);
  for (const Case& c : cases(random, 10)) {
    const Encoded good = encode(c, find_strips(c.triangles, 60));
    const uint64_t used = (ClusterView(c.geometry, good.record, good.bytes.data()).stream_bits().total() + 7) / 8;
    for (uint64_t size = 0; size < good.payload_bytes(); ++size) {
      const std::vector<uint8_t> prefix(good.bytes.begin(),
                                        good.bytes.begin() + static_cast<std::ptrdiff_t>(size + kReadSlackBytes));
      const bool fault = find_cluster_fault(c.geometry, good.record, prefix.data(), size).has_value();
      ASSERT_EQ(fault, size < used) << size; // everything but the padding is needed
    }
  }
}

TEST_P(ClusterNormals, FlippedBitsAreFaultsOrHarmless) {
  test::Random random(33);
  uint32_t harmless = 0, faults = 0;
  for (const Case& c : cases(random, 10)) {
    const Encoded good = encode(c, find_strips(c.triangles, 60));
    const auto read = [&](const Encoded& damaged) {
      if (find_cluster_fault(c.geometry, damaged.record, damaged.bytes.data(), damaged.payload_bytes())) {
        ++faults;
      } else {
        ++harmless;
        expect_unit_normals(c, damaged.record, damaged.bytes.data());
      }
    };
    for (size_t bit = 0; bit < 8 * sizeof good.record; ++bit) {
      Encoded damaged = good;
      std::array<uint8_t, sizeof good.record> raw{};
      std::memcpy(raw.data(), &good.record, sizeof good.record);
      raw[bit / 8] ^= static_cast<uint8_t>(1u << (bit % 8));
      std::memcpy(&damaged.record, raw.data(), sizeof good.record);
      read(damaged);
    }
    for (size_t bit = 0; bit < 8 * good.payload_bytes(); ++bit) {
      Encoded damaged = good;
      damaged.bytes[bit / 8] ^= static_cast<uint8_t>(1u << (bit % 8));
      read(damaged);
    }
  }
  EXPECT_GT(harmless, 1000u); // both outcomes must occur often enough
  EXPECT_GT(faults, 1000u);
}

/// Random bits, including charts that do not exist and codes far outside the cross of unfolded faces.
TEST_P(ClusterNormals, AllAtOnceAreThoseOneByOne) {
  test::Random random(17);
  uint32_t charts = 0;
  for (int round = 0; round < 3000; ++round) {
    const uint32_t vertex_count = 3 + random.bits() % 254;
    baked::GeometryRecord geometry{};
    geometry.step_mantissa = 8;
    geometry.normal_encoding = static_cast<uint8_t>(GetParam());
    const uint32_t width = round % 3 == 0 ? 17 : 1 + random.bits() % 12;
    baked::ClusterRecord record{};
    record.triangle_count = record.strip_count = 128;
    record.vertex_count = static_cast<uint16_t>(vertex_count);
    record.normal_bits = {static_cast<uint8_t>(width), static_cast<uint8_t>(random.bits() % (width + 1))};
    for (int16_t& anchor : record.normal_anchor)
      anchor = static_cast<int16_t>(round % 2 == 0 ? random.bits() : random.bits() % 1000 - 500);
    const uint32_t chart_count = format_of(GetParam()).charts, chart = random.bits() % chart_count;
    const bool mixed = chart_count > 1 && random.bits() % 3 == 0;
    record.flags = static_cast<uint8_t>(baked::kClusterHasNormals | (mixed ? uint32_t{baked::kClusterMixedCharts}
                                                                           : chart << baked::kClusterChartShift));
    const IndexLayout layout{128, vertex_count, 128};
    std::vector<uint8_t> bytes(layout.total_bits() / 8 + vertex_count * 6 + kReadSlackBytes);
    for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random.bits());
    const uint32_t stride = record.normal_bits[0] + record.normal_bits[1] + (mixed ? bits_for_count(chart_count) : 0u);
    if (random.bits() % 4 == 0) { // palette indices of 7 bits are below 128
      record.normal_palette = 128;
      record.vertex_count = 200;
      bytes.resize(layout.total_bits() / 8 + 128 * 6 + 200 + 2 * kReadSlackBytes);
    } else {
      const uint64_t bits = layout.total_bits() + uint64_t{vertex_count} * stride;
      bytes.resize(static_cast<size_t>((bits + 7) / 8) + kReadSlackBytes); // only the promised slack
    }
    const ClusterView view(geometry, record, bytes.data());
    std::vector<Vec3> normals(view.vertex_count());
    decode_normals(view, normals);
    for (uint32_t v = 0; v < view.vertex_count(); ++v) {
      const Vec3 one = view.normal(v);
      ASSERT_EQ(std::memcmp(&one, &normals[v], sizeof one), 0) << round << " " << v;
      charts |= 1u << view.normal_fields(v).chart;
    }
  }
  EXPECT_EQ(charts, (1u << format_of(GetParam()).charts) - 1);
}

INSTANTIATE_TEST_SUITE_P(Encodings, ClusterNormals,
                         testing::Values(NormalEncoding::kZsign32, NormalEncoding::kAxis32, NormalEncoding::kAxis24,
                                         NormalEncoding::kAxis16, NormalEncoding::kOct32, NormalEncoding::kOct24,
                                         NormalEncoding::kOct20, NormalEncoding::kOct16, NormalEncoding::kAxis12),
                         [](const auto& test) { return std::string(format_of(test.param).name); });

TEST(ClusterCodec, ThePositionKernelRoundsLikeSinglePositions) {
  const PositionKernel kernel = position_kernel();
  if (kernel == nullptr) GTEST_SKIP() << "this processor has none";
  test::Random random(11);
  for (int round = 0; round < 2000; ++round) {
    PositionStream stream;
    LatticePoint base;
    const uint32_t most = random.bits() % 3 == 0 ? kMaxKernelPositionBits : 18;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      stream.width[axis] = std::min(random.bits() % (most + 1), kMaxFieldBits - stream.stride);
      stream.stride += stream.width[axis];
      const auto far =
          static_cast<int64_t>((uint64_t{random.bits()} << 32 | random.bits()) >> (13 + random.bits() % 51));
      base[axis] = std::min(far, int64_t{1} << kMaxKernelPositionBits) * (random.bits() % 2 == 0 ? 1 : -1);
      stream.base[axis] = static_cast<double>(base[axis]);
    }
    stream.count = 1 + random.bits() % 9;
    stream.first_bit = random.bits() % 70;
    stream.step = std::ldexp(8.0 + random.bits() % 8, static_cast<int>(random.bits() % 60) - 50);
    std::vector<uint8_t> bits((stream.first_bit + uint64_t{stream.stride} * stream.count + 7) / 8 + kReadSlackBytes);
    for (uint8_t& byte : bits) byte = static_cast<uint8_t>(random.bits());
    stream.bits = bits.data();
    std::vector<float> out(size_t{3} * stream.count + 1, -1.0f);
    kernel(stream, out.data());
    for (uint32_t v = 0; v < stream.count; ++v) {
      const PositionFields q = read_position(stream.bits, stream.first_bit + uint64_t{v} * stream.stride,
                                             stream.width[0], stream.width[1], stream.width[2]);
      for (uint32_t axis = 0; axis < 3; ++axis)
        ASSERT_EQ(out[3 * v + axis], from_lattice(base[axis] + static_cast<int64_t>(q.axis[axis]), stream.step))
            << round;
    }
    EXPECT_EQ(out.back(), -1.0f); // nothing is written behind the last position
  }
}

} // namespace
} // namespace packtrace
