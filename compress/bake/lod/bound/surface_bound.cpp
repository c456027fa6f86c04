#include "compress/bake/lod/bound/surface_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "compress/bake/lod/bound/image_cover.h"
#include "compress/bake/lod/bound/stated_error.h"
#include "compress/bake/lod/bound/surface_side.h"
#include "compress/bake/lod/bound/surface_walk.h"
#include "compress/bake/lod/bound/triangle_images.h"
#include "compress/bake/lod/bound/triangle_refiner.h"
#include "compress/bake/lod/bound/uncovered_bound.h"

namespace packtrace {
namespace {

using Corners = std::array<DVec3, 3>;

/// A source triangle with a known image, or with an overlay: pieces_[first .. first + count).
struct MappedTriangle {
  uint32_t triangle;
  bool settled = false; ///< a tighter measurement replaces this one
  TriangleImages::Image image;
};

/// The error bound of mapped_triangles_[index], which a tighter measurement may lower.
struct Claim {
  double stated;
  uint32_t index;
  bool operator<(const Claim& o) const { return stated != o.stated ? stated < o.stated : index > o.index; }
};

/// Lists the source triangles that each simplified triangle is linked to, in the order of the links.
/// @param count number of simplified triangles
LinkLists link_lists(std::span<const SurfaceLink> links, size_t count) {
  LinkLists lists{std::vector<uint32_t>(count + 1), std::vector<uint32_t>(links.size())};
  for (const SurfaceLink& link : links) ++lists.ends[link.simplified + 1];
  std::partial_sum(lists.ends.begin(), lists.ends.end(), lists.ends.begin());
  std::vector<uint32_t> next(lists.ends.begin(), lists.ends.end() - 1);
  for (const SurfaceLink& link : links) lists.source[next[link.simplified]++] = link.source;
  return lists;
}

/// Implements bound_errors() for one group.
class Measurer {
public:
  Measurer(std::span<const DVec3> points, std::span<const LodTriangle> triangles, SimplifyMesh& mesh)
      : m_(mesh), source_({points, triangles}, mesh.stands_for), simplified_({mesh.points, mesh.triangles}),
        walk_(source_.surface(), simplified_, mesh), images_(walk_, mesh), cover_(walk_, images_, mesh),
        errors_(mesh.triangles.size()), bounds_(triangles.size()), mapped_(triangles.size()),
        unchanged_(triangles.size()) {}

  SurfaceLinks run() {
    simplified_.link();
    find_unchanged();
    links_.reserve(4 * unchanged_.size());
    mapped_triangles_.reserve(unchanged_.size());
    claims_.reserve(unchanged_.size());
    for (uint32_t t = 0; t < unchanged_.size(); ++t)
      if (unchanged_[t] == 0) map_or_overlay(t);
    settle();
    for (const uint32_t t : without_overlay_) {
      best_.clear();
      simplified_.gather(source_.corner_points(t));
      measure_by_subdivision(t, std::numeric_limits<double>::infinity());
    }
    measure_uncovered();
    for (size_t s = 0; s < errors_.size(); ++s) m_.triangles[s].error = errors_[s];
    return {std::move(links_), std::move(bounds_)};
  }

private:
  double inherited_error(uint32_t source) const { return source_.surface().triangles[source].error; }

  /// Part of the simplified triangle lies within the distance of the source triangle.
  void note_simplified(uint32_t simplified, uint32_t source, double distance) {
    errors_[simplified] = std::max(errors_[simplified], stated_error(distance, inherited_error(source)));
    error_.largest = std::max(error_.largest, errors_[simplified]);
    link(source, simplified);
  }

  void link(uint32_t source, uint32_t simplified) {
    if (links_.empty() || links_.back() != SurfaceLink{source, simplified}) links_.push_back({source, simplified});
  }

