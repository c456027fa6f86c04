#pragma once

#include <cstdint>
#include <vector>

#include "compress/format/layout/lod_format.h"
#include "runtime/lod/lod_sharing.h"
#include "tests/compress/lod/lod_meshes.h"
#include "tests/compress/test_scenes.h"
#include "tests/runtime/lod/own_cuts.h"

namespace packtrace::test {

/// LOD levels as stored in a file.
struct LodRecords {
  std::vector<baked::LodGroupRecord> groups;
  std::vector<LodLink> links;
  std::vector<uint32_t> cluster_triangles;

  LodGeometry geometry() const { return {groups, links, cluster_triangles}; }
};

/// Records of built levels. Needs at least two levels and a single material slot, as files reorder clusters by slot.
LodRecords records_of(const BuiltLod& built);

/// Records of a tree of groups without a mesh, for tests of many shapes: random errors and spheres, each containing
/// those below, and some terminal groups. Contains everything that the choice of detail reads of a geometry.
/// @param finest number of groups at level 0
LodRecords random_records(uint32_t finest, uint32_t seed);

/// Random affine map: rotated, scaled by up to 24 : 1 along axes other than the object's, sheared, and mirrored in half
/// of the cases.
DAffine random_affine(Random& random, double translation);

/// Instances of random geometries at random positions in a box around 0.
/// @param half_size half the size of the box
/// @param largest_scale scales are in [1, largest_scale], and differ by axis if it is above 1
std::vector<LodInstance> random_instances(uint32_t count, uint32_t geometries, double half_size, double largest_scale,
                                          uint32_t seed);

} // namespace packtrace::test
