#include "tests/compress/lod/lod_class_meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <tuple>
#include <utility>

#include "tests/compress/lod/lod_meshes.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {
namespace {

using Profile = std::vector<glm::dvec2>; ///< corners of a closed outline: distance from the axis, height

/// Adds points so that no side of the outline is longer than `longest`.
Profile divided(const Profile& corners, double longest) {
  Profile out;
  for (size_t i = 0; i < corners.size(); ++i) {
    const glm::dvec2 a = corners[i], b = corners[(i + 1) % corners.size()];
    const double pieces = std::max(1.0, std::ceil(glm::length(b - a) / longest));
    for (double k = 0.0; k < pieces; ++k) out.push_back(a + k / pieces * (b - a));
  }
  return out;
}

/// Adds the quads between rows of points, each closed in itself; the last row joins the first one if `ring`.
void add_rows(Mesh& mesh, uint32_t first, uint32_t rows, uint32_t columns, bool ring) {
  const auto at = [&](uint32_t row, uint32_t column) { return first + (row % rows) * columns + column % columns; };
  for (uint32_t r = 0; r + (ring ? 0 : 1) < rows; ++r)
    for (uint32_t c = 0; c < columns; ++c) {
      mesh.triangles.emplace_back(at(r, c), at(r, c + 1), at(r + 1, c + 1));
      mesh.triangles.emplace_back(at(r, c), at(r + 1, c + 1), at(r + 1, c));
    }
}

/// Turns the profile around the z axis. `outline` scales the distance from the axis by angle and distance.
Mesh turned(const Profile& profile, uint32_t around, const std::function<double(double, double)>& outline) {
  Mesh mesh;
  for (uint32_t i = 0; i < around; ++i) {
    const double angle = 2.0 * M_PI * i / around;
    for (const glm::dvec2& p : profile) {
      const double r = p.x * outline(angle, p.x);
      mesh.positions.push_back(Vec3(DVec3(r * std::cos(angle), r * std::sin(angle), p.y)));
    }
  }
  add_rows(mesh, 0, around, static_cast<uint32_t>(profile.size()), true);
  return mesh;
}

/// A pipe with steps, grooves and chamfers.
Mesh shaft() {
  const Profile corners = {{0.1, 0.0},  {0.3, 0.0}, {0.32, 0.02}, {0.32, 0.5},  {0.28, 0.5}, {0.28, 0.55}, {0.32, 0.55},
                           {0.32, 0.8}, {0.5, 0.8}, {0.5, 1.1},   {0.47, 1.13}, {0.2, 1.13}, {0.2, 1.8},   {0.1, 1.8}};
  return turned(divided(corners, 0.02), 160, [](double, double) { return 1.0; });
}

double tooth(double angle, double r, uint32_t teeth) {
  const double phase = std::fmod(angle * teeth / (2.0 * M_PI), 1.0);
  const double height = std::clamp(4.0 * std::abs(phase - 0.5) - 0.5, 0.0, 1.0);
  return 1.0 + (r > 0.5 ? 0.15 * height * (r - 0.5) / 0.5 : 0.0);
}

Mesh gear() {
  const Profile corners = {{0.2, 0.0}, {1.0, 0.0}, {1.0, 0.25}, {0.4, 0.25}, {0.4, 0.45}, {0.2, 0.45}};
  return turned(divided(corners, 0.035), 480, [](double angle, double r) { return tooth(angle, r, 24); });
}

/// A hexagon with a round hole.
Mesh nut() {
  const Profile corners = {{0.5, 0.0}, {1.0, 0.0}, {1.0, 0.7}, {0.5, 0.7}};
  return turned(divided(corners, 0.03), 240, [](double angle, double r) {
    const double side = std::fmod(angle, M_PI / 3.0) - M_PI / 6.0;
    return 1.0 + (std::cos(M_PI / 6.0) / std::cos(side) - 1.0) * std::clamp((r - 0.5) / 0.5, 0.0, 1.0);
  });
}

/// A tube along a curve, with flat ends.
void add_tube(Mesh& mesh, const std::function<DVec3(double)>& curve, uint32_t steps, uint32_t sides, double radius) {
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (uint32_t i = 0; i <= steps; ++i) {
    const double t = static_cast<double>(i) / steps;
    const DVec3 along = glm::normalize(curve(t + 1e-4) - curve(t - 1e-4));
    const DVec3 u = glm::normalize(glm::cross(along, DVec3(0.31, 0.93, 0.2))), v = glm::cross(along, u);
    for (uint32_t k = 0; k < sides; ++k) {
      const double angle = 2.0 * M_PI * k / sides;
      mesh.positions.push_back(Vec3(curve(t) + radius * (std::cos(angle) * u + std::sin(angle) * v)));
    }
  }
  add_rows(mesh, first, steps + 1, sides, false);
  const uint32_t last = first + steps * sides;
  for (uint32_t k = 2; k < sides; ++k) {
    mesh.triangles.emplace_back(first, first + k, first + k - 1);
    mesh.triangles.emplace_back(last, last + k - 1, last + k);
  }
}

/// One long thin tube in a knot.
Mesh knot() {
  Mesh mesh;
  add_tube(
      mesh,
      [](double t) {
        const double a = 1.99 * M_PI * t;
        return DVec3((2.0 + std::cos(7.0 * a)) * std::cos(2.0 * a), (2.0 + std::cos(7.0 * a)) * std::sin(2.0 * a),
                     std::sin(7.0 * a));
      },
      3000, 6, 0.01);
  return mesh;
}

/// Straight posts and rails, as of a fence.
Mesh fence() {
  Mesh mesh;
  for (uint32_t i = 0; i < 60; ++i) add_tube(mesh, [=](double t) { return DVec3(0.05 * i, 0.0, t); }, 40, 8, 0.004);
  for (uint32_t i = 0; i < 4; ++i)
    add_tube(mesh, [=](double t) { return DVec3(3.0 * t, 0.01, 0.3 * i); }, 400, 8, 0.004);
  return mesh;
}

/// A body with bumps of several sizes.
Mesh boulder() {
  Mesh mesh = sphere_mesh(110);
  for (Vec3& p : mesh.positions) {
    const DVec3 n = glm::normalize(DVec3(p));
    double r = 1.0;
    for (double f = 2.0, a = 0.1; f < 40.0; f *= 1.9, a *= 0.5)
      r += a * std::sin(f * n.x + 1.3 * f) * std::sin(f * n.y + 0.7 * f) * std::sin(f * n.z + f);
    p = Vec3(r * n);
  }
  return mesh;
}

/// A flat ring, open: large flat parts with curved borders.
Mesh washer() {
  Profile row;
  for (uint32_t i = 0; i <= 30; ++i) row.emplace_back(0.5 + i / 60.0, 0.0);
  Mesh mesh = turned(row, 200, [](double, double) { return 1.0; });
  std::erase_if(mesh.triangles, [&](const Triangle& t) { // the quads from the last point of a row to the first one
    const auto is_end = [&](uint32_t v, uint32_t end) { return v % 31 == end; };
    bool inner = false, outer = false;
    for (int i = 0; i < 3; ++i) inner |= is_end(t[i], 0), outer |= is_end(t[i], 30);
    return inner && outer;
  });
  return mesh;
}

/// Open fans of triangles around one point each, in a cone.
Mesh fans() {
  Mesh mesh;
  for (uint32_t f = 0; f < 12; ++f) {
    const DVec3 at(f % 4, f / 4, 0.0);
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    mesh.positions.push_back(Vec3(at + DVec3(0.0, 0.0, 0.02 * f)));
    for (uint32_t i = 0; i < 400; ++i) {
      const double a = 2.0 * M_PI * i / 400;
      mesh.positions.push_back(Vec3(at + 0.45 * DVec3(std::cos(a), std::sin(a), 0.0)));
      mesh.triangles.emplace_back(first, first + 1 + i, first + 1 + (i + 1) % 400);
    }
  }
  return mesh;
}

/// The surface of solid cubes of a cube of side^3: two triangles for each square between a solid and another cube.
Mesh cubes_mesh(int side, const std::function<bool(const glm::ivec3&)>& is_solid) {
  const auto solid = [&](const glm::ivec3& p) {
    for (int axis = 0; axis < 3; ++axis)
      if (p[axis] < 0 || p[axis] >= side) return false;
    return is_solid(p);
  };
  Mesh mesh;
  std::map<std::array<int, 3>, uint32_t> numbers;
  const auto number = [&](const glm::ivec3& p) {
    const auto [at, is_new] = numbers.try_emplace({p.x, p.y, p.z}, static_cast<uint32_t>(mesh.positions.size()));
    if (is_new) mesh.positions.push_back(Vec3(p) / static_cast<float>(side));
    return at->second;
  };
  for (int i = 0; i < side * side * side; ++i) {
    const glm::ivec3 p(i % side, i / side % side, i / side / side);
    if (!solid(p)) continue;
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        glm::ivec3 out(0), u(0), v(0);
        out[axis] = step, u[(axis + 1) % 3] = 1, v[(axis + 2) % 3] = 1;
        if (solid(p + out)) continue;
        if (step < 0) std::swap(u, v);
        const glm::ivec3 at = step > 0 ? p + out : p;
        const std::array<uint32_t, 4> n = {number(at), number(at + u), number(at + u + v), number(at + v)};
        mesh.triangles.emplace_back(n[0], n[1], n[2]);
        mesh.triangles.emplace_back(n[0], n[2], n[3]);
      }
  }
  return mesh;
}

