#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// What a corner has besides its point. Corners at one point may have different ones (seams).
struct Wedge {
  static constexpr uint32_t kNone = ~0u;
  DVec3 normal{};          ///< unit length
  uint32_t source = kNone; ///< the vertex whose normal and texture coordinates it has; none: a normal between others
};

/// A triangle on its way through levels of detail.
struct LodTriangle {
  Triangle points;    ///< distinct
  Triangle wedges;    ///< Wedge::kNone where the kind has none
  uint32_t kind = 0;  ///< seams between kinds of different `seam` stay where they are, more or less
  double error = 0.0; ///< every point of the original surface that it stands for is at most that far, both ways
};

/// Triangles to be simplified on their own, and what happened to them. Coordinates are whole numbers (lattice steps
/// from anywhere near); what moves is put on whole numbers again.
struct SimplifyMesh {
  std::vector<DVec3> points;
  std::vector<uint8_t> locked; ///< per point: must not move or go
  std::vector<Wedge> wedges;
  std::vector<LodTriangle> triangles;
  std::vector<uint8_t> moved;       ///< result, per point
  std::vector<uint32_t> stands_for; ///< result, per point: the one that it became
  std::vector<uint32_t> source;     ///< result, per triangle: its number before
  /// Result, per corner of the triangles before: the edge from there to the next corner, numbered from 0 without gaps;
  /// the same for all triangles at an edge. None where nothing was to be done.
  std::vector<uint32_t> side_edges;
  std::vector<uint32_t> edge_became; ///< result, per edge: the one that it became
};

struct SimplifyConfig {
  uint32_t target_triangles = 0;
  std::span<const uint32_t> seam_of_kind; ///< per kind: the same where edges between them need no keeping (materials)
  bool keep_points = false;               ///< only points that exist are used: texture coordinates belong to them
};

/// Collapses edges, those first that change the surface least, until `target_triangles` are left or nothing more can
/// go. Locked points and the edges between them stay, so that the triangles' signed boundary there is the same before
/// and after, whatever they look like (non-manifold, duplicates, soup). No connected piece vanishes; holes through a
/// piece may close, and it may come to touch itself.
/// Errors of the triangles are not touched: bound_errors() is for that.
/// Depends on its input only. Time n log n in the number of triangles, if no point has very many.
void simplify(SimplifyMesh& mesh, const SimplifyConfig& config);

} // namespace packtrace
