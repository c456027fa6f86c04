#include "assets/generator/primitives.h"

#include <cassert>
#include <vector>

namespace packtrace::scenegen {

uint32_t add_vertex(Mesh& mesh, DVec3 position) {
  mesh.positions.emplace_back(position);
  return static_cast<uint32_t>(mesh.positions.size() - 1);
}

void add_triangle(Mesh& mesh, DVec3 a, DVec3 b, DVec3 c) {
  const uint32_t first = add_vertex(mesh, a);
  add_vertex(mesh, b);
  add_vertex(mesh, c);
  mesh.triangles.emplace_back(first, first + 1, first + 2);
}

void add_quad(Mesh& mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  const auto& p = mesh.positions;
  // Quads may degenerate to triangles; skips halves without area.
  const auto add = [&](uint32_t i, uint32_t j, uint32_t k) {
    if (p[i] != p[j] && p[j] != p[k] && p[k] != p[i]) mesh.triangles.emplace_back(i, j, k);
  };
  add(a, b, c);
  add(a, c, d);
}

void add_quad(Mesh& mesh, DVec3 a, DVec3 b, DVec3 c, DVec3 d) {
  const uint32_t first = add_vertex(mesh, a);
  add_vertex(mesh, b);
  add_vertex(mesh, c);
  add_vertex(mesh, d);
  add_quad(mesh, first, first + 1, first + 2, first + 3);
}

void add_tapered_box(Mesh& mesh, const DAffine& frame, DVec3 lo, DVec3 hi, double taper) {
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  const DVec3 centre = (lo + hi) * 0.5;
  for (uint32_t corner = 0; corner < 8; ++corner) {
    DVec3 p((corner & 1) != 0 ? hi.x : lo.x, (corner & 2) != 0 ? hi.y : lo.y, (corner & 4) != 0 ? hi.z : lo.z);
    if ((corner & 2) != 0) {
      p.x = mix(centre.x, p.x, taper);
      p.z = mix(centre.z, p.z, taper);
    }
    add_vertex(mesh, transform_point(frame, p));
  }
  static constexpr uint32_t kFaces[6][4] = {{0, 2, 3, 1}, {5, 7, 6, 4}, {4, 6, 2, 0},
                                            {1, 3, 7, 5}, {2, 6, 7, 3}, {0, 1, 5, 4}};
  for (const auto& face : kFaces) add_quad(mesh, first + face[0], first + face[1], first + face[2], first + face[3]);
}

void add_box(Mesh& mesh, const DAffine& frame, DVec3 lo, DVec3 hi) { add_tapered_box(mesh, frame, lo, hi, 1.0); }

void add_lathe(Mesh& mesh, const DAffine& frame, std::span<const glm::dvec2> profile, uint32_t sides) {
  assert(profile.size() >= 2 && sides >= 3);
  std::vector<uint32_t> lower, ring;
  for (size_t i = 0; i < profile.size(); ++i) {
    ring.clear();
    const uint32_t count = profile[i].x == 0.0 ? 1 : sides;
    for (uint32_t k = 0; k < count; ++k) {
      const auto [s, c] = sin_cos(2.0 * kPi * k / sides);
      ring.push_back(add_vertex(mesh, transform_point(frame, DVec3(profile[i].x * c, profile[i].y, profile[i].x * s))));
    }
    for (uint32_t k = 0; i > 0 && k < sides; ++k) {
      const uint32_t next = (k + 1) % sides;
      if (lower.size() > 1 && ring.size() > 1) {
        add_quad(mesh, lower[k], ring[k], ring[next], lower[next]);
      } else if (lower.size() > 1) {
        mesh.triangles.emplace_back(lower[k], ring[0], lower[next]);
      } else if (ring.size() > 1) {
        mesh.triangles.emplace_back(lower[0], ring[k], ring[next]);
      }
    }
    lower.swap(ring);
  }
}

void add_tube(Mesh& mesh, std::span<const DVec3> path, std::span<const double> radii, uint32_t sides) {
  assert(path.size() >= 2 && radii.size() == path.size() && sides >= 3);
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  DVec3 x = along(path[0], path[1] - path[0])[0];
  for (size_t i = 0; i < path.size(); ++i) {
    const DVec3 tangent = glm::normalize(path[i + 1 < path.size() ? i + 1 : i] - path[i > 0 ? i - 1 : 0]);
    // Transported along the path, so that the bar does not twist.
    x = glm::normalize(x - tangent * glm::dot(x, tangent));
    const DVec3 z = glm::cross(x, tangent);
    for (uint32_t k = 0; k < sides; ++k) {
      const auto [s, c] = sin_cos(2.0 * kPi * k / sides);
      add_vertex(mesh, path[i] + (x * c + z * s) * radii[i]);
    }
  }
  const auto rings = static_cast<uint32_t>(path.size());
  for (uint32_t i = 0; i + 1 < rings; ++i) {
    for (uint32_t k = 0; k < sides; ++k) {
      const uint32_t next = (k + 1) % sides, low = first + i * sides, high = low + sides;
      add_quad(mesh, low + k, high + k, high + next, low + next);
    }
  }
  const uint32_t last = first + (rings - 1) * sides;
  for (uint32_t k = 1; k + 1 < sides; ++k) {
    mesh.triangles.emplace_back(first, first + k, first + k + 1);
    mesh.triangles.emplace_back(last, last + k + 1, last + k);
  }
}

void add_rod(Mesh& mesh, DVec3 from, DVec3 to, double radius, uint32_t sides) {
  const DVec3 path[] = {from, to};
  const double radii[] = {radius, radius};
  add_tube(mesh, path, radii, sides);
}

void add_blob(Mesh& mesh, const DAffine& frame, uint32_t cells, const std::function<double(DVec3)>& displacement) {
  // The shell of a (cells+1)^3 lattice: neighbouring faces of the cube share their edge vertices.
  const uint32_t side = cells + 1;
  std::vector<uint32_t> index(static_cast<size_t>(side) * side * side, ~0u);
  const auto vertex = [&](glm::uvec3 c) {
    uint32_t& slot = index[(static_cast<size_t>(c.z) * side + c.y) * side + c.x];
    if (slot == ~0u) {
      const DVec3 direction = glm::normalize(DVec3(c) * (2.0 / cells) - DVec3(1.0));
      slot = add_vertex(mesh, transform_point(frame, direction * (1.0 + displacement(direction))));
    }
    return slot;
  };
  for (uint32_t axis = 0; axis < 3; ++axis) {
    for (uint32_t i = 0; i < cells * cells; ++i) {
      glm::uvec3 du(0), dv(0), corner(0);
      du[(axis + 1) % 3] = 1, dv[(axis + 2) % 3] = 1;
      corner[(axis + 1) % 3] = i % cells, corner[(axis + 2) % 3] = i / cells;
      const uint32_t right = vertex(corner + du), opposite = vertex(corner + du + dv), up = vertex(corner + dv);
      add_quad(mesh, vertex(corner), up, opposite, right);
      corner[axis] = cells;
      const uint32_t far_up = vertex(corner + dv), far_opposite = vertex(corner + du + dv),
                     far_right = vertex(corner + du);
      add_quad(mesh, vertex(corner), far_right, far_opposite, far_up);
    }
  }
}

void add_leaf(Mesh& mesh, DVec3 stalk, DVec3 direction, DVec3 side) {
  const DVec3 fold = glm::cross(direction, side) * (0.35 / glm::length(direction));
  const DVec3 middle = stalk + direction * 0.45 + fold;
  const uint32_t first = add_vertex(mesh, stalk);
  add_vertex(mesh, middle + side);
  add_vertex(mesh, stalk + direction);
  add_vertex(mesh, middle - side);
  mesh.triangles.emplace_back(first, first + 1, first + 2);
  mesh.triangles.emplace_back(first, first + 2, first + 3);
}

void PatchBuilder::quad(std::string_view material, const std::array<size_t, 4>& corners) {
  constexpr uint32_t kUnused = ~0u;
  Mesh& mesh = model_.flat(material);
  std::vector<uint32_t>& vertices = vertex_of_point_[&mesh];
  if (vertices.empty()) vertices.assign(points_.size(), kUnused);
  uint32_t v[4];
  for (size_t k = 0; k < 4; ++k) {
    uint32_t& vertex = vertices[corners[k]];
    if (vertex == kUnused) vertex = add_vertex(mesh, points_[corners[k]]);
    v[k] = vertex;
  }
  add_quad(mesh, v[0], v[1], v[2], v[3]);
}

void compute_normals(Mesh& mesh) {
  std::vector<DVec3> sums(mesh.positions.size(), DVec3(0.0));
  for (const Triangle& t : mesh.triangles) {
    const DVec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
    const DVec3 doubled_area = glm::cross(b - a, c - a);
    for (int k = 0; k < 3; ++k) sums[t[k]] += doubled_area;
  }
  mesh.normals.clear();
  for (const DVec3& sum : sums) {
    const double length = glm::length(sum);
    mesh.normals.emplace_back(length > 0.0 ? sum / length : DVec3(0, 1, 0));
  }
}

} // namespace packtrace::scenegen
