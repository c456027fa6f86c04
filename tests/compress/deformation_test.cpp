#include "compress/format/deformation/deformation_player.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/format/deformation/deformation_encoder.h"
#include "tests/compress/file_damage.h"
#include "tests/compress/test_scenes.h"
#include "tests/deforming_meshes.h"

namespace packtrace {
namespace {

using test::GivenFrames;

/// A scene of one mesh that moves, and how it is baked.
struct MovingScene {
  MovingScene(const test::DeformingMesh& mesh, uint32_t frames)
      : MovingScene(mesh.mesh(0.0), test::sampled(mesh, frames)) {}
  MovingScene(const Mesh& mesh, std::vector<std::vector<Vec3>> given) : scene(test::scene_of(mesh)), frames(given) {
    config.precision_kind = PrecisionKind::kAbsolute, config.precision = 1e-4;
    config.sequences.push_back({0, std::make_shared<GivenFrames>(std::move(given)), 24.0, 0});
  }
  BakedFile bake() const { return BakedFile::from_bytes(test::bake(scene, config).bytes); }

  Scene scene;
  std::vector<std::vector<Vec3>> frames;
  BakeConfig config;
};

const baked::DeformationRecord& record_of(const BakedFile& file) {
  return deformation_records(file.sections().deformation)[0];
}

double step_of(const BakedFile& file) {
  const baked::GeometryRecord& g = file.geometries()[record_of(file).geometry];
  return PositionGrid{g.step_mantissa, g.step_exponent}.step();
}

/// Corners of all triangles of a frame, rotated so that the smallest is first, sorted.
using Corners = std::vector<std::array<LatticePoint, 3>>;

Corners decoded_corners(const BakedFile& file, const std::function<void(uint32_t, std::span<FrameVertex>)>& read) {
  Corners all;
  const baked::DeformationRecord& record = record_of(file);
  for (uint32_t c = 0; c < file.clusters(record.geometry).size(); ++c) {
    const ClusterView view = file.cluster(record.geometry, c);
    std::vector<FrameVertex> vertices(view.vertex_count());
    read(c, vertices);
    for (uint32_t t = 0; t < view.triangle_count(); ++t) {
      std::array<LatticePoint, 3> corners;
      for (int k = 0; k < 3; ++k)
        for (size_t axis = 0; axis < 3; ++axis)
          corners[static_cast<size_t>(k)][axis] = record.lo[axis] + vertices[view.triangle(t)[k]][axis];
      all.push_back(test::face_of(corners));
    }
  }
  std::sort(all.begin(), all.end());
  return all;
}

/// The corners that the source's frame has after each coordinate is rounded to the nearest step.
Corners source_corners(const MovingScene& moving, size_t frame, double step) {
  Corners all;
  for (const Triangle& t : moving.scene.meshes[0].triangles) {
    std::array<LatticePoint, 3> corners;
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis)
        corners[static_cast<size_t>(k)][static_cast<size_t>(axis)] =
            to_lattice(static_cast<double>(moving.frames[frame][t[k]][axis]), step);
    all.push_back(test::face_of(corners));
  }
  std::sort(all.begin(), all.end());
  return all;
}

Corners corners_of(const BakedFile& file, const DeformationPlayer& player, uint32_t frame) {
  return decoded_corners(file, [&](uint32_t c, std::span<FrameVertex> out) { player.decode(frame, c, out); });
}

Corners current_corners(const BakedFile& file, const DeformationPlayer& player) {
  return decoded_corners(file, [&](uint32_t c, std::span<FrameVertex> out) {
    std::vector<FramePoint> points(out.size());
    player.read(c, points);
    for (size_t v = 0; v < out.size(); ++v)
      for (size_t axis = 0; axis < 3; ++axis) out[v][axis] = static_cast<uint32_t>(points[v][axis]);
  });
}

TEST(Deformation, EveryFrameIsTheSourceRoundedToTheLattice) {
  for (const uint32_t group : {1u, 5u, 8u, 64u}) {
    MovingScene moving(test::Cloth(24), 19);
    moving.config.sequence_group = group;
    const BakedFile file = moving.bake();
    ASSERT_EQ(record_of(file).frame_count, 19u);
    const double step = step_of(file);
    const DeformationPlayer player(file, 0);
    for (uint32_t frame = 0; frame < 19; ++frame) // so that |error| <= step/2 per axis
      ASSERT_EQ(corners_of(file, player, frame), source_corners(moving, frame, step)) << group << " " << frame;
    EXPECT_LE(record_of(file).max_position_error, 0.5 * step + 1e-7); // floats of coordinates up to 1
    EXPECT_GT(record_of(file).max_position_error, 0.4 * step);
  }
}

TEST(Deformation, FramesAreTheSameInWhateverOrderTheyAreVisited) {
  const MovingScene moving(test::Grass(300), 21);
  const BakedFile file = moving.bake();
  DeformationPlayer player(file, 0);
  std::mt19937 generator(5);
  std::vector<uint32_t> order{0, 1, 2, 3, 7, 8, 9, 16, 15, 20, 19, 0, 20, 4};
  for (int i = 0; i < 40; ++i) order.push_back(static_cast<uint32_t>(generator() % 21));
  for (const uint32_t frame : order) {
    player.seek(frame);
    ASSERT_EQ(current_corners(file, player), corners_of(file, player, frame)) << frame;
  }
  player.seek(-3.0); // clamped
  EXPECT_EQ(current_corners(file, player), corners_of(file, player, 0));
  player.seek(1e30);
  EXPECT_EQ(current_corners(file, player), corners_of(file, player, 20));
}

TEST(Deformation, VerticesMoveOnStraightLinesBetweenFrames) {
  const MovingScene moving(test::Cloth(8), 4);
  const BakedFile file = moving.bake();
  DeformationPlayer player(file, 0);
  const uint32_t geometry = record_of(file).geometry;
  std::vector<FrameVertex> a(file.clusters(geometry)[0].vertex_count), b(a.size());
  player.decode(1, 0, a), player.decode(2, 0, b);
  player.seek(1.25);
  std::vector<FramePoint> points(a.size());
  player.read(0, points);
  size_t moved = 0;
  for (size_t v = 0; v < a.size(); ++v)
    for (size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(points[v][axis], 0.75 * a[v][axis] + 0.25 * b[v][axis], 0.501);
      moved += a[v][axis] != b[v][axis];
    }
  EXPECT_GT(moved, 100u);
  EXPECT_EQ(player.frame_at(0.5, false), 12.0);
  EXPECT_EQ(player.frame_at(0.25, true), 2.0); // 6 modulo 4
  EXPECT_EQ(player.frame_at(-1.0 / 24.0, true), 3.0);
}

TEST(Deformation, BytesDoNotDependOnTheNumberOfThreads) {
  const MovingScene moving(test::Cloth(40), 10);
  const std::vector<std::byte> expected = test::bake(moving.scene, moving.config).bytes;
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(test::bake(moving.scene, moving.config).bytes, expected);
}

TEST(Deformation, AllCodecsHoldTheSameFrames) {
  MovingScene moving(test::Cloth(40), 10);
  const BakedFile none = moving.bake();
  for (const PageCodec codec : {PageCodec::kFast, PageCodec::kSmall}) {
    moving.config.codec = codec;
    const BakedFile file = moving.bake();
    EXPECT_TRUE(std::ranges::equal(file.bytes(), none.bytes()));
    EXPECT_LT(file.disk().file_bytes, none.file_bytes());
  }
}

TEST(Deformation, FramesTakeLessThanFloatsAndLessThanAlone) {
  const MovingScene moving(test::Cloth(64), 24);
  const BakedFile file = moving.bake();
  const double frames = 24.0 * static_cast<double>(moving.frames[0].size());
  const double bytes = static_cast<double>(record_of(file).data_bytes) / frames;
  Scene still = moving.scene;
  still.meshes[0].positions = moving.frames[12];
  BakeConfig alone = moving.config;
  alone.sequences.clear();
  const BakeReport report = test::bake(still, alone).report;
  const double bytes_alone =
      static_cast<double>(report.file.bytes.positions) / static_cast<double>(moving.frames[0].size());
  EXPECT_LT(bytes, 2.0); // floats take 12
  EXPECT_LT(bytes, 0.5 * bytes_alone);
}

TEST(Deformation, SurfacesThatTouchInOneFrameComeApartInAnother) {
  Mesh mesh = test::grid_mesh(1);
  const Mesh copy = mesh;
  const auto count = static_cast<uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), copy.positions.begin(), copy.positions.end());
  for (const Triangle& t : copy.triangles) mesh.triangles.push_back(t + Triangle(count)); // coincides with the first
  std::vector<std::vector<Vec3>> frames(3, mesh.positions);
  for (uint32_t v = count; v < 2 * count; ++v) frames[1][v].z += 1.0f, frames[2][v] = Vec3(0.5f); // and has no area
  const MovingScene moving(mesh, frames);
  const BakedFile file = moving.bake();
  const DeformationPlayer player(file, 0);
  for (uint32_t frame = 0; frame < 3; ++frame)
    EXPECT_EQ(corners_of(file, player, frame), source_corners(moving, frame, step_of(file)));
}

