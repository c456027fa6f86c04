#pragma once

#include <cstdint>
#include <vector>

#include "compress/format/layout/lod_format.h"
#include "runtime/lod/lod_sharing.h"
#include "tests/compress/lod/lod_meshes.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {

/// Levels as a file holds them.
struct LodRecords {
  std::vector<baked::LodGroupRecord> groups;
  std::vector<baked::LodLinkRecord> links;
  std::vector<uint32_t> cluster_triangles;

  LodGeometry geometry() const { return {groups, links, cluster_triangles}; }
};

/// Of two and more levels that were built, of one material slot: else files order clusters anew.
LodRecords records_of(const BuiltLod& built);

/// A tree of groups that no mesh has: random errors and balls, each holding those below, some groups terminal.
/// Everything that the choice of detail reads of a geometry, for tests of many shapes.
/// @param finest groups of level 0
LodRecords random_records(uint32_t finest, uint32_t seed);

/// Random affine map: rotated, scaled up to 24 : 1 along axes that are not those of the object, sheared, and every
/// other one mirrored.
DAffine random_affine(Random& random, double translation);

/// Instances of random geometries at random in a box around 0.
/// @param half_size of the box @param largest_scale scales are in [1, largest_scale], different by axis if above 1
std::vector<LodInstance> random_instances(uint32_t count, uint32_t geometries, double half_size, double largest_scale,
                                          uint32_t seed);

} // namespace packtrace::test
