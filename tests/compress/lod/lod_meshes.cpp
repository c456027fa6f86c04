#include "tests/compress/lod/lod_meshes.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <set>

#include "compress/bake/grid/geometry_measure.h"
#include "compress/bake/plan/requirements.h"
#include "pbrt_import/base/progress.h"
#include "tests/compress/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace::test {

Mesh torus_mesh(uint32_t around, uint32_t across) {
  Mesh mesh;
  mesh.name = "torus";
  for (uint32_t i = 0; i < around; ++i)
    for (uint32_t k = 0; k < across; ++k) {
      const double u = 2.0 * M_PI * i / around, v = 2.0 * M_PI * k / across;
      const double r = 1.0 + 0.35 * std::cos(v) + 0.02 * std::sin(7.0 * u + 3.0 * v);
      mesh.positions.push_back(Vec3(DVec3(r * std::cos(u), r * std::sin(u), 0.35 * std::sin(v))));
    }
  const auto at = [&](uint32_t i, uint32_t k) { return (i % around) * across + k % across; };
  for (uint32_t i = 0; i < around; ++i)
    for (uint32_t k = 0; k < across; ++k) {
      mesh.triangles.emplace_back(at(i, k), at(i + 1, k), at(i + 1, k + 1));
      mesh.triangles.emplace_back(at(i, k), at(i + 1, k + 1), at(i, k + 1));
    }
  return mesh;
}

Mesh half_faceted(const Mesh& mesh) {
  Mesh out;
  out.name = mesh.name + " half faceted";
  out.positions = mesh.positions;
  for (const Vec3& p : mesh.positions) out.normals.push_back(glm::normalize(p));
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    if (i % 2 == 0) {
      out.triangles.push_back(t);
      continue;
    }
    const Vec3 &a = mesh.positions[t.x], &b = mesh.positions[t.y], &c = mesh.positions[t.z];
    const Vec3 n = glm::normalize(glm::cross(b - a, c - a) + Vec3(1e-6f, 0.0f, 0.0f)) + 0.2f * glm::normalize(a);
    const auto first = static_cast<uint32_t>(out.positions.size());
    for (const Vec3& p : {a, b, c}) out.positions.push_back(p), out.normals.push_back(glm::normalize(n));
    out.triangles.emplace_back(first, first + 1, first + 2);
  }
  return out;
}

Mesh tetrahedra_mesh(uint32_t count, uint32_t seed) {
  Random random(seed);
  Mesh mesh;
  mesh.name = "tetrahedra";
  for (uint32_t i = 0; i < count; ++i) {
    const Vec3 center(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    const float size = random.uniform(0.002f, 0.01f);
    for (const Vec3& corner : {Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)})
      mesh.positions.push_back(center + size * corner);
    for (const Triangle& t : {Triangle(0, 1, 2), Triangle(0, 3, 1), Triangle(0, 2, 3), Triangle(1, 3, 2)})
      mesh.triangles.push_back(t + first);
  }
  return mesh;
}

Mesh chamfered_sheet(float cut) {
  constexpr int kCells = 12;
  Mesh mesh;
  std::map<std::pair<float, float>, uint32_t> numbers;
  const auto number = [&](Vec2 p) {
    const auto [at, is_new] = numbers.try_emplace({p.x, p.y}, static_cast<uint32_t>(mesh.positions.size()));
    if (is_new) mesh.positions.push_back(Vec3(p, 0.0f) / static_cast<float>(kCells));
    return at->second;
  };
  const auto is_inner = [](float x) { return x > 0.0f && x < static_cast<float>(kCells); };
  constexpr std::array<std::pair<int, int>, 4> kCorners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  for (int y = 0; y < kCells; ++y)
    for (int x = 0; x < kCells; ++x) {
      const auto corner = [&](size_t k) {
        return Vec2(static_cast<float>(x + kCorners[k % 4].first), static_cast<float>(y + kCorners[k % 4].second));
      };
      std::vector<Vec2> cell;
      size_t inner = 0; // the corner that all triangles of the cell share
      for (size_t k = 0; k < 4; ++k) {
        const Vec2 p = corner(k);
        if (std::fmod(p.x, static_cast<float>(kCells)) + std::fmod(p.y, static_cast<float>(kCells)) > 0.0f) {
          if (is_inner(p.x) && is_inner(p.y)) inner = cell.size();
          cell.push_back(p);
        } else {
          cell.push_back(p + cut * (corner(k + 3) - p));
          cell.push_back(p + cut * (corner(k + 1) - p));
        }
      }
      std::rotate(cell.begin(), cell.begin() + static_cast<std::ptrdiff_t>(inner), cell.end());
      for (size_t k = 2; k < cell.size(); ++k)
        mesh.triangles.emplace_back(number(cell[0]), number(cell[k - 1]), number(cell[k]));
    }
  return mesh;
}