TEST(Deformation, VerticesOnOnePathAreStoredOnce) {
  Mesh mesh = test::grid_mesh(8);
  Mesh soup; // the same surface without shared vertices
  for (const Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      soup.positions.push_back(mesh.positions[t[k]]);
      if (k == 2)
        soup.triangles.emplace_back(soup.positions.size() - 3, soup.positions.size() - 2, soup.positions.size() - 1);
    }
  const auto bent = [](std::vector<Vec3> points) {
    for (Vec3& p : points) p.z = p.x * p.y;
    return points;
  };
  const BakedFile shared = MovingScene(mesh, {mesh.positions, bent(mesh.positions)}).bake();
  const BakedFile apart = MovingScene(soup, {soup.positions, bent(soup.positions)}).bake();
  EXPECT_EQ(record_of(apart).vertex_count, record_of(shared).vertex_count);
}

TEST(Deformation, AMeshThatMovesSharesNothingWithOneThatStays) {
  const test::Cloth cloth(20);
  MovingScene moving(cloth, 4);
  moving.scene.meshes.push_back(moving.scene.meshes[0]); // the same bytes
  Shape other = moving.scene.shapes[0];
  other.mesh = 1;
  moving.scene.shapes.push_back(other);
  moving.scene.shapes.push_back(moving.scene.shapes[0]); // a second instance of the one that moves
  moving.scene.shapes.back().parent_from_mesh = test::translation({2, 0, 0});
  const BakedFile file = moving.bake();
  ASSERT_EQ(file.instances().size(), 3u);
  EXPECT_EQ(file.instances()[0].geometry, file.instances()[2].geometry);
  EXPECT_NE(file.instances()[0].geometry, file.instances()[1].geometry);
  ASSERT_EQ(deformation_records(file.sections().deformation).size(), 1u);
  EXPECT_EQ(record_of(file).geometry, file.instances()[0].geometry);
}