  /// Part of the source triangle lies within the distance of the simplified triangle.
  void note(uint32_t simplified, uint32_t source, double distance) {
    note_simplified(simplified, source, distance);
    bounds_[source] = std::max(bounds_[source], stated_error(distance, inherited_error(source)));
  }

  /// Maps triangles that simplify() left unchanged to themselves.
  void find_unchanged() {
    for (uint32_t s = 0; s < errors_.size(); ++s) {
      const Triangle& now = m_.triangles[s].points;
      const uint32_t t = m_.source[s];
      if (now != source_.surface().triangles[t].points || m_.moved[now.x] + m_.moved[now.y] + m_.moved[now.z] != 0)
        continue;
      unchanged_[t] = mapped_[t] = 1;
      note(s, t, 0.0);
    }
  }

  /// Finds the image of a source triangle or, without one, overlays it on the simplified surface.
  void map_or_overlay(uint32_t t) {
    MappedTriangle entry{t, false, {}};
    mapped_[t] = images_.find(t, entry.image);
    if (mapped_[t] == 0) {
      simplified_.gather(source_.corner_points(t));
      entry.image.first = static_cast<uint32_t>(pieces_.size());
      if (!simplified_.overlay(source_.corners(t), source_.surface().area_normal(t), pieces_) &&
          !simplified_.overlay().overlay_over_borders(pieces_)) {
        without_overlay_.push_back(t);
        return;
      }
      entry.image.count = static_cast<uint32_t>(pieces_.size()) - entry.image.first;
      entry.image.distance = largest_of(entry);
    }
    if (entry.image.distance > GroupError::kFine)
      claims_.push_back(
          {stated_error(entry.image.distance, inherited_error(t)), static_cast<uint32_t>(mapped_triangles_.size())});
    mapped_triangles_.push_back(entry);
  }

  std::span<const OverlayPiece> pieces_of(const MappedTriangle& entry) const {
    return std::span(pieces_).subspan(entry.image.first, entry.image.count);
  }

  double largest_of(const MappedTriangle& entry) const {
    double largest = 0.0;
    for (const OverlayPiece& piece : pieces_of(entry)) largest = std::max(largest, piece.distance);
    return largest;
  }

  /// Tightens the largest bounds first: most others are then below the limit and stay as they are.
  void settle() {
    std::make_heap(claims_.begin(), claims_.end());
    while (!claims_.empty() && claims_.front().stated > error_.limit()) {
      std::pop_heap(claims_.begin(), claims_.end());
      MappedTriangle& entry = mapped_triangles_[claims_.back().index];
      claims_.pop_back();
      entry.settled = true;
      const uint32_t t = entry.triangle;
      if (look_closer_at_image(entry)) continue;
      simplified_.gather(source_.corner_points(t));
      best_.clear();
      // Even with an image, the triangle may not be covered by the candidates.
      const bool once = simplified_.overlay(source_.corners(t), source_.surface().area_normal(t), best_);
      const double distance = once ? look_closer(t) : std::numeric_limits<double>::infinity();
      if (error_.enough(distance, inherited_error(t)))
        accept(t);
      else
        measure_by_subdivision(t, distance);
    }
    edge_inherited_error_.assign(walk_.ways().size(), -1.0);
    point_inherited_error_.assign(source_.surface().points.size(), -1.0);
    for (const MappedTriangle& entry : mapped_triangles_) {
      if (entry.settled) continue;
      if (mapped_[entry.triangle] != 0)
        accept_image(entry);
      else
        accept(pieces_of(entry), entry.triangle);
    }
    accept_paths();
    for (const double error : errors_) error_.largest = std::max(error_.largest, error);
  }

