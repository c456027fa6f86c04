#include "tests/benchmarks/packing_benchmark_grids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <utility>

#include "assets/generator/random.h"

namespace packtrace {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr uint32_t kPoints = 175; ///< points per side of a height field

using scenegen::Random;

/// How quads (a, b, c, d) are cut.
enum class Cut { kEqual, kAlternating, kShorter };

using Surface = std::function<DVec3(uint32_t, uint32_t)>;

/// @param closed_columns, closed_rows whether quads also join the last column, or row, of points to the first
Mesh make_quads(const Surface& place, uint32_t columns, uint32_t rows, bool closed_columns = false,
                bool closed_rows = false, Cut cut = Cut::kEqual) {
  Mesh mesh;
  for (uint32_t j = 0; j < rows; ++j)
    for (uint32_t i = 0; i < columns; ++i) mesh.positions.emplace_back(place(i, j));
  const auto distance = [&](uint32_t p, uint32_t q) {
    return glm::distance(DVec3(mesh.positions[p]), DVec3(mesh.positions[q]));
  };
  for (uint32_t j = 0; j < (closed_rows ? rows : rows - 1); ++j)
    for (uint32_t i = 0; i < (closed_columns ? columns : columns - 1); ++i) {
      const uint32_t right = (i + 1) % columns, above = (j + 1) % rows;
      const uint32_t a = j * columns + i, b = j * columns + right, c = above * columns + right, d = above * columns + i;
      const bool turned =
          cut == Cut::kAlternating ? (i + j) % 2 != 0 : cut == Cut::kShorter && distance(b, d) < distance(a, c);
      mesh.triangles.emplace_back(a, b, turned ? d : c);
      mesh.triangles.emplace_back(turned ? b : a, c, d);
    }
  return mesh;
}

/// A height field over [0,1]^2.
Mesh make_heights(const std::function<double(uint32_t, uint32_t)>& height, Cut cut = Cut::kEqual) {
  return make_quads([&](uint32_t i, uint32_t j) { return DVec3(i, j, kPoints * height(i, j)) / double{kPoints}; },
                    kPoints, kPoints, false, false, cut);
}

double waves(uint32_t i, uint32_t j) { return 0.05 * std::sin(0.11 * i) * std::cos(0.07 * j); }

Mesh make_noise() {
  Random random(1);
  return make_heights([&](uint32_t, uint32_t) { return 0.002 * random.uniform(); });
}

Mesh make_rough_waves(Cut cut) {
  Random random(2);
  return make_heights([&](uint32_t i, uint32_t j) { return waves(i, j) + 0.001 * random.uniform(); }, cut);
}

/// Six octaves of value noise.
Mesh make_terrain() {
  Random random(3);
  std::map<std::pair<int, int>, double> values;
  const auto value = [&](int x, int y) {
    const auto [at, is_new] = values.try_emplace({x, y});
    if (is_new) at->second = random.uniform();
    return at->second;
  };
  const auto noise = [&](double x, double y) {
    const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
    const auto smooth = [](double t) { return t * t * (3.0 - 2.0 * t); };
    const double u = smooth(x - i), v = smooth(y - j);
    return std::lerp(std::lerp(value(i, j), value(i + 1, j), u), std::lerp(value(i, j + 1), value(i + 1, j + 1), u), v);
  };
  return make_heights([&](uint32_t i, uint32_t j) {
    double x = 4.0 * i / kPoints, y = 4.0 * j / kPoints, sum = 0.0;
    for (double weight = 0.125; weight > 0.003; weight *= 0.5, x *= 2.03, y *= 2.03) sum += weight * noise(x, y);
    return sum;
  });
}

/// Waves with a round hole, whose triangles are in random order.
Mesh make_hole() {
  Mesh mesh = make_heights(waves);
  std::erase_if(mesh.triangles,
                [&](const Triangle& t) { return glm::distance(Vec2(mesh.positions[t.x]), Vec2(0.5f)) < 0.2f; });
  Random random(4);
  for (auto left = static_cast<uint32_t>(mesh.triangles.size()); left > 1; --left)
    std::swap(mesh.triangles[left - 1], mesh.triangles[random.below(left)]);
  return mesh;
}

/// A sphere without its poles.
Mesh make_sphere() {
  return make_quads(
      [](uint32_t i, uint32_t j) {
        const double u = kTurn * i / 240.0, v = 0.5 * kTurn * (j + 0.5) / 125.0;
        return DVec3(std::cos(u) * std::sin(v), std::sin(u) * std::sin(v), std::cos(v));
      },
      240, 125, true);
}

Mesh make_torus(uint32_t around, uint32_t across, double radius) {
  return make_quads(
      [&](uint32_t i, uint32_t j) {
        const double u = kTurn * i / around, v = kTurn * j / across, r = 1.0 + radius * std::cos(v);
        return DVec3(r * std::cos(u), r * std::sin(u), radius * std::sin(v));
      },
      around, across, true, true);
}

Mesh make_knot() {
  constexpr uint32_t kAround = 600, kAcross = 50;
  const auto spine = [](double t) {
    const double r = 2.0 + std::cos(3.0 * t);
    return DVec3(r * std::cos(2.0 * t), r * std::sin(2.0 * t), std::sin(3.0 * t));
  };
  return make_quads(
      [&](uint32_t i, uint32_t j) {
        const double t = kTurn * i / kAround, s = kTurn * j / kAcross;
        const DVec3 p = spine(t), along = glm::normalize(spine(t + 1e-3) - p), out(p.x, p.y, 0.0);
        const DVec3 normal = glm::normalize(out - glm::dot(out, along) * along);
        return p + 0.4 * (std::cos(s) * normal + std::sin(s) * glm::cross(along, normal));
      },
      kAround, kAcross, true, true);
}

/// A cylinder with fans as caps.
Mesh make_cylinder() {
  constexpr uint32_t kAround = 200, kRows = 150;
  Mesh mesh = make_quads(
      [](uint32_t i, uint32_t j) {
        const double u = kTurn * i / kAround;
        return DVec3(std::cos(u), std::sin(u), 0.03 * j);
      },
      kAround, kRows, true);
  const uint32_t bottom = kAround * kRows, top = bottom + 1, last_row = kAround * (kRows - 1);
  mesh.positions.emplace_back(0.0f, 0.0f, 0.0f);
  mesh.positions.emplace_back(DVec3(0.0, 0.0, 0.03 * (kRows - 1)));
  for (uint32_t i = 0; i < kAround; ++i) {
    mesh.triangles.emplace_back(bottom, (i + 1) % kAround, i);
    mesh.triangles.emplace_back(top, last_row + i, last_row + (i + 1) % kAround);
  }
  return mesh;
}

/// An icosahedron whose triangles are divided six times.
Mesh make_icosphere() {
  const double t = std::numbers::phi;
  std::vector<DVec3> points{{-1, t, 0},  {1, t, 0},  {-1, -t, 0}, {1, -t, 0}, {0, -1, t},  {0, 1, t},
                            {0, -1, -t}, {0, 1, -t}, {t, 0, -1},  {t, 0, 1},  {-t, 0, -1}, {-t, 0, 1}};
  std::vector<Triangle> triangles{{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                  {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                                  {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (DVec3& p : points) p = glm::normalize(p);
  for (int level = 0; level < 6; ++level) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
    const auto middle = [&](uint32_t a, uint32_t b) {
      const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<uint32_t>(points.size()));
      if (is_new) points.push_back(glm::normalize(points[a] + points[b]));
      return at->second;
    };
    std::vector<Triangle> finer;
    for (const Triangle& f : triangles) {
      const uint32_t x = middle(f.x, f.y), y = middle(f.y, f.z), z = middle(f.z, f.x);
      finer.insert(finer.end(), {{f.x, x, z}, {f.y, y, x}, {f.z, z, y}, {x, y, z}});
    }
    triangles = std::move(finer);
  }
  Mesh mesh;
  for (const DVec3& p : points) mesh.positions.emplace_back(p);
  mesh.triangles = std::move(triangles);
  return mesh;
}

struct GridInput {
  std::string_view name;
  Mesh (*make)();
};
constexpr std::array kInputs{GridInput{"grid-waves",
                                       [] {
                                         return make_heights([](uint32_t i, uint32_t j) {
                                           return 0.1 * std::sin(0.05 * i) * std::cos(0.07 * j);
                                         });
                                       }},
                             GridInput{"grid-noise", make_noise},
                             GridInput{"grid-terrain", make_terrain},
                             GridInput{"grid-hole", make_hole},
                             GridInput{"grid-sphere", make_sphere},
                             GridInput{"grid-torus", [] { return make_torus(300, 100, 1.0 / 3.0); }},
                             GridInput{"grid-thin-torus", [] { return make_torus(300, 12, 0.04); }},
                             GridInput{"grid-knot", make_knot},
                             GridInput{"grid-cylinder", make_cylinder},
                             GridInput{"grid-icosphere", make_icosphere},
                             GridInput{"grid-alternating", [] { return make_rough_waves(Cut::kAlternating); }},
                             GridInput{"grid-shorter", [] { return make_rough_waves(Cut::kShorter); }}};

constexpr auto kNames = [] {
  std::array<std::string_view, kInputs.size()> names;
  for (size_t i = 0; i < names.size(); ++i) names[i] = kInputs[i].name;
  return names;
}();

} // namespace

std::span<const std::string_view> grid_input_names() { return kNames; }

Mesh make_grid_input(std::string_view name) { return std::ranges::find(kInputs, name, &GridInput::name)->make(); }

} // namespace packtrace
