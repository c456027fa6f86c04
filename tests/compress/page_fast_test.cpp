#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <zstd.h>

#include "compress/format/file/baked_file.h"
#include "compress/format/pages/page_codec.h"
#include "compress/format/pages/page_decoder.h"
#include "compress/format/pages/page_encoder.h"
#include "compress/format/pages/page_fast_kernels.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using namespace page_fast;
using Octets = std::vector<uint8_t>;

void append_number(Octets& to, size_t value) {
  const auto number = static_cast<uint32_t>(value);
  to.insert(to.end(), reinterpret_cast<const uint8_t*>(&number), reinterpret_cast<const uint8_t*>(&number + 1));
}

/// A page whose parts are not compressed.
Octets page_of(const std::array<Octets, kParts>& parts) {
  Octets page;
  for (const Octets& part : parts)
    for (int i = 0; i < 2; ++i) append_number(page, part.size());
  for (const Octets& part : parts) page.insert(page.end(), part.begin(), part.end());
  return page;
}

/// A square of two triangles, encoded by hand.
struct Square {
  baked::GeometryRecord geometry{};
  std::array<Octets, kParts> parts;
  Header header{};

  Square() {
    geometry.cluster_count = 1;
    header.anchor = {10, 3, 14}; // 5, -2, 7
    header.material_slot = 3;
    header.triangles = 1, header.vertices = 3;
    header.position_bits = {4, 3, 0};
    header.coding[1] = 1 | 1 << kClassShift;
    header.coding[2] = 2 << kClassShift;
    parts[kFields] = {0x00, 0x02}; // first vertex: 0 in 7 bits; low bits of y: 0, 0, 1
    parts[kBits] = {0x00, 0x0f};   // a right turn; all corners are fresh
    parts[kRuns] = {2};
    parts[kResiduals + 0] = {20, 19, 1}; // x: +10, -10, -1
    parts[kResiduals + 1] = {0, 6, 0};   // y: 0, +6, -1
    parts[kResiduals + 2] = {0, 0, 0};
  }

  bool decode(baked::ClusterRecord& record, Octets& payload) {
    parts[kHeaders].resize(kHeaderBytes);
    std::memcpy(parts[kHeaders].data(), &header, kHeaderBytes);
    const Octets page = page_of(parts);
    baked::PageRecord page_record{0, static_cast<uint32_t>(page.size()), 8, 1, static_cast<uint32_t>(PageCodec::kFast)};
    payload.assign(8, 0xcc);
    PageDecoder decoder;
    return decoder.decode(page_record, page, {{&geometry, 1}, 0, 0}, {&record, 1}, payload);
  }
};

TEST(FastPage, APageWrittenByHandIsDecoded) {
  Square square;
  baked::ClusterRecord record;
  Octets payload;
  ASSERT_TRUE(square.decode(record, payload));
  EXPECT_EQ(record.anchor, (std::array<int32_t, 3>{5, -2, 7}));
  EXPECT_EQ(record.material_slot, 3u);
  EXPECT_EQ(record.triangle_count, 2);
  EXPECT_EQ(record.vertex_count, 4);
  EXPECT_EQ(record.strip_count, 1);
  BitWriter expected;
  expected.put(0b01, 2), expected.put(0, 2), expected.put(0b1111, 4);
  for (const auto& [x, y] : {std::pair{0, 0}, {10, 0}, {0, 6}, {9, 5}}) // the last one: 10 + 0 - 0 - 1, 0 + 6 - 0 - 1
    expected.put(static_cast<uint32_t>(x), 4), expected.put(static_cast<uint32_t>(y), 3);
  expected.align(4);
  payload.resize(expected.bytes().size());
  EXPECT_EQ(payload, expected.bytes());
}