TEST(Deformation, RejectsSequencesThatDoNotFit) {
  const test::Cloth cloth(4);
  const auto refused = [](const MovingScene& moving, ErrorKind kind, const char* part) {
    try {
      moving.bake();
      ADD_FAILURE() << part;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), kind) << error.what();
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  const std::vector<std::vector<Vec3>> good = test::sampled(cloth, 3);
  auto frames = good;
  frames[2][5].y = std::numeric_limits<float>::infinity();
  refused({cloth.mesh(0), frames}, ErrorKind::kInput, "frame 2: a vertex position is not finite");
  frames = good, frames[1].pop_back();
  refused({cloth.mesh(0), frames}, ErrorKind::kInput, "frame 1: its vertices");
  refused({cloth.mesh(0.1), good}, ErrorKind::kInput, "frame 0: its vertices");
  refused({cloth.mesh(0), {good[0]}}, ErrorKind::kInput, "one frame only");
  frames = good, frames[1][0].x = 1e6f; // 1e10 steps
  refused({cloth.mesh(0), frames}, ErrorKind::kLimitExceeded, "coarser");
  MovingScene twice(cloth, 3);
  twice.config.sequences.push_back(twice.config.sequences[0]);
  refused(twice, ErrorKind::kUsage, "two sequences");
  MovingScene group(cloth, 3);
  group.config.sequence_group = 65;
  refused(group, ErrorKind::kUsage, "frames per group");
}