  /// Uses an image without further measurements. Records the distance inside it; accept_paths() handles sides and
  /// corners, which neighbours share.
  void accept_image(const MappedTriangle& entry) {
    const uint32_t t = entry.triangle;
    const Triangle& p = source_.surface().triangles[t].points;
    const double inherited_error = this->inherited_error(t), inside = stated_error(entry.image.inside, inherited_error);
    for (const uint32_t s : images_.met(entry.image)) {
      errors_[s] = std::max(errors_[s], inside);
      link(t, s);
    }
    bounds_[t] = std::max(bounds_[t], stated_error(entry.image.distance, inherited_error));
    for (int i = 0; i < 3; ++i) {
      double& of_edge = edge_inherited_error_[m_.side_edges[3 * size_t{t} + static_cast<size_t>(i)]];
      of_edge = std::max(of_edge, inherited_error);
      point_inherited_error_[p[i]] = std::max(point_inherited_error_[p[i]], inherited_error);
    }
  }

  /// Records the distances at path crossings and corner images, for the simplified triangles on both sides.
  void accept_paths() {
    for (uint32_t e = 0; e < edge_inherited_error_.size(); ++e) {
      const SurfaceWalk::EdgePath& way = walk_.ways()[e];
      if (edge_inherited_error_[e] < 0.0 || way.state != SurfaceWalk::EdgePath::State::kAcross) continue;
      uint32_t from = way.start;
      for (uint32_t k = way.first; k < way.first + way.count; ++k) {
        const double error = stated_error(std::sqrt(walk_.crossing(k).distance2), edge_inherited_error_[e]);
        const uint32_t into = walk_.into(k);
        errors_[from] = std::max(errors_[from], error);
        errors_[into] = std::max(errors_[into], error);
        from = into;
      }
    }
    for (uint32_t p = 0; p < point_inherited_error_.size(); ++p) {
      if (point_inherited_error_[p] < 0.0) continue;
      const SurfaceWalk::Place& place = walk_.place(p);
      const double error = stated_error(std::sqrt(place.distance2), point_inherited_error_[p]);
      if (place.state == SurfaceWalk::Place::State::kTriangle)
        errors_[place.number] = std::max(errors_[place.number], error);
      else if (place.distance2 > 0.0)
        for (const uint32_t s : simplified_.around(place.number)) errors_[s] = std::max(errors_[s], error);
    }
  }

  /// On steep parts an image may lie far from its preimage. Measures to the nearest points instead, one way at a time:
  /// the image covers simplified triangles if it is near enough to the source triangle. Returns whether the source
  /// triangle is near enough to simplified triangles.
  bool look_closer_at_image(const MappedTriangle& entry) {
    const uint32_t t = entry.triangle;
    if (mapped_[t] == 0) return false;
    image_pieces_.clear();
    images_.look_closer(t, entry.image, image_pieces_);
    double there = 0.0, back = 0.0;
    for (const TriangleImages::Piece& piece : image_pieces_)
      there = std::max(there, piece.there), back = std::max(back, piece.back);
    const bool is_near = error_.enough(there, inherited_error(t));
    mapped_[t] = error_.enough(back, inherited_error(t));
    for (const TriangleImages::Piece& piece : image_pieces_) {
      if (mapped_[t] != 0) note_simplified(piece.simplified, t, piece.back);
      if (is_near) note(piece.simplified, t, piece.there);
    }
    return is_near;
  }

  /// On steep parts the distance along the normal is too large. Measures to the nearest points instead. Returns the
  /// largest distance in best_.
  double look_closer(uint32_t t) {
    double largest = 0.0;
    for (OverlayPiece& piece : best_) {
      if (!error_.enough(piece.distance, inherited_error(t)))
        piece.distance = simplified_.overlay().nearest_distance(piece);
      largest = std::max(largest, piece.distance);
    }
    return largest;
  }

  void accept(uint32_t t) { accept(best_, t); }

  void accept(std::span<const OverlayPiece> pieces, uint32_t t) {
    for (const OverlayPiece& piece : pieces) note(piece.triangle, t, piece.distance);
  }