/// Cubes at random places, many of which meet at edges and corners only.
Mesh random_cubes() {
  Random random(9);
  std::vector<uint8_t> solid(18 * 18 * 18);
  for (uint8_t& cube : solid) cube = random.uniform(0, 1) < 0.4f;
  return cubes_mesh(18,
                    [&](const glm::ivec3& p) { return solid[static_cast<size_t>((p.z * 18 + p.y) * 18 + p.x)] != 0; });
}

/// A body with tunnels along all axes.
Mesh tunnels() {
  return cubes_mesh(33, [](const glm::ivec3& p) { return (p.x % 4 < 2) + (p.y % 4 < 2) + (p.z % 4 < 2) < 2; });
}

} // namespace

Mesh plate_mesh(uint32_t cells, double thickness, double bend) {
  Mesh mesh;
  std::map<std::tuple<uint32_t, uint32_t, bool>, uint32_t> numbers;
  const auto number = [&](uint32_t x, uint32_t y, bool top) {
    const auto [at, is_new] = numbers.try_emplace({x, y, top}, static_cast<uint32_t>(mesh.positions.size()));
    if (is_new) {
      const double u = static_cast<double>(x) / cells, v = static_cast<double>(y) / cells;
      const double z = bend * std::sin(M_PI * u) * std::cos(2.0 * v) + (top ? thickness : 0.0);
      mesh.positions.push_back(Vec3(DVec3(u, 0.7 * v, z)));
    }
    return at->second;
  };
  const auto add_quad = [&](const std::array<std::tuple<uint32_t, uint32_t, bool>, 4>& corners) {
    std::array<uint32_t, 4> n{};
    for (size_t i = 0; i < 4; ++i) n[i] = std::apply(number, corners[i]);
    mesh.triangles.emplace_back(n[0], n[1], n[2]);
    mesh.triangles.emplace_back(n[0], n[2], n[3]);
  };
  for (uint32_t y = 0; y < cells; ++y)
    for (uint32_t x = 0; x < cells; ++x) {
      add_quad({{{x, y, true}, {x + 1, y, true}, {x + 1, y + 1, true}, {x, y + 1, true}}});
      add_quad({{{x, y, false}, {x, y + 1, false}, {x + 1, y + 1, false}, {x + 1, y, false}}});
    }
  for (uint32_t i = 0; i < cells; ++i) {
    add_quad({{{i, 0, false}, {i + 1, 0, false}, {i + 1, 0, true}, {i, 0, true}}});
    add_quad({{{i + 1, cells, false}, {i, cells, false}, {i, cells, true}, {i + 1, cells, true}}});
    add_quad({{{0, i + 1, false}, {0, i, false}, {0, i, true}, {0, i + 1, true}}});
    add_quad({{{cells, i, false}, {cells, i + 1, false}, {cells, i + 1, true}, {cells, i, true}}});
  }
  return mesh;
}