TEST(FastPage, EveryPartIsNeededAndNoneMayHaveMore) {
  for (uint32_t part = 0; part < kParts; ++part) {
    baked::ClusterRecord record;
    Octets payload;
    if (part != kHeaders) {
      Square longer;
      longer.parts[part].push_back(0);
      EXPECT_FALSE(longer.decode(record, payload)) << part;
    }
    Square shorter;
    if (part == kHeaders || shorter.parts[part].empty()) continue;
    shorter.parts[part].pop_back();
    EXPECT_FALSE(shorter.decode(record, payload)) << part;
  }
}

TEST(FastPage, HeadersOutOfRangeAreRefused) {
  const auto decodes = [](auto change) {
    Square square;
    change(square.header);
    baked::ClusterRecord record;
    Octets payload;
    return square.decode(record, payload);
  };
  EXPECT_TRUE(decodes([](Header&) {}));
  EXPECT_FALSE(decodes([](Header& h) { h.triangles = 128; }));
  EXPECT_FALSE(decodes([](Header& h) { h.vertices = 4; }));
  EXPECT_FALSE(decodes([](Header& h) { h.vertices = 255; }));
  EXPECT_FALSE(decodes([](Header& h) { h.strips = 1; }));
  EXPECT_FALSE(decodes([](Header& h) { h.strips = 255; }));
  EXPECT_FALSE(decodes([](Header& h) { h.position_bits[0] = 58; }));
  EXPECT_FALSE(decodes([](Header& h) { h.position_bits = {57, 57, 57}; }));
  EXPECT_FALSE(decodes([](Header& h) { h.normal_bits[1] = 255; }));
  EXPECT_FALSE(decodes([](Header& h) { h.coding[0] = 63; }));
  EXPECT_FALSE(decodes([](Header& h) { h.palette = 2; }));
  EXPECT_FALSE(decodes([](Header& h) { h.creases = 1; }));
  EXPECT_FALSE(decodes([](Header& h) { h.escapes[0] = 1; }));
  EXPECT_FALSE(decodes([](Header& h) { h.flags = baked::kClusterHasNormals; }));
  EXPECT_FALSE(decodes([](Header& h) { h.flags = baked::kClusterHasUvs; }));
  EXPECT_FALSE(decodes([](Header& h) { h.grid = 1; })); // the parts for strips would not be used
}

/// Two squares side by side as grids, encoded by hand. The second shares its left column.
struct Squares {
  baked::GeometryRecord geometry{};
  std::array<Octets, kParts> parts;
  std::array<Header, 2> headers{};

  Squares() {
    geometry.cluster_count = 2;
    for (Header& header : headers) {
      header.triangles = 1, header.vertices = 3, header.grid = 1;
      header.position_bits = {4, 3, 0};
    }
    headers[1].anchor = {20, 0, 0}; // x = 10
    headers[1].neighbour = {1, 0}, headers[1].shared = {1, 0};
    parts[kFields] = {0x00};
    // By point (1, 0), (0, 1), (1, 1): x +10, 0, 0, y 0, +6, 0. Then (1, 0), (1, 1): x +9, +1, y 0, -1.
    parts[kResiduals] = {20, 0, 0, 0, 12, 0, 0, 0, 0, 18, 2, 0, 1, 0, 0};
  }

  bool decode(std::array<baked::ClusterRecord, 2>& records, Octets& payload) {
    parts[kHeaders].resize(2 * kHeaderBytes);
    for (size_t i = 0; i < kHeaderBytes; ++i)
      for (size_t k = 0; k < 2; ++k) parts[kHeaders][2 * i + k] = reinterpret_cast<const uint8_t*>(&headers[k])[i];
    const Octets page = page_of(parts);
    baked::PageRecord page_record{0, static_cast<uint32_t>(page.size()), 16, 2,
                                  static_cast<uint32_t>(PageCodec::kFast)};
    payload.assign(16, 0xcc);
    PageDecoder decoder;
    return decoder.decode(page_record, page, {{&geometry, 1}, 0, 0}, records, payload);
  }
};

