#include "compress/bake/lod/loose_pieces.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "compress/bake/lod/bound/triangle_distance.h"
#include "compress/bake/lod/bound/triangle_set.h"
#include "pbrt_import/base/disjoint_sets.h"

namespace packtrace {
namespace {

constexpr uint32_t kNoPiece = ~0u;
constexpr double kMaxPieceCost = 3.0; // maximum cost of a piece, relative to the largest error of the input

struct Piece {
  std::vector<uint32_t> triangles;
  DVec3 center{0.0};
  double error = 0.0; ///< largest of its triangles
  bool locked = false, dropped = false;
};

/// The triangle nearest to a piece, which represents it once the piece is dropped.
struct PieceSubstitute {
  double distance = std::numeric_limits<double>::infinity();
  uint32_t piece = kNoPiece, triangle = kNoPiece;
};

class Dropper {
public:
  explicit Dropper(SimplifyMesh& mesh) : m_(mesh) {}

  std::vector<TriangleSubstitute> run(const DropTargets& targets) {
    find_pieces();
    if (pieces_.size() > 1) drop_some(targets);
    return remove_dropped();
  }

private:
  void drop_some(const DropTargets& targets) {
    size_t live = m_.triangles.size();
    double dear = 0.0;
    for (const Piece& piece : pieces_) dear = std::max(dear, kMaxPieceCost * piece.error);
    std::vector<PieceSubstitute> stands(pieces_.size());
    std::vector<uint32_t> order;
    for (uint32_t i = 0; i < pieces_.size(); ++i)
      if (!pieces_[i].locked && pieces_[i].triangles.size() <= live - targets.triangles)
        stands[i] = find_substitute(i), order.push_back(i);
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      return stands[a].distance != stands[b].distance ? stands[a].distance < stands[b].distance : a < b;
    });
    for (const bool any_cost : {false, true}) {
      const uint32_t target = any_cost ? std::max(targets.triangles, targets.at_any_cost) : targets.triangles;
      for (const uint32_t i : order) {
        if (live <= target) break;
        if (pieces_[i].dropped) continue;
        if (stands[i].piece == kNoPiece || pieces_[stands[i].piece].dropped) stands[i] = find_substitute(i);
        const PieceSubstitute& stand = stands[i];
        if (stand.piece == kNoPiece) break; // the last piece
        if (!any_cost && pieces_[i].error + stand.distance > dear) continue;
        drop(i, stand);
        live -= pieces_[i].triangles.size();
      }
    }
  }

  void drop(uint32_t piece, const PieceSubstitute& stand) {
    LodTriangle& t = m_.triangles[stand.triangle];
    t.error = std::max(t.error, pieces_[piece].error + stand.distance);
    pieces_[stand.piece].error = std::max(pieces_[stand.piece].error, t.error);
    pieces_[piece].dropped = true;
  }

  void find_pieces() {
    DisjointSets connected(m_.points.size());
    for (const LodTriangle& t : m_.triangles)
      for (int i = 1; i < 3; ++i) connected.join(t.points[0], t.points[i]);
    std::vector<uint32_t> piece_of(m_.points.size(), kNoPiece);
    for (uint32_t i = 0; i < m_.triangles.size(); ++i) {
      const LodTriangle& t = m_.triangles[i];
      uint32_t& number = piece_of[connected.root(t.points[0])];
      if (number == kNoPiece) number = static_cast<uint32_t>(pieces_.size()), pieces_.emplace_back();
      Piece& piece = pieces_[number];
      piece.triangles.push_back(i);
      piece.error = std::max(piece.error, t.error);
      for (int corner = 0; corner < 3; ++corner) {
        piece.center += m_.points[t.points[corner]];
        piece.locked |= m_.locked[t.points[corner]] != 0;
      }
    }
    for (Piece& piece : pieces_) piece.center /= static_cast<double>(3 * piece.triangles.size());
  }