TEST(FrameCodec, ReturnsAnyFrameAndRejectsPrefixes) {
  std::mt19937 generator(3);
  for (const uint32_t most : {0u, 1u, 200u, static_cast<uint32_t>(kMaxFrameExtent)})
    for (const size_t count : {size_t{1}, size_t{7}, size_t{256}}) {
      std::vector<std::vector<FrameVertex>> frames(4, std::vector<FrameVertex>(count));
      for (auto& frame : frames)
        for (FrameVertex& v : frame)
          for (uint32_t& x : v) x = static_cast<uint32_t>(generator() % (uint64_t{most} + 1));
      BitWriter writer;
      for (size_t i = 1; i < frames.size(); ++i)
        encode_frame(frames[i],
                     {frames[0], i > 1 ? frames[i - 1] : std::vector<FrameVertex>(),
                      i > 2 ? frames[i - 2] : std::vector<FrameVertex>()},
                     writer);
      writer.align(1);
      std::vector<uint8_t> bits = writer.bytes();
      const uint64_t end = 8 * bits.size();
      bits.resize(bits.size() + kReadSlackBytes);
      uint64_t bit = 0;
      for (size_t i = 1; i < frames.size(); ++i) {
        const uint64_t next =
            skip_frame(bits.data(), bit, end, static_cast<uint32_t>(count), static_cast<uint32_t>(i - 1));
        ASSERT_GT(next, bit);
        EXPECT_EQ(skip_frame(bits.data(), bit, next - 1, static_cast<uint32_t>(count), static_cast<uint32_t>(i - 1)),
                  0u);
        std::vector<FrameVertex> out = i > 2 ? frames[i - 2] : std::vector<FrameVertex>(count);
        FrameReferences from{frames[0], {}, {}};
        if (i > 1) from.previous = frames[i - 1];
        if (i > 2) from.older = out;
        EXPECT_EQ(decode_frame(bits.data(), bit, from, out), next);
        EXPECT_EQ(out, frames[i]);
        bit = next;
      }
      EXPECT_EQ(skip_frame(bits.data(), 0, end, static_cast<uint32_t>(count), 0) != 0, true);
    }
}

/// The section of a file, with room for damage.
struct Section {
  explicit Section(const BakedFile& file)
      : file(file), words((file.sections().deformation.size() + 7) / 8), size(file.sections().deformation.size()) {
    std::memcpy(words.data(), file.sections().deformation.data(), size);
  }
  bool accepted(size_t bytes) const {
    return !find_deformation_fault({reinterpret_cast<const uint8_t*>(words.data()), bytes}, file.geometries(),
                                   file.sections().clusters, file.base_geometry_count());
  }
  uint8_t* bytes() { return reinterpret_cast<uint8_t*>(words.data()); }

  const BakedFile& file;
  std::vector<uint64_t> words;
  size_t size;
};

