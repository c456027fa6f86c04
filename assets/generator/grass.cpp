#include "assets/generator/grass.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "assets/generator/noise.h"
#include "assets/generator/parameter_check.h"
#include "assets/generator/placement.h"
#include "assets/generator/random.h"

namespace packtrace::scenegen {
namespace {

constexpr uint32_t kSegments = 3;
constexpr float kSegmentLength[kSegments] = {0.36f, 0.34f, 0.30f};   ///< fractions of the blade's length
constexpr float kSegmentBend[kSegments] = {0.22f, 0.62f, 1.0f};      ///< fractions of the blade's bend
constexpr float kRingWidth[kSegments] = {1.0f, 0.86f, 0.55f};        ///< at the lower ends of the segments
constexpr float kRingHeight[kSegments + 1] = {0.0f, 0.36f, 0.7f, 1}; ///< as fractions of the length

void check_grass(const GrassConfig& config) {
  check_parameter("blades per side", config.blades_per_side, 1u, 1000u);
  check_parameter("patch size", config.patch_size, 0.001, 10'000.0);
  check_parameter("patches per tile", config.tile_patches, 1u, 64u);
  check_parameter("height", config.height, 0.0001, 1000.0);
  check_parameter("height variation", config.height_variation, 0.0, 0.9);
  check_parameter("clump size", config.clump_size, config.patch_size / 64.0, config.patch_size);
  check_parameter("width", config.width, 0.00001, config.height);
  check_parameter("droop", config.droop, 0.0, 4.0);
  check_parameter("stiffness variation", config.stiffness_variation, 0.0, 0.9);
  double nearer = 0.0, fraction = 1.0, motion = 1.0;
  for (const double distance : config.lod_distances) {
    check_parameter("LOD distance", distance, nearer, 1e9);
    nearer = distance;
  }
  for (uint32_t lod = 0; lod < kGrassLods; ++lod) {
    check_parameter("blades of a LOD", config.lod_blades[lod], 1e-6, fraction);
    check_parameter("wind of a LOD", config.lod_wind[lod], 0.0, motion);
    fraction = config.lod_blades[lod], motion = config.lod_wind[lod];
  }
}

/// What a blade is made from: its cell in the tile, and random numbers of its own.
class BladeMaker {
public:
  BladeMaker(const GrassField& field, int64_t column, int64_t row, uint32_t lod)
      : config_(field.config), wind_(field.wind), column_(wrap(column)), row_(wrap(row)),
        motion_(config_.lod_wind[lod]), half_width_(0.5 * config_.width / std::sqrt(config_.lod_blades[lod])),
        clumps_(std::max(1ll, std::llround(config_.tile_patches * config_.patch_size / config_.clump_size))) {}

  GrassBlade blade(uint32_t cell) const;

private:
  int64_t wrap(int64_t i) const {
    const auto n = static_cast<int64_t>(config_.tile_patches);
    return (i % n + n) % n;
  }
  void add_wind(GrassBlade& blade, glm::dvec2 in_tile, double flexibility, double own_turns) const;

  const GrassConfig& config_;
  const WindField& wind_;
  int64_t column_, row_;
  double motion_, half_width_;
  int64_t clumps_;
};

GrassBlade BladeMaker::blade(uint32_t cell) const {
  const uint32_t n = config_.blades_per_side;
  const uint64_t patch = static_cast<uint64_t>(row_) * config_.tile_patches + static_cast<uint64_t>(column_);
  Random random(config_.seed, 1000 + patch * n * n + cell);
  const double across = random.uniform(-0.48, 0.48), along = random.uniform(-0.48, 0.48);
  const glm::dvec2 in_patch((cell % n + 0.5 + along) / n, (cell / n + 0.5 + across) / n); // of the patch's size
  const glm::dvec2 in_tile = (glm::dvec2(column_, row_) + in_patch) / static_cast<double>(config_.tile_patches);
  const glm::dvec2 at_clump = in_tile * static_cast<double>(clumps_);
  const double clump = tiling_noise(at_clump, clumps_, config_.seed + 1), own = random.uniform(-1.0, 1.0);
  const double variation = 1.0 + config_.height_variation * (0.25 * clump + 0.75 * own);
  GrassBlade blade{};
  blade.root = Vec3(glm::dvec3(in_patch.x, 0.0, in_patch.y) * config_.patch_size);
  blade.length = static_cast<float>(config_.height * variation);
  const auto facing = sin_cos(random.uniform(0.0, 2.0 * kPi));
  blade.side = Vec2(glm::dvec2(facing.cos, facing.sin) * (half_width_ * random.uniform(0.75, 1.25)));
  const auto lean = sin_cos(random.uniform(0.0, 2.0 * kPi));
  blade.rest = Vec2(glm::dvec2(lean.cos, lean.sin) * (config_.droop * random.uniform(0.2, 1.0)));
  const double greener = tiling_noise(at_clump, clumps_, config_.seed + 2);
  blade.colour = static_cast<float>(std::clamp(0.5 + 0.12 * greener + random.uniform(-0.42, 0.42), 0.0, 1.0));
  const double flexibility = variation * (1.0 + config_.stiffness_variation * random.uniform(-1.0, 1.0));
  add_wind(blade, in_tile, flexibility, random.uniform());
  return blade;
}

void BladeMaker::add_wind(GrassBlade& blade, glm::dvec2 in_tile, double flexibility, double own_turns) const {
  const WindConfig& wind = wind_.config;
  const double bend = wind.strength * flexibility;
  const auto direction = sin_cos(wind.direction_rad);
  blade.rest += Vec2(glm::dvec2(direction.cos, direction.sin) * bend);
  for (size_t i = 0; i < kWindWaves; ++i) {
    const WindWave& wave = wind_.waves[i];
    const double turns =
        static_cast<double>(wave.cycles_x) * in_tile.x + static_cast<double>(wave.cycles_z) * in_tile.y + wave.offset;
    const auto [s, c] = sin_cos(2.0 * kPi * (turns - std::floor(turns)));
    blade.gusts[i] = Vec2(glm::dvec2(s, -c) * (bend * motion_ * wind.gustiness * wave.amplitude));
  }
  blade.flutter = static_cast<float>(bend * motion_ * wind.flutter);
  const auto own = sin_cos(2.0 * kPi * own_turns);
  blade.own_phase = Vec2(glm::dvec2(own.cos, own.sin));
}

/// Bend (x, z) of a blade at a moment.
Vec2 bend_at(const GrassBlade& blade, const WindMoment& moment) {
  float along = 0.0f;
  for (size_t i = 0; i < kWindWaves; ++i)
    along += blade.gusts[i].x * moment.waves[i].x + blade.gusts[i].y * moment.waves[i].y;
  // The tip moves on an ellipse by itself: cos(a - b) along the wind, half of sin(a - b) across it.
  const Vec2 own = blade.own_phase, time = moment.flutter;
  along += blade.flutter * (own.x * time.x + own.y * time.y);
  const float across = 0.5f * blade.flutter * (own.y * time.x - own.x * time.y);
  const Vec2 d = moment.direction;
  return blade.rest + Vec2(d.x * along - d.y * across, d.y * along + d.x * across);
}

} // namespace

GrassField make_grass_field(const GrassConfig& config) {
  check_grass(config);
  return {config, make_wind_field(config.wind, config.patch_size * config.tile_patches, config.seed)};
}

uint32_t grass_lod(const GrassConfig& config, double distance) {
  const auto& ends = config.lod_distances;
  return static_cast<uint32_t>(std::upper_bound(ends.begin(), ends.end(), distance) - ends.begin());
}

uint32_t grass_blade_count(const GrassConfig& config, uint32_t lod) {
  const double all = static_cast<double>(config.blades_per_side) * config.blades_per_side;
  return static_cast<uint32_t>(std::max(1ll, std::llround(all * config.lod_blades[lod])));
}

std::vector<GrassBlade> make_grass_blades(const GrassField& field, int64_t column, int64_t row, uint32_t lod) {
  assert(lod < kGrassLods);
  const GrassConfig& config = field.config;
  std::vector<uint32_t> cells(config.blades_per_side * config.blades_per_side);
  std::iota(cells.begin(), cells.end(), 0u);
  // The blades that stay at coarser LODs come first in a random order, the same at every LOD.
  const auto rank = [&](uint32_t cell) { return hash_bits(config.seed ^ (cell + 0x5bd1e995u)); };
  std::sort(cells.begin(), cells.end(), [&](uint32_t a, uint32_t b) { return rank(a) < rank(b); });
  cells.resize(grass_blade_count(config, lod));
  std::sort(cells.begin(), cells.end());
  const BladeMaker maker(field, column, row, lod);
  std::vector<GrassBlade> blades;
  blades.reserve(cells.size());
  for (const uint32_t cell : cells) blades.push_back(maker.blade(cell));
  return blades;
}

void write_grass_triangles(std::span<Triangle> triangles) {
  assert(triangles.size() % kBladeTriangles == 0);
  uint32_t v = 0;
  for (size_t t = 0; t < triangles.size(); t += kBladeTriangles, v += kBladeVertices) {
    triangles[t] = {v, v + 1, v + 3};
    triangles[t + 1] = {v, v + 3, v + 2};
    triangles[t + 2] = {v + 2, v + 3, v + 5};
    triangles[t + 3] = {v + 2, v + 5, v + 4};
    triangles[t + 4] = {v + 4, v + 5, v + 6};
  }
}

void write_grass_uvs(std::span<const GrassBlade> blades, std::span<Vec2> uvs) {
  assert(uvs.size() == blades.size() * kBladeVertices);
  size_t v = 0;
  for (const GrassBlade& blade : blades) {
    for (uint32_t ring = 0; ring < kSegments; ++ring) uvs[v] = uvs[v + 1] = {blade.colour, kRingHeight[ring]}, v += 2;
    uvs[v++] = {blade.colour, kRingHeight[kSegments]};
  }
}

void write_grass_positions(std::span<const GrassBlade> blades, const WindMoment& moment, std::span<Vec3> positions) {
  assert(positions.size() == blades.size() * kBladeVertices);
  Vec3* out = positions.data();
  for (const GrassBlade& blade : blades) {
    const Vec2 bend = bend_at(blade, moment);
    const Vec3 side(blade.side.x, 0.0f, blade.side.y);
    Vec3 centre = blade.root;
    for (uint32_t segment = 0; segment < kSegments; ++segment) {
      *out++ = centre - side * kRingWidth[segment];
      *out++ = centre + side * kRingWidth[segment];
      const Vec2 lean = bend * kSegmentBend[segment];
      const float step = blade.length * kSegmentLength[segment] / std::sqrt(1.0f + lean.x * lean.x + lean.y * lean.y);
      centre += Vec3(lean.x * step, step, lean.y * step);
    }
    *out++ = centre;
  }
}

Bounds grass_bounds(std::span<const GrassBlade> blades) {
  Bounds bounds;
  for (const GrassBlade& blade : blades) {
    // A horizontal reach of the whole length allows for rounding, as a blade never lies flat.
    const double half_width = glm::length(glm::dvec2(blade.side)), reach = blade.length + half_width;
    bounds.extend(DVec3(blade.root) - DVec3(reach, 0.0, reach));
    bounds.extend(DVec3(blade.root) + DVec3(reach, blade.length * 1.00001, reach));
  }
  return bounds;
}

} // namespace packtrace::scenegen