Mesh twice(Mesh mesh, bool other_side) {
  const std::vector<Triangle> once = mesh.triangles;
  for (const Triangle& t : once) mesh.triangles.push_back(other_side ? Triangle(t.x, t.z, t.y) : t);
  return mesh;
}

namespace {

/// A chain of triangles in which each shares only a corner with the next.
Mesh vertex_chain() {
  Random random(11);
  Mesh mesh;
  Vec3 at(0.0f);
  const auto step = [&] { return Vec3(random.uniform(-0.1f, 1), random.uniform(-1, 1), random.uniform(-1, 1)); };
  mesh.positions.push_back(at);
  for (uint32_t i = 0; i < 3000; ++i) {
    const Vec3 next = at + step();
    mesh.positions.push_back(at + 0.5f * step());
    mesh.positions.push_back(next);
    mesh.triangles.emplace_back(2 * i, 2 * i + 1, 2 * i + 2);
    at = next;
  }
  return mesh;
}

/// A torn, bumpy sheet seen from both sides.
Mesh rough_two_sided_sheet() {
  Random random(12);
  Mesh mesh = grid_mesh(60);
  for (Vec3& p : mesh.positions) p.z += random.uniform(0.0f, 0.02f);
  std::erase_if(mesh.triangles, [&](const Triangle&) { return random.uniform(0, 1) < 0.1f; });
  return twice(mesh, true);
}

/// Non-manifold: all pieces share one point.
Mesh tetrahedra_on_one_point() {
  Mesh mesh = tetrahedra_mesh(1500, 3);
  for (size_t i = 0; i < mesh.positions.size(); i += 4) mesh.positions[i] = Vec3(0.0f);
  return mesh;
}

/// All triangles are degenerate.
Mesh without_area() {
  Mesh mesh = grid_mesh(50);
  for (Vec3& p : mesh.positions) p.y = 0.25f;
  return mesh;
}

/// Triangles with two equal corners: some between other triangles, some isolated.
Mesh lines_among_triangles() {
  Random random(13);
  Mesh mesh = grid_mesh(40, 0.05f);
  const auto count = static_cast<uint32_t>(mesh.positions.size());
  for (uint32_t i = 0; i < 200; ++i) {
    const uint32_t a = random.bits() % count, b = i % 2 == 0 ? a + 1 : random.bits() % count;
    mesh.triangles.emplace_back(a, a, b % count);
  }
  for (uint32_t i = 0; i < 50; ++i) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (int k = 0; k < 2; ++k)
      mesh.positions.emplace_back(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0.0f, 0.3f));
    mesh.triangles.emplace_back(first, first + 1, first);
  }
  return mesh;
}

Mesh triangles_around_an_edge() {
  Mesh mesh;
  mesh.positions = {Vec3(0, 0, -1), Vec3(0, 0, 1)};
  for (uint32_t i = 0; i < 3000; ++i) {
    const double angle = 2.0 * M_PI * i / 3000.0;
    mesh.positions.push_back(Vec3(DVec3(std::cos(angle), std::sin(angle), 0.0)));
    mesh.triangles.emplace_back(0, 1, i + 2);
  }
  return mesh;
}

