#pragma once

#include <span>
#include <vector>

#include "compress/bake/lod/simplify/simplify.h"

namespace packtrace {

/// A triangle before, part of which is found at a triangle after.
struct SurfaceLink {
  uint32_t before, after;
  bool operator==(const SurfaceLink&) const = default;
};

/// Of each triangle after those before that are linked to it: before[ends[s] .. ends[s + 1]), some more than once.
struct LinkLists {
  std::vector<uint32_t> ends, before;
};

/// Where everything before is found after.
struct SurfaceLinks {
  /// @param count triangles after
  LinkLists by_after(size_t count) const;

  std::vector<SurfaceLink> links; ///< some more than once
  /// Per triangle before: how far at most what it stands for is from the triangles after that it is linked to.
  std::vector<double> bounds;
};

/// Sets the errors of the triangles that are left after simplify(): every point of a triangle before is within the
/// error of one after, and every point of a triangle after within its error of the surface before, plus what the
/// triangles before it already had. So errors stay distances to the original surface, however often this is done.
///
/// Each triangle before is mapped onto those after (TriangleImages), or laid over those that its corners became part
/// of: the distance of its points from one of them is convex, so it is largest at the corners of the pieces into which
/// their outlines cut it. What that leaves out, at borders that moved and in folds, is cut finer. Triangles after that
/// images are not known to cover (ImageCover) are measured alike.
/// @param points, triangles before; mesh.points and mesh.stands_for number the same points. Behind those that
/// simplify() had there may be more, whose corners need not be distinct.
SurfaceLinks bound_errors(std::span<const DVec3> points, std::span<const LodTriangle> triangles, SimplifyMesh& mesh);

} // namespace packtrace