Mesh strands_mesh(uint32_t count, uint32_t steps, uint32_t sides, double radius, uint32_t seed) {
  Random random(seed);
  Mesh mesh;
  for (uint32_t i = 0; i < count; ++i) {
    // One draw per declarator: the order in which arguments are evaluated is unspecified.
    const double root_y = random.uniform(0, 1), root_x = random.uniform(0, 1);
    const DVec3 root(root_x, root_y, 0.0);
    const double height = random.uniform(0.6f, 1.2f);
    const double lean_y = random.uniform(-0.4f, 0.4f), lean_x = random.uniform(-0.4f, 0.4f);
    const DVec3 tip = root + DVec3(lean_x, lean_y, height);
    const double curl = random.uniform(0.02f, 0.08f), turns = random.uniform(1.0f, 3.0f);
    add_tube(
        mesh,
        [=](double t) {
          const double a = 2.0 * M_PI * turns * t;
          return root + t * (tip - root) + curl * DVec3(std::cos(a), std::sin(a), 0.5 * std::sin(2.0 * a)) * t;
        },
        steps, sides, radius);
  }
  return mesh;
}

Mesh fins_mesh(uint32_t count, uint32_t steps, uint32_t seed) {
  Random random(seed);
  const auto vector = [&](float size) {
    const double z = random.uniform(-size, size), y = random.uniform(-size, size), x = random.uniform(-size, size);
    return DVec3(x, y, z);
  };
  Mesh mesh;
  for (uint32_t i = 0; i < count; ++i) {
    const DVec3 root = vector(0.5f), along = vector(1.0f), bend = vector(0.15f);
    const DVec3 side = 0.03 * glm::normalize(glm::cross(along, vector(1.0f)));
    const DVec3 up = 0.2 * glm::cross(side, glm::normalize(along));
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (uint32_t row = 0; row <= steps; ++row) {
      const double t = static_cast<double>(row) / steps;
      const DVec3 middle = root + t * along + t * t * bend;
      if (row == steps) mesh.positions.push_back(Vec3(middle));
      for (int corner = -1; corner <= 1 && row < steps; ++corner)
        mesh.positions.push_back(
            Vec3(middle + (1.0 - t) * (static_cast<double>(corner) * side + (corner == 0 ? up : DVec3(0.0)))));
    }
    for (uint32_t row = 0; row < steps; ++row)
      for (uint32_t a = first + 3 * row; a < first + 3 * row + 2; ++a) {
        const uint32_t next = row + 1 == steps ? first + 3 * steps : a + 3;
        mesh.triangles.emplace_back(a, a + 1, next);
        if (row + 1 < steps) mesh.triangles.emplace_back(a + 1, next + 1, next);
      }
  }
  return mesh;
}