  /// The maximum distance of a piece's points from one triangle. Distance from a convex set is convex, so the maximum
  /// over the corners holds for the whole surface. Infinite if not below `limit`.
  double distance(const Piece& piece, const Triangle& to, double limit) const {
    double largest2 = 0.0;
    for (const uint32_t triangle : piece.triangles)
      for (int i = 0; i < 3; ++i) {
        const DVec3 p = m_.points[m_.triangles[triangle].points[i]];
        const DVec3 d = p - nearest_point(p, m_.points[to.x], m_.points[to.y], m_.points[to.z]);
        largest2 = std::max(largest2, glm::dot(d, d));
        if (largest2 >= limit * limit) return std::numeric_limits<double>::infinity();
      }
    return std::sqrt(largest2);
  }

  /// Finds the nearest triangle of the pieces with the nearest centres.
  PieceSubstitute find_substitute(uint32_t number) const {
    constexpr size_t kTried = 3; // number of pieces tried, those with the nearest centres
    std::array<std::pair<double, uint32_t>, kTried> nearest;
    nearest.fill({std::numeric_limits<double>::infinity(), kNoPiece});
    const Piece& piece = pieces_[number];
    for (uint32_t i = 0; i < pieces_.size(); ++i) {
      if (i == number || pieces_[i].dropped) continue;
      const DVec3 d = pieces_[i].center - piece.center;
      std::pair<double, uint32_t> candidate{glm::dot(d, d), i};
      for (auto& entry : nearest)
        if (candidate < entry) std::swap(candidate, entry);
    }
    PieceSubstitute best;
    for (const auto& [unused, other] : nearest) {
      if (other == kNoPiece) continue;
      for (const uint32_t triangle : pieces_[other].triangles) {
        const double d = distance(piece, m_.triangles[triangle].points, best.distance);
        if (d < best.distance) best = {d, other, triangle};
      }
    }
    return best;
  }

  std::vector<TriangleSubstitute> remove_dropped() {
    std::vector<uint32_t> piece_of(m_.triangles.size());
    for (uint32_t i = 0; i < pieces_.size(); ++i)
      for (const uint32_t triangle : pieces_[i].triangles) piece_of[triangle] = i;
    std::vector<TriangleSubstitute> stands(m_.triangles.size());
    TriangleSet kept;
    for (size_t i = 0; i < stands.size(); ++i) {
      stands[i].dropped = pieces_[piece_of[i]].dropped;
      if (stands[i].dropped) continue;
      stands[i].triangle = static_cast<uint32_t>(kept.size());
      kept.add(corners(m_.triangles[i]), stands[i].triangle);
    }
    for (size_t i = 0; i < stands.size(); ++i)
      if (stands[i].dropped) find_nearest(corners(m_.triangles[i]), kept, stands[i]);
    for (size_t i = 0; i < stands.size(); ++i)
      if (!stands[i].dropped) m_.triangles[stands[i].triangle] = m_.triangles[i];
    m_.triangles.resize(kept.size());
    return stands;
  }

  std::array<DVec3, 3> corners(const LodTriangle& t) const {
    return {m_.points[t.points.x], m_.points[t.points.y], m_.points[t.points.z]};
  }

  void find_nearest(const std::array<DVec3, 3>& dropped, const TriangleSet& kept, TriangleSubstitute& stand) {
    std::array<double*, 3> rows;
    for (size_t k = 0; k < 3; ++k) {
      distances_[k].resize(kept.padded_size());
      rows[k] = distances_[k].data();
    }
    kept.distances(dropped, rows);
    const NearestTriangle nearest = kept.nearest(rows[0], rows[1], rows[2]);
    stand.triangle = kept.number(nearest.place), stand.distance = nearest.distance;
  }

  SimplifyMesh& m_;
  std::vector<Piece> pieces_;
  std::array<std::vector<double>, 3> distances_; ///< of a dropped triangle's corners from all others
};

} // namespace

std::vector<TriangleSubstitute> drop_loose_pieces(SimplifyMesh& mesh, const DropTargets& targets) {
  return Dropper(mesh).run(targets);
}

} // namespace packtrace
