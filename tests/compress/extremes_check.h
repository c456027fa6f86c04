#pragma once

#include <cstdint>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace::test {

/// Source of a geometry: positions in double, in the space that the file stores, and triangles of any winding.
struct Source {
  std::vector<DVec3> positions;
  std::vector<Triangle> triangles;

  void add(const Mesh& mesh, const DAffine& transform) {
    const auto first = static_cast<uint32_t>(positions.size());
    for (const Vec3 p : mesh.positions) positions.push_back(transform_point(transform, DVec3(p)));
    for (const Triangle& t : mesh.triangles) triangles.push_back(t + first);
  }
};

Source source_of(const Mesh& mesh, const DAffine& transform = DAffine(1.0));

/// Checks a geometry against its source: the stated error bound is half a step plus float rounding, every decoded
/// vertex lies within the bound of a source vertex, and triangles connect the same vertices, unless some source
/// vertices are too close to be told apart. Triangles may be missing if they are so thin that they have no area on the
/// lattice.
/// @param flushed additional position error from subnormals flushed to 0
void expect_holds(const BakedFile& file, uint32_t g, const Source& source, double flushed = 0.0);

} // namespace packtrace::test