/// Triangles of the soup. No two merge, so that each distance from its levels takes time in proportion to their number.
const uint32_t kSoup = test::sanitized() ? 1500 : 2500;

} // namespace

std::vector<NamedMesh> stress_meshes() {
  return {
      {"torus", [] { return torus_mesh(96, 64); }, true},
      {"half faceted torus", [] { return half_faceted(torus_mesh(96, 64)); }, true},
      {"2000 tetrahedra", [] { return tetrahedra_mesh(2000, 1); }, true},
      {"two sided sheet", [] { return twice(torus_mesh(48, 32), true); }, true},
      {"tetrahedra on one point", tetrahedra_on_one_point, true},
      {"vertex chain", vertex_chain, false},
      {"rough two sided sheet", rough_two_sided_sheet, true},
      {"sphere", [] { return sphere_mesh(80); }, false}, // open at its seam, where rounding differs
      {"bumped plane with a border", [] { return grid_mesh(80, 0.05f, true); }, false},
      {"flat plane", [] { return grid_mesh(70); }, false},
      {"sheet with small chamfers", [] { return chamfered_sheet(0.05f); }, false},
      {"sheet with chamfers", [] { return chamfered_sheet(0.1f); }, false},
      {"sheet with large chamfers", [] { return chamfered_sheet(0.3f); }, false},
      {"paper", [] { return twice(chamfered_sheet(0.5f), true); }, true},
      {"paper twice", [] { return twice(chamfered_sheet(0.5f), false); }, false},
      {"soup", [] { return soup_mesh(kSoup, 7); }, false},
      {"every triangle twice", [] { return twice(grid_mesh(50, 0.05f), false); }, false},
      {"triangles without area", without_area, false},
      {"lines among triangles", lines_among_triangles, false},
      {"3000 triangles around an edge", triangles_around_an_edge, false},
      {"one triangle", [] { return soup_mesh(1, 1); }, false},
  };
}

std::vector<NamedMesh> closed_stress_meshes() {
  std::vector<NamedMesh> closed = stress_meshes();
  std::erase_if(closed, [](const NamedMesh& mesh) { return !mesh.closed; });
  return closed;
}

