#include "tests/runtime/lod/lod_records.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "compress/bake/lod/lod_encoder.h"

namespace packtrace::test {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();

glm::dmat3 random_rotation(Random& random) {
  DVec3 axis(0.0);
  while (!(glm::length(axis) > 0.1)) axis = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
  axis = glm::normalize(axis);
  const double angle = random.uniform(0.0f, 6.2831853f), c = std::cos(angle), s = std::sin(angle);
  const glm::dmat3 cross(DVec3(0, axis.z, -axis.y), DVec3(-axis.z, 0, axis.x), DVec3(axis.y, -axis.x, 0));
  return c * glm::dmat3(1.0) + s * cross + (1.0 - c) * glm::outerProduct(axis, axis);
}

DAffine affine(const glm::dmat3& linear, DVec3 translation) { return {linear[0], linear[1], linear[2], translation}; }

baked::LodGroupRecord random_group(Random& random, uint32_t level) {
  baked::LodGroupRecord g{};
  g.level = level;
  for (float& c : g.center) c = random.uniform(-1, 1);
  g.radius = random.uniform(0.01f, 0.2f);
  g.error = random.uniform(0.0005f, 0.002f);
  return g;
}

DVec3 random_point(Random& random, double half_size) {
  const auto h = static_cast<float>(half_size);
  return {random.uniform(-h, h), random.uniform(-h, h), random.uniform(-h, h)};
}

} // namespace

LodRecords records_of(const BuiltLod& built) {
  QuantizedGeometry geometry = built.geometry;
  ClusterLod lod = built.lod;
  EncodedLod encoded = encode_lod(geometry, lod);
  LodRecords out{std::move(encoded.groups), {}, {}};
  for (const LodCluster& c : built.lod.clusters) {
    out.links.push_back({c.group, c.generating_group});
    out.cluster_triangles.push_back(c.range.triangle_count);
  }
  return out;
}

LodRecords random_records(uint32_t finest, uint32_t seed) {
  Random random(seed);
  LodRecords out;
  struct Made { // clusters made from a group of the level below
    uint32_t group;
    uint32_t clusters, triangles;
  };
  std::vector<Made> below;
  for (uint32_t level = 0, count = finest; level < 31; ++level, count = std::max(1u, count / 2)) {
    const auto first = static_cast<uint32_t>(out.groups.size());
    std::vector<Made> made;
    for (uint32_t i = 0; i < count; ++i) out.groups.push_back(random_group(random, level));
    const auto add_cluster = [&](uint32_t group, uint32_t generating, uint32_t triangles) {
      out.links.push_back({group, generating});
      out.cluster_triangles.push_back(triangles);
    };
    std::vector<uint32_t> triangles(count);
    if (level == 0) {
      for (uint32_t i = 0; i < count; ++i)
        for (uint32_t k = 0; k < 1 + random.bits() % 24; ++k) {
          add_cluster(first + i, baked::kNoLodGroup, 64 + random.bits() % 65);
          triangles[i] += out.cluster_triangles.back();
        }
    }
    for (size_t m = 0; m < below.size(); ++m) {
      const auto to = static_cast<uint32_t>(m) % count; // each group gets some
      for (uint32_t k = 0; k < below[m].clusters; ++k) {
        // Clusters made from one group may go to several groups.
        const uint32_t to_this = k == 0 ? to : (to + random.bits() % 2) % count;
        baked::LodGroupRecord& g = out.groups[first + to_this];
        const baked::LodGroupRecord& b = out.groups[below[m].group];
        const double apart = std::hypot(double{g.center[0]} - b.center[0], double{g.center[1]} - b.center[1],
                                        double{g.center[2]} - b.center[2]);
        g.radius = std::max(g.radius, static_cast<float>((apart + b.radius) * (1.0 + 1e-6)));
        g.error = std::max(g.error, b.error * random.uniform(1.0f, 3.0f));
        add_cluster(first + to_this, below[m].group, below[m].triangles / below[m].clusters);
        triangles[to_this] += out.cluster_triangles.back();
      }
    }
    for (uint32_t i = 0; i < count; ++i) {
      const uint32_t half = triangles[i] / 2;
      if (half < 8 || (count == 1 && level > 3 && half < 64) || random.uniform(0, 1) < 0.05f)
        out.groups[first + i].error = kInfinite;
      else
        made.push_back({first + i, 1 + half / 128, half});
    }
    if (made.empty()) break;
    below = made;
    count = std::min(count, 2 * static_cast<uint32_t>(made.size()));
  }
  for (size_t i = 0; i < out.groups.size(); ++i)
    if (out.groups[i].level == 30) out.groups[i].error = kInfinite;
  return out;
}

DAffine random_affine(Random& random, double translation) {
  const glm::dmat3 a = random_rotation(random), b = random_rotation(random);
  const double scale = std::exp2(random.uniform(-4, 4));
  glm::dmat3 stretch(scale);
  for (int i = 0; i < 3; ++i) stretch[i][i] *= std::exp(random.uniform(0.0f, std::log(24.0f)));
  stretch[1][0] = scale * random.uniform(-2, 2); // shear
  if (random.bits() % 2 != 0) stretch[2][2] = -stretch[2][2];
  return affine(a * stretch * b, random_point(random, translation));
}

std::vector<LodInstance> random_instances(uint32_t count, uint32_t geometries, double half_size, double largest_scale,
                                          uint32_t seed) {
  Random random(seed);
  std::vector<LodInstance> instances;
  for (uint32_t i = 0; i < count; ++i) {
    glm::dmat3 stretch(1.0);
    for (int axis = 0; axis < 3; ++axis)
      stretch[axis][axis] = std::exp(random.uniform(0.0f, std::log(static_cast<float>(largest_scale))));
    const glm::dmat3 linear = random_rotation(random) * stretch * random_rotation(random);
    instances.push_back({random.bits() % geometries, affine(linear, random_point(random, half_size))});
  }
  return instances;
}

} // namespace packtrace::test