TEST(Deformation, NoPrefixOfTheSectionIsAccepted) {
  const BakedFile file = MovingScene(test::Cloth(4), 10).bake();
  Section section(file);
  ASSERT_TRUE(section.accepted(section.size));
  for (size_t bytes = 1; bytes < section.size; ++bytes) ASSERT_FALSE(section.accepted(bytes)) << bytes;
}

TEST(Deformation, DamagedBitsAreRejectedOrHarmless) {
  const BakedFile file = MovingScene(test::Cloth(4), 10).bake();
  size_t rejected = 0;
  const size_t bits = 8 * file.sections().deformation.size();
  for (size_t bit = 0; bit < bits; ++bit) {
    std::vector<std::byte> bytes(file.bytes().begin(), file.bytes().end());
    baked::FileHeader header;
    std::memcpy(&header, bytes.data(), sizeof header);
    bytes[header.sections[baked::kDeformation].offset + bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
    test::rehash<baked::FileHeader>(bytes);
    try {
      const BakedFile damaged = BakedFile::from_bytes(bytes);
      DeformationPlayer player(damaged, 0);
      for (const double frame : {9.0, 3.5, 0.0, 4.0}) player.seek(frame);
      std::vector<FrameVertex> out(damaged.clusters(record_of(damaged).geometry)[0].vertex_count);
      player.decode(record_of(damaged).frame_count - 1, 0, out);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
      ++rejected;
    }
  }
  EXPECT_GT(rejected, bits / 20);
  EXPECT_LT(rejected, bits); // fields of vertices can hold anything
}

TEST(Deformation, FaultsAreNamed) {
  const BakedFile file = MovingScene(test::Cloth(4), 10).bake();
  const std::vector<std::byte> bytes(file.bytes().begin(), file.bytes().end());
  const auto after = [&](size_t at, uint32_t value) {
    return test::message_after(bytes, baked::kDeformation, at, value);
  };
  constexpr size_t kRecord = sizeof(baked::DeformationHeader);
  const auto names = [](const std::string& message, const char* part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  names(after(0, 0), "number of animations");
  names(after(0, ~0u), "number of animations");
  names(after(kRecord + offsetof(baked::DeformationRecord, geometry), 9), "geometry");
  names(after(kRecord + offsetof(baked::DeformationRecord, frame_count), 1), "number of frames");
  names(after(kRecord + offsetof(baked::DeformationRecord, frame_count), ~0u), "number of frames");
  names(after(kRecord + offsetof(baked::DeformationRecord, group_frames), 0), "frames per group");
  names(after(kRecord + offsetof(baked::DeformationRecord, reserved), 1), "reserved field");
  names(after(kRecord + offsetof(baked::DeformationRecord, extent), ~0u), "box of all frames");
  names(after(kRecord + offsetof(baked::DeformationRecord, lo) + 4, 0x7fffffff), "box of all frames");
  names(after(kRecord + offsetof(baked::DeformationRecord, vertex_count), 3), "number of vertices");
  names(after(kRecord + offsetof(baked::DeformationRecord, frames_per_second) + 4, 0xbff00000), "frames per second");
  names(after(kRecord + offsetof(baked::DeformationRecord, max_position_error) + 4, 0x7ff00000), "position error");
  names(after(kRecord + offsetof(baked::DeformationRecord, table_offset), 0), "place of its tables");
  names(after(kRecord + offsetof(baked::DeformationRecord, data_offset), 0), "place of its blocks");
  names(after(kRecord + offsetof(baked::DeformationRecord, data_bytes), 5), "table of groups");
  names(after(kRecord + offsetof(baked::DeformationRecord, data_bytes) + 4, 1), "place of its blocks");
  names(after(record_of(file).table_offset, 1), "table of groups");
  names(after(record_of(file).table_offset + 8, 0xffffff), "table of groups");
}

} // namespace
} // namespace packtrace
