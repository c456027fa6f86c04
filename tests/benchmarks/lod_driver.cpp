#include <cstdio>
#include <cstring>
#include <ctime>
#include <chrono>
#include <tbb/global_control.h>
#include "compress/bake/geometry_measure.h"
#include "compress/bake/lod/cluster_lod.h"
#include "pbrt_import/scene/progress.h"
#include "tests/compress/lod/surface_distance.h"
#include "tests/benchmarks/packing_benchmark_mesh.h"
using namespace packtrace;
int main(int argc, char** argv) {
  tbb::global_control c(tbb::global_control::max_allowed_parallelism, argc > 3 ? atoi(argv[3]) : 1);
  PackingInput in = load_packing_input("x", argv[1], argc > 2 && std::strcmp(argv[2], "largest") == 0);
  Scene s; s.meshes.push_back(weld_positions(in.mesh)); s.meshes[0].normals.clear(); s.materials.resize(1); s.shapes.push_back({});
  ScenePlan plan = plan_scene(s);
  BakeConfig config;
  LengthHistogram edges;
  GeometryMeasure m; m.bounds = measure_geometry(s, plan.geometries[0], edges); m.median_edge = edges.median();
  PositionGrid grid = choose_grid(config, m, 1.0);
  GeometryNeeds needs = analyse_requirements(s, plan.geometries[0]);
  QuantizedGeometry q = quantize_geometry(s, plan.geometries[0], needs, config, grid, m.max_abs(), m.bounds.lo, m.bounds.hi);
  auto t0 = clock(); auto w0 = std::chrono::steady_clock::now();
  GeometryClusters base = split_geometry(s, q);
  auto t1 = clock();
  Progress p;
  ClusterLod lod = build_cluster_lod(q, base, p);
  auto t2 = clock(); auto w1 = std::chrono::steady_clock::now();
  double n = double(base.triangles.size());
  printf("triangles %zu step %g edge %g split %.3f s lod %.3f s cpu, wall %.3f : %.3f Mtri/s per cpu\n", base.triangles.size(), grid.step(), m.median_edge, double(t1-t0)/1e6, double(t2-t1)/1e6, std::chrono::duration<double>(w1-w0).count(), n/(double(t2-t0)));
  for (uint32_t l = 0; l < lod.level_count; ++l) {
    size_t tri = 0, cl = 0, gr = 0, term = 0; double err = 0; 
    std::vector<double> errs;
    for (auto& cc : lod.clusters) if (cc.level == l) tri += cc.range.triangle_count, ++cl;
    for (auto& g : lod.groups) if (g.level == l) { ++gr; term += g.terminal; if (!g.terminal) err = std::max(err, g.error), errs.push_back(g.error); }
    std::sort(errs.begin(), errs.end());
    printf("level %2u: tri %8zu (level %8lu) clusters %6zu fill %.1f groups %5zu terminal %zu error med %.2f max %.2f steps\n", l, tri, level_triangles(lod, l), cl, double(tri)/double(cl), gr, term, errs.empty() ? 0 : errs[errs.size()/2], err);
  }
  if (argc > 4) {
    std::vector<DVec3> pos; for (auto& v : lod.positions) pos.emplace_back(double(v[0]-q.origin[0]), double(v[1]-q.origin[1]), double(v[2]-q.origin[2]));
    DVec3 lo = pos[0], hi = pos[0]; for (auto& p3 : pos) lo = glm::min(lo,p3), hi = glm::max(hi,p3);
    double diag = glm::length(hi-lo);
    auto pts = [&](const LodCluster& c2, std::vector<Triangle>& out) { for (uint32_t i = 0; i < c2.range.triangle_count; ++i) { auto& t = lod.triangles[c2.range.first_triangle+i]; out.emplace_back(lod.vertices[t.x].position, lod.vertices[t.y].position, lod.vertices[t.z].position);} };
    std::vector<Triangle> t0s; for (auto& c2 : lod.clusters) if (c2.level == 0) pts(c2, t0s);
    SurfaceDistance d0(pos, t0s);
    for (uint32_t l = 1; l < lod.level_count; ++l) {
      std::vector<Triangle> tl; for (auto& c2 : lod.clusters) if (c2.level == l || (c2.level < l && lod.groups[c2.group].terminal)) pts(c2, tl);
      double emax = 0; for (auto& g : lod.groups) if (g.level < l && !g.terminal) emax = std::max(emax, g.error);
      SurfaceDistance dl(pos, tl);
      auto a = surface_distance(pos, tl, d0, 300000), b = surface_distance(pos, t0s, dl, 300000);
      // per group ratio
      std::vector<double> ratios; size_t under = 0;
      for (uint32_t gi = 0; gi < lod.groups.size(); ++gi) { auto& g = lod.groups[gi]; if (g.level != l-1 || g.terminal) continue;
        std::vector<Triangle> tg; for (auto& c2 : lod.clusters) if (c2.generating_group == gi) pts(c2, tg);
        auto r = surface_distance(pos, tg, d0, 20000); ratios.push_back(g.error / std::max(r.max, 1e-9)); under += r.max > g.error; }
      std::sort(ratios.begin(), ratios.end());
      printf("level %u tri %zu: rms %.5f%% / %.5f%% max %.2f / %.2f steps, E %.2f (%.2fx)  per group (one side) E/true median %.2f min %.2f max %.2f under %zu\n", l, tl.size(), 100*a.rms/diag, 100*b.rms/diag, a.max, b.max, emax, emax/std::max(a.max,b.max), ratios.empty()?0:ratios[ratios.size()/2], ratios.empty()?0:ratios[0], ratios.empty()?0:ratios.back(), under);
    }
  }
}