TEST(FastPage, GridsWrittenByHandShareABorder) {
  Squares squares;
  std::array<baked::ClusterRecord, 2> records;
  Octets payload;
  ASSERT_TRUE(squares.decode(records, payload));
  EXPECT_EQ(records[1].anchor, (std::array<int32_t, 3>{10, 0, 0}));
  const Strips strips = strips_in_order(std::array{Triangle(0, 1, 3), Triangle(0, 3, 2)}, 4); // of points
  BitWriter expected;
  using Points = std::array<std::array<uint32_t, 2>, 4>;
  for (const Points& points : {Points{{{0, 0}, {10, 0}, {0, 6}, {10, 6}}}, Points{{{0, 0}, {9, 0}, {0, 6}, {10, 5}}}}) {
    write_strips(strips, expected);
    for (const uint32_t point : strips.vertex_order)
      expected.put(points[point][0], 4), expected.put(points[point][1], 3);
    expected.align(4);
  }
  payload.resize(expected.bytes().size());
  EXPECT_EQ(payload, expected.bytes());
}

TEST(FastPage, GridsOutOfRangeAreRefused) {
  const auto decodes = [](auto change) {
    Squares squares;
    change(squares.headers[1]);
    std::array<baked::ClusterRecord, 2> records;
    Octets payload;
    return squares.decode(records, payload);
  };
  EXPECT_TRUE(decodes([](Header&) {}));
  EXPECT_FALSE(decodes([](Header& h) { h.grid = 0; }));
  EXPECT_FALSE(decodes([](Header& h) { h.grid = 2; }));
  EXPECT_FALSE(decodes([](Header& h) { h.grid = kGridDiagonals; }));
  EXPECT_FALSE(decodes([](Header& h) { h.grid = 1 | kGridDiagonals; })); // but no diagonals are stored
  EXPECT_FALSE(decodes([](Header& h) { h.strips = 1; }));
  EXPECT_FALSE(decodes([](Header& h) { h.creases = 1; }));
  EXPECT_FALSE(decodes([](Header& h) { h.neighbour[kLeftColumn] = 0; }));
  EXPECT_FALSE(decodes([](Header& h) { h.neighbour[kLeftColumn] = 2; }));
  EXPECT_FALSE(decodes([](Header& h) { h.shared[kLeftColumn] = 1 << kNormals | 1; }));
  EXPECT_FALSE(decodes([](Header& h) { h.shared[kLowestRow] = 1; }));
  EXPECT_FALSE(decodes([](Header& h) { h.shared[kLeftColumn] = 8; }));
  EXPECT_FALSE(decodes([](Header& h) { h.shared = {}; }));
}

/// Headers of all pages of a scene, in codec fast. Checks that the file is restored bit for bit.
std::vector<Header> headers_of(const Scene& scene, BakeConfig config = {}) {
  const std::vector<std::byte> plain = test::bake(scene, config).bytes;
  const std::vector<std::byte> disk = encode_paged_file(BakedFile::from_bytes(plain), PageCodec::kFast);
  DiskForm form;
  EXPECT_TRUE(expand_paged_file(disk, "memory", form) == plain);
  baked::PagedHeader file;
  std::memcpy(&file, disk.data(), sizeof file);
  std::vector<Header> headers;
  const std::byte* record_at = disk.data() + sizeof file;
  const std::byte* page_at = record_at + file.page_count * sizeof(baked::PageRecord) + file.head_disk_bytes +
                             file.tail_disk_bytes + file.node_disk_bytes;
  for (uint32_t i = 0; i < file.page_count; ++i, record_at += sizeof(baked::PageRecord)) {
    baked::PageRecord page;
    std::memcpy(&page, record_at, sizeof page);
    EXPECT_EQ(page.form, static_cast<uint32_t>(PageCodec::kFast));
    std::array<uint32_t, 2 * kParts> sizes;
    std::memcpy(sizes.data(), page_at, sizeof sizes);
    const std::byte* part = page_at + sizeof sizes + sizes[2 * kFields + 1];
    const uint32_t bytes = sizes[2 * kHeaders], disk_bytes = sizes[2 * kHeaders + 1];
    Octets columns(bytes);
    if (bytes == disk_bytes)
      std::memcpy(columns.data(), part, bytes);
    else
      EXPECT_EQ(ZSTD_decompress(columns.data(), bytes, part, disk_bytes), bytes);
    for (uint32_t c = 0; c < page.cluster_count; ++c) {
      Octets row(sizeof(Header));
      for (size_t k = 0; k < kHeaderBytes; ++k) row[k] = columns[k * page.cluster_count + c];
      std::memcpy(&headers.emplace_back(), row.data(), sizeof(Header));
    }
    page_at += page.disk_bytes;
  }
  return headers;
}