std::string identifier(std::string name) {
  std::replace_if(name.begin(), name.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
  return name;
}

BakeConfig config_with_levels(LodUse use, uint32_t min_triangles) {
  BakeConfig config;
  config.lod = use;
  config.lod_min_triangles = min_triangles;
  return config;
}

Scene mixed_lod_scene() {
  Scene scene = scene_of(torus_mesh(24, 16));
  scene.masks.push_back(striped_mask());
  scene.materials.push_back({"leaf", kAlphaMask, Vec3(0.5f), 0, kNoMask});
  scene.meshes.push_back(grid_mesh(40, 0.3f, true));
  scene.meshes.push_back(half_faceted(torus_mesh(40, 30)));
  scene.objects.push_back({"both", {Shape{1, 1, false, DAffine(1.0)}, Shape{2, 0, false, DAffine(1.0)}}});
  for (const double x : {5.0, -5.0}) scene.instances.push_back({0, Affine(translation({x, 0, 0}))});
  return scene;
}

BuiltLod build_lod(const Mesh& mesh) {
  const Scene scene = scene_of(mesh);
  const ScenePlan plan = plan_scene(scene);
  const BakeConfig config;
  LengthHistogram edges;
  GeometryMeasure measure;
  measure.bounds = measure_geometry(scene, plan.geometries[0], edges);
  measure.median_edge = edges.median();
  BuiltLod result;
  result.geometry =
      quantize_geometry(scene, plan.geometries[0], analyse_requirements(scene, plan, plan.geometries[0], config),
                        config, GeometryGrid{choose_grid(config, measure, 1.0), {}}, measure);
  result.base = split_geometry(result.geometry, config.repeated_clusters);
  Progress progress;
  result.lod = build_cluster_lod(result.geometry, result.base, progress);
  return result;
}

const BuiltLod& built_lod(const NamedMesh& mesh) {
  static std::map<std::string, BuiltLod> built; // by name
  const auto at = built.find(mesh.name);
  return at != built.end() ? at->second : built.emplace(mesh.name, build_lod(mesh.make())).first->second;
}

ClusterLod read_lod(const BakedFile& file, uint32_t geometry) {
  const LodView view = file.lod(geometry);
  ClusterLod lod;
  lod.level_count = static_cast<uint32_t>(view.levels.size());
  for (const baked::LodGroupRecord& g : view.groups)
    lod.groups.push_back(
        {g.level, std::isinf(g.error), g.error, {DVec3(g.center[0], g.center[1], g.center[2]), g.radius}});
  std::map<LatticePoint, uint32_t> numbers;
  for (uint32_t level = 0; level < lod.level_count; ++level) {
    const uint32_t of_level = view.levels[level].geometry;
    const std::vector<LodLink> links = view.links_of(level);
    for (uint32_t c = 0; c < file.clusters(of_level).size(); ++c) {
      const ClusterView cluster = file.cluster(of_level, c);
      const LodLink& link = links[c];
      const auto first_vertex = static_cast<uint32_t>(lod.vertices.size());
      lod.clusters.push_back({{static_cast<uint32_t>(lod.triangles.size()), cluster.triangle_count(), 0},
                              level,
                              link.group,
                              link.generating_group});
      for (uint32_t v = 0; v < cluster.vertex_count(); ++v) {
        const auto next = static_cast<uint32_t>(lod.positions.size());
        const auto [at, added] = numbers.emplace(cluster.lattice(v), next);
        if (added) lod.positions.push_back(at->first);
        lod.vertices.push_back({at->second, 0, {}});
      }
      for (uint32_t i = 0; i < cluster.triangle_count(); ++i)
        lod.triangles.push_back(cluster.triangle(i) + first_vertex);
    }
  }
  return lod;
}

std::vector<double> thresholds(const ClusterLod& lod) {
  std::set<double> values{0.0};
  for (const LodGroup& group : lod.groups)
    if (!group.terminal)
      for (const double t : {std::nextafter(group.error, 0.0), group.error, std::nextafter(group.error, 1e300)})
        values.insert(t);
  return {values.begin(), values.end()};
}

uint64_t level_triangles(const ClusterLod& lod, uint32_t level) {
  uint64_t count = 0;
  for (const LodCluster& c : lod.clusters)
    if (c.level == level || (c.level < level && lod.groups[c.group].terminal)) count += c.range.triangle_count;
  return count;
}

std::vector<uint32_t> cut_clusters(const ClusterLod& lod, double threshold) {
  std::vector<uint32_t> cut;
  for (uint32_t i = 0; i < lod.clusters.size(); ++i) {
    const LodCluster& c = lod.clusters[i];
    const double made = c.generating_group == kNoGroup ? 0.0 : lod.groups[c.generating_group].error;
    if (lod.groups[c.group].error > threshold && made <= threshold) cut.push_back(i);
  }
  return cut;
}

std::vector<BoundaryEdge> boundary(const ClusterLod& lod, const std::vector<uint32_t>& clusters) {
  std::map<std::pair<LatticePoint, LatticePoint>, int64_t> counts;
  for (const uint32_t number : clusters) {
    const ClusterRange& range = lod.clusters[number].range;
    for (uint32_t i = 0; i < range.triangle_count; ++i)
      for (int corner = 0; corner < 3; ++corner) {
        const Triangle& t = lod.triangles[range.first_triangle + i];
        const LatticePoint& a = lod.positions[lod.vertices[t[corner]].position];
        const LatticePoint& b = lod.positions[lod.vertices[t[(corner + 1) % 3]].position];
        if (a < b) ++counts[{a, b}];
        if (b < a) --counts[{b, a}];
      }
  }
  std::vector<BoundaryEdge> edges;
  for (const auto& [edge, count] : counts)
    if (count != 0) edges.push_back({edge.first, edge.second, count});
  return edges;
}

} // namespace packtrace::test
