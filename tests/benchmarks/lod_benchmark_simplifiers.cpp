#include "tests/benchmarks/lod_benchmark_simplifiers.h"

#include <array>
#include <cstdio>

#include <sys/wait.h>
#include <unistd.h>

#include <meshoptimizer.h>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include "compress/bake/lod/simplify/simplify.h"
#include "tests/benchmarks/thread_cpu_time.h"

namespace packtrace {
namespace {

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using Mesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;

/// Returns the number of triangles that OpenMesh rejected.
uint64_t fill(const BareMesh& mesh, Mesh& out) {
  std::vector<Mesh::VertexHandle> vertices;
  for (const DVec3& p : mesh.positions) vertices.push_back(out.add_vertex(Mesh::Point(p.x, p.y, p.z)));
  omerr().disable(); // it would print a line per rejected face
  uint64_t lost = 0;
  for (const Triangle& t : mesh.triangles)
    if (!out.add_face(vertices[t.x], vertices[t.y], vertices[t.z]).is_valid()) ++lost;
  return lost;
}

/// Debian's library ends the process for some meshes that are not manifold, so this tries it in a child process.
bool openmesh_takes(const BareMesh& mesh) {
  const pid_t child = ::fork();
  if (child == 0) {
    std::freopen("/dev/null", "w", stderr);
    Mesh work;
    fill(mesh, work);
    ::_exit(0);
  }
  int status = 1;
  return child > 0 && ::waitpid(child, &status, 0) == child && WIFEXITED(status);
}

} // namespace

SimplifierResult simplify_with_packtrace(const BareMesh& mesh, uint32_t target_triangles) {
  const std::array<uint32_t, 1> one_seam = {0};
  SimplifyMesh work;
  work.points = mesh.positions;
  work.locked.assign(mesh.positions.size(), 0);
  for (const Triangle& t : mesh.triangles)
    if (t.x != t.y && t.y != t.z && t.z != t.x) work.triangles.push_back({t, Triangle(Wedge::kNone), 0, 0.0});
  SimplifyConfig config;
  config.target_triangles = target_triangles;
  config.seam_of_kind = one_seam;
  SimplifierResult result;
  const double start = thread_cpu_seconds();
  simplify(work, config);
  result.seconds = thread_cpu_seconds() - start;
  result.mesh.positions = std::move(work.points);
  for (const LodTriangle& t : work.triangles) result.mesh.triangles.push_back(t.points);
  return result;
}

SimplifierResult simplify_with_meshoptimizer(const BareMesh& mesh, uint32_t target_triangles) {
  std::vector<Vec3> positions;
  for (const DVec3& p : mesh.positions) positions.emplace_back(p);
  std::vector<uint32_t> indices(3 * mesh.triangles.size());
  for (size_t i = 0; i < indices.size(); ++i) indices[i] = mesh.triangles[i / 3][static_cast<int>(i % 3)];
  std::vector<uint32_t> out(indices.size());
  SimplifierResult result;
  const double start = thread_cpu_seconds();
  const size_t count = meshopt_simplify(out.data(), indices.data(), indices.size(), &positions[0].x, positions.size(),
                                        sizeof(Vec3), 3 * size_t{target_triangles}, 1e30f, 0, nullptr);
  result.seconds = thread_cpu_seconds() - start;
  result.mesh.positions = mesh.positions;
  for (size_t i = 0; i + 2 < count; i += 3) result.mesh.triangles.emplace_back(out[i], out[i + 1], out[i + 2]);
  return result;
}

SimplifierResult simplify_with_openmesh(const BareMesh& mesh, uint32_t target_triangles) {
  SimplifierResult result;
  if (!openmesh_takes(mesh)) return result;
  Mesh work;
  result.lost_triangles = fill(mesh, work);
  const double start = thread_cpu_seconds();
  work.request_face_normals();
  work.update_face_normals();
  OpenMesh::Decimater::DecimaterT<Mesh> decimater(work);
  OpenMesh::Decimater::ModQuadricT<Mesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalFlippingT<Mesh>::Handle flipping;
  decimater.add(quadric);
  decimater.module(quadric).unset_max_err();
  decimater.add(flipping);
  decimater.initialize();
  decimater.decimate_to_faces(0, target_triangles);
  work.garbage_collection();
  result.seconds = thread_cpu_seconds() - start;
  for (const auto v : work.vertices()) {
    const Mesh::Point p = work.point(v);
    result.mesh.positions.emplace_back(p[0], p[1], p[2]);
  }
  for (const auto face : work.faces()) {
    Triangle t{};
    int corner = 0;
    for (const auto v : work.fv_range(face)) t[corner++] = static_cast<uint32_t>(v.idx());
    result.mesh.triangles.push_back(t);
  }
  return result;
}

} // namespace packtrace
