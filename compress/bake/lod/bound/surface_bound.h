#pragma once

#include <span>
#include <vector>

#include "compress/bake/lod/simplify/simplify.h"

namespace packtrace {

/// A source triangle, part of which maps to a simplified triangle.
struct SurfaceLink {
  uint32_t source, simplified;
  bool operator==(const SurfaceLink&) const = default;
};

/// Source triangles linked to each simplified triangle s: source[ends[s] .. ends[s + 1]), possibly with duplicates.
struct LinkLists {
  std::vector<uint32_t> ends, source;
};

/// Where each source triangle lies on the simplified surface.
struct SurfaceLinks {
  /// @param count number of simplified triangles
  LinkLists by_simplified(size_t count) const;

  std::vector<SurfaceLink> links; ///< may contain duplicates
  /// Per source triangle: maximum distance of the surface that it represents from the simplified triangles that it is
  /// linked to.
  std::vector<double> bounds;
};

/// Sets the errors of the triangles left after simplify(). Every point of a source triangle lies within the error of a
/// linked simplified triangle, and every point of a simplified triangle within its error of the source surface. Each
/// error includes the error that the source triangle already had, so errors remain two-sided distances to the original
/// surface over any number of levels.
///
/// Each source triangle is mapped onto the simplified surface (TriangleImages) or overlaid on the triangles around the
/// points that its corners became (Overlay). Distance from a triangle is convex, so it is largest at the corners of the
/// pieces into which the outlines cut it. Triangles that neither method covers, at borders that moved and in folds, are
/// subdivided. Simplified triangles that images are not known to cover (ImageCover) are measured against the source
/// surface in the same ways.
/// @param points, triangles source surface; mesh.points and mesh.stands_for use the same point numbers. Degenerate
/// triangles, with equal corners, may follow the triangles that simplify() was given.
/// @return links and bounds of the source triangles
SurfaceLinks bound_errors(std::span<const DVec3> points, std::span<const LodTriangle> triangles, SimplifyMesh& mesh);

} // namespace packtrace