Mesh sponge_mesh(uint32_t depth) {
  int side = 1;
  for (uint32_t i = 0; i < depth; ++i) side *= 3;
  return cubes_mesh(side, [=](const glm::ivec3& p) {
    for (int scale = 1; scale < side; scale *= 3) {
      int middles = 0;
      for (int axis = 0; axis < 3; ++axis) middles += p[axis] / scale % 3 == 1;
      if (middles >= 2) return false;
    }
    return true;
  });
}

std::vector<ClassMesh> class_meshes() {
  return {
      {"shaft", "mechanical", shaft},
      {"gear", "mechanical", gear},
      {"nut", "mechanical", nut},
      {"flat plate, 1e-3 thick", "plate", [] { return plate_mesh(100, 1e-3, 0.0); }},
      {"flat plate, 1e-4 thick", "plate", [] { return plate_mesh(100, 1e-4, 0.0); }},
      {"bent plate, 1e-3 thick", "plate", [] { return plate_mesh(100, 1e-3, 0.15); }},
      {"bent plate, 1e-4 thick", "plate", [] { return plate_mesh(100, 1e-4, 0.15); }},
      {"strands of 6 sides", "strands", [] { return strands_mesh(60, 60, 6, 0.004, 5); }},
      {"strands of 3 sides", "strands", [] { return strands_mesh(200, 40, 3, 0.0015, 6); }},
      {"knot", "strands", knot},
      {"fence", "strands", fence},
      {"sponge", "sponge", [] { return sponge_mesh(3); }},
      {"random cubes", "sponge", random_cubes},
      {"tunnels", "sponge", tunnels},
      {"washer", "open", washer},
      {"fans", "open", fans},
      {"fins", "open", [] { return fins_mesh(400, 40, 7); }},
      {"boulder", "organic", boulder},
      {"torus", "organic", [] { return torus_mesh(200, 120); }},
  };
}

} // namespace packtrace::test