template <class Of>
uint32_t total(const std::vector<Header>& headers, const Of& of) {
  uint32_t sum = 0;
  for (const Header& header : headers) sum += of(header);
  return sum;
}

TEST(FastPage, CreasesShareThePlaceOfAnOlderVertex) {
  Mesh mesh = test::grid_mesh(20, 0.1f, true);
  Mesh split; // each corner has its own vertex, with one of two normals
  for (const Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      split.positions.push_back(mesh.positions[t[k]]);
      split.normals.push_back(split.triangles.size() % 3 == 0 ? Vec3(0, 0.6f, 0.8f) : mesh.normals[t[k]]);
      if (k == 2) {
        const auto last = static_cast<uint32_t>(split.positions.size() - 1);
        split.triangles.emplace_back(last - 2, last - 1, last);
      }
    }
  const std::vector<Header> headers = headers_of(test::scene_of(split));
  EXPECT_GT(total(headers, [](const Header& h) { return uint32_t{h.creases}; }), 200u);
}

TEST(FastPage, BlocksOfAGridShareTheirBorders) {
  BakeConfig config;
  config.repeated_clusters = RepeatedClusters::kMost;
  const std::vector<Header> headers = headers_of(test::scene_of(test::grid_mesh(64, 0.1f, true)), config);
  ASSERT_EQ(headers.size(), 64u); // 8 x 8 blocks
  const auto shared = [&](GridBorder border, Channel channel) {
    return total(headers, [&](const Header& h) { return uint32_t{h.shared[border]} >> channel & 1u; });
  };
  EXPECT_EQ(total(headers, [](const Header& h) { return uint32_t{h.grid}; }), 64u * 8u);
  EXPECT_EQ(shared(kLeftColumn, kPositions), 7u * 8u);
  EXPECT_GE(shared(kLowestRow, kPositions), 6u * 8u); // without blocks that begin a page
  EXPECT_GT(shared(kLeftColumn, kNormals), 4u * 8u);  // where normals of both blocks have one chart
}

TEST(FastPage, OutliersAreEscapes) {
  Mesh mesh = test::grid_mesh(30, 0.1f, true);
  for (size_t i = 0; i < mesh.positions.size(); i += 97) mesh.positions[i].z += 1000.0f;
  const std::vector<Header> headers = headers_of(test::scene_of(mesh));
  EXPECT_GT(total(headers, [](const Header& h) { return uint32_t{h.escapes[kPositions]}; }), 5u);
}

TEST(FastPage, PositionsWiderThanAWordComeBack) {
  BakeConfig config;
  config.precision_kind = PrecisionKind::kAbsolute;
  config.precision = 1e-6;
  for (const bool normals : {false, true}) {
    const std::vector<Header> headers =
        headers_of(test::scene_of(test::grid_mesh(4, 0.5f, normals), test::scaling(DVec3(3, 5, 7))), config);
    ASSERT_EQ(headers.size(), 1u);
    EXPECT_GT(headers[0].position_bits[0] + headers[0].position_bits[1] + headers[0].position_bits[2], 57);
  }
}