  /// Subdivides a triangle that overlays do not bound well.
  /// @param bound largest distance in best_
  void measure_by_subdivision(uint32_t t, double bound) {
    const Corners p = source_.corners(t);
    if (simplified_.candidates().empty())
      simplified_.gather_near(p[0]); // a degenerate triangle without connected neighbours
    refine_over_simplified(t, bound, false);
    if (!error_.enough(bound, inherited_error(t))) {
      simplified_.gather_within(p, bound);
      refine_over_simplified(t, bound, true);
    }
    accept(t);
  }

  /// @param all whether the candidates include every triangle that may be near enough; only then the corner distances
  /// are a valid lower bound
  void refine_over_simplified(uint32_t t, double& bound, bool all) {
    refiner_.begin(simplified_);
    // Lower bound of the error against the current candidates.
    const double source = error_.proven,
                 least = stated_error(refiner_.measure_corners(source_.corners(t)), inherited_error(t));
    error_.proven = std::max(error_.proven, least);
    if (!error_.enough(bound, inherited_error(t))) {
      refined_.clear();
      const double refined =
          refiner_.run([&](double distance, uint32_t) { return error_.enough(distance, inherited_error(t)); },
                       [&](uint32_t s, double distance) { refined_.push_back({s, 0, distance}); });
      if (refined < bound) std::swap(best_, refined_), bound = refined;
    }
    error_.proven = all ? std::max(source, std::min(least, stated_error(bound, inherited_error(t)))) : source;
  }

  // ---- simplified triangles that images do not cover

  void find_covered() {
    cover_.begin(mapped_);
    for (const MappedTriangle& entry : mapped_triangles_)
      if (mapped_[entry.triangle] != 0) cover_.add(entry.triangle, entry.image);
    for (uint32_t s = 0; s < errors_.size(); ++s)
      if (unchanged_[m_.source[s]] != 0) cover_.add_unchanged(s);
  }

  /// Measures simplified triangles that images are not known to cover against the source surface.
  void measure_uncovered() {
    find_covered();
    UncoveredBound uncovered(source_, simplified_, error_, refiner_);
    LinkLists linked; // set up on first use
    for (uint32_t s = 0; s < errors_.size(); ++s) {
      if (cover_.whole(s)) continue;
      if (linked.ends.empty()) linked = link_lists(links_, errors_.size()), source_.link();
      uncovered.measure(s, std::span(linked.source).subspan(linked.ends[s], linked.ends[s + 1] - linked.ends[s]));
    }
    for (const PartDistance& part : uncovered.finish()) note_simplified(part.simplified, part.source, part.distance);
  }

  SimplifyMesh& m_;
  SurfaceSide source_, simplified_;
  SurfaceWalk walk_;
  TriangleImages images_;
  ImageCover cover_;
  std::vector<double> errors_; ///< per simplified triangle
  std::vector<double> bounds_; ///< per source triangle
  std::vector<SurfaceLink> links_;
  std::vector<uint8_t> mapped_; ///< per source triangle: unchanged, or its image is used
  std::vector<uint8_t> unchanged_;
  std::vector<OverlayPiece> pieces_;
  std::vector<MappedTriangle> mapped_triangles_;
  std::vector<Claim> claims_; ///< a heap
  /// largest inherited error of the accepted images at each edge and point; negative if none
  std::vector<double> edge_inherited_error_, point_inherited_error_;
  std::vector<uint32_t> without_overlay_;
  std::vector<OverlayPiece> best_, refined_; ///< of the current triangle
  std::vector<TriangleImages::Piece> image_pieces_;
  TriangleRefiner refiner_;
  GroupError error_;
};

} // namespace

LinkLists SurfaceLinks::by_simplified(size_t count) const { return link_lists(links, count); }

SurfaceLinks bound_errors(std::span<const DVec3> points, std::span<const LodTriangle> triangles, SimplifyMesh& mesh) {
  return Measurer(points, triangles, mesh).run();
}

} // namespace packtrace
