#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "compress/bake/lod/cluster_lod.h"
#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace::test {

/// A closed torus without normals, all vertices shared.
Mesh torus_mesh(uint32_t around, uint32_t across);

/// The mesh with every second triangle's corners made its own, with normals of its own: seams everywhere.
Mesh half_faceted(const Mesh& mesh);

/// Closed tetrahedra at random in [-1,1]^3.
Mesh tetrahedra_mesh(uint32_t count, uint32_t seed);

/// A flat square of 12 x 12 cells whose four outer corners are cut off, by so much of a cell. Both points of a corner
/// become one at almost no cost; what juts out then is a small part of a large triangle.
Mesh chamfered_sheet(float cut);

/// Every triangle twice: seen from the same side, or from both.
Mesh twice(Mesh mesh, bool other_side);

/// Meshes that levels must survive.
struct NamedMesh {
  std::string name;
  Mesh (*make)();
  bool closed = false;
};
/// For gtest.
inline void PrintTo(const NamedMesh& mesh, std::ostream* out) { *out << mesh.name; }
std::vector<NamedMesh> stress_meshes();
std::vector<NamedMesh> closed_stress_meshes();
/// A name for a test.
std::string identifier(std::string name);

/// A mesh on its lattice with clusters and levels.
struct BuiltLod {
  QuantizedGeometry geometry;
  GeometryClusters base;
  ClusterLod lod;
};
BuiltLod build_lod(const Mesh& mesh);

/// Levels as the builder has them, but of what a file holds: decoded lattice points; errors and spheres as stored, in
/// object units.
ClusterLod read_lod(const BakedFile& file, uint32_t geometry);

/// 0, every error there is, and the nearest values on both sides of it. Ascending.
std::vector<double> thresholds(const ClusterLod& lod);

/// The clusters to take where errors up to `threshold` are allowed.
std::vector<uint32_t> cut_clusters(const ClusterLod& lod, double threshold);

/// How often each directed edge of the triangles is there more than its opposite, by lattice point; only edges with a
/// count other than 0. Empty for closed surfaces.
struct BoundaryEdge {
  LatticePoint a, b; ///< a < b
  int64_t count;     ///< of a -> b less that of b -> a
  bool operator==(const BoundaryEdge&) const = default;
};
std::vector<BoundaryEdge> boundary(const ClusterLod& lod, const std::vector<uint32_t>& clusters);

} // namespace packtrace::test