TEST(FastPage, TextureCoordinatesWiderThanAWordComeBack) {
  Mesh mesh = test::grid_mesh(4, 0.5f, true);
  for (Vec2& uv : mesh.uvs) uv = (uv - 0.5f) * 24000.0f;
  const Scene scene = test::scene_of(mesh);
  BakeConfig config;
  config.keep_uvs = true;
  const BakedFile file = BakedFile::from_bytes(test::bake(scene, config).bytes);
  const ClusterView view = file.cluster(0, 0);
  int bits = 0;
  for (size_t axis = 0; axis < 2; ++axis) {
    int64_t least = view.uv_code(0)[axis], most = least;
    for (uint32_t v = 1; v < view.vertex_count(); ++v)
      least = std::min(least, view.uv_code(v)[axis]), most = std::max(most, view.uv_code(v)[axis]);
    bits += static_cast<int>(std::bit_width(static_cast<uint64_t>(most - least)));
  }
  EXPECT_GT(bits, 57);
  EXPECT_EQ(headers_of(scene, config).size(), 1u);
}

TEST(FastPage, KernelsAgreeAndReadWhatWasWritten) {
  test::Random random(5);
  for (int round = 0; round < 2000; ++round) {
    const uint32_t count = random.bits() % 256;
    ChannelCode code;
    code.field_count = 1 + random.bits() % 3;
    std::array<Octets, 3> bytes;
    uint32_t shift = random.bits() % 3;
    for (uint32_t f = 0; f < code.field_count; ++f) {
      bytes[f].resize(count + kPartSlackBytes);
      for (uint8_t& byte : bytes[f]) byte = static_cast<uint8_t>(random.bits());
      code.fields[f] = {bytes[f].data(), random.bits() % 2 == 0 ? 0 : random.bits() % 20, code.low_stride, shift};
      code.low_stride += code.fields[f].low_bits;
      shift += random.bits() % 20;
    }
    const uint32_t first = random.bits() % 40;
    BitWriter writer;
    std::vector<uint64_t> expected(count, 0);
    writer.put(0, first);
    for (uint32_t i = 0; i < count; ++i)
      for (uint32_t f = 0; f < code.field_count; ++f) {
        const FieldCode& field = code.fields[f];
        const uint64_t low = random.bits() & ((1u << field.low_bits) - 1);
        writer.put(low, field.low_bits);
        const auto number = static_cast<int64_t>((uint64_t{bytes[f][i]} << field.low_bits) | low);
        const int64_t value = number % 2 == 0 ? number / 2 : -(number + 1) / 2;
        expected[i] += static_cast<uint64_t>(value) << field.shift;
      }
    writer.align(1);
    Octets low = writer.bytes();
    low.resize(low.size() + kPartSlackBytes);
    code.low = low.data(), code.low_bit = first;
    std::vector<uint64_t> portable(count + kSpareWords), chosen(count + kSpareWords);
    read_residuals(code, count, portable.data());
    residual_kernel()(code, count, chosen.data());
    ASSERT_TRUE(std::equal(expected.begin(), expected.end(), portable.begin())) << round;
    ASSERT_TRUE(std::equal(expected.begin(), expected.end(), chosen.begin())) << round;
  }
}

TEST(FastPage, FourNumbersArePackedAsOne) {
  for (uint32_t width = 0; width <= 8; ++width) {
    const std::array<uint8_t, 4> bytes{0xff, 0x81, 0x03, 0x5a};
    BitWriter writer;
    for (const uint8_t byte : bytes) writer.put(byte & ((1u << width) - 1), width);
    writer.align(8);
    Octets padded = writer.bytes();
    padded.resize(16);
    EXPECT_EQ(pack_four(bytes.data(), width), read_bits(padded.data(), 0, 4 * width)) << width;
  }
}

} // namespace
} // namespace packtrace
