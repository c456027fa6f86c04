#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "pbrt_import/gltf/gltf_animation.h"
#include "pbrt_import/gltf/gltf_nodes.h"
#include "pbrt_import/scene/rigid_motion.h"

namespace packtrace::gltf {

/// Motion of an instance or a camera: world(t) = track(t) inner.
struct NodeMotion {
  uint32_t track = kNoTrack; ///< number that the feed gave the track
  DAffine inner{1.0};
};

/// Tracks of the nodes that an animation moves, in the scene's world coordinates. All of them repeat after the
/// animation's span.
///
/// A track has the keys of its node and of moving nodes above. It equals the animation exactly if the node alone moves,
/// without splines, below nodes that only turn, move and scale uniformly; otherwise keys are added until rotation and
/// scale, relative to their size, and translation, relative to the largest distance between the track and its first
/// key, differ by at most kTolerance at a quarter, a half and three quarters of each interval, or the interval was
/// halved kMaxHalvings times.
class NodeTracks {
public:
  static constexpr double kTolerance = 0x1p-12;
  static constexpr int kMaxHalvings = 8;
  static constexpr size_t kMaxMovers = 64; ///< moving nodes above each other

  /// The arguments must outlive this.
  NodeTracks(Document& document, const Animation& animation, std::span<const PlacedNode> nodes,
             const DAffine& world_from_file);

  /// Motion of a placed node; none if it stands still. Throws Error(kInput) if it cannot be expressed: under more than
  /// kMaxMovers moving nodes, where a non-uniform scale above is zero at a key, or with a key beyond 1e30.
  std::optional<NodeMotion> of(size_t placed);

  /// Track of a camera with a fixed place in a node; none if the node stands still. Throws like of(), and where the
  /// camera is flattened or mirrored at a key.
  std::optional<uint32_t> track_with(size_t placed, const DAffine& node_from_thing);

  uint64_t count() const { return count_; } ///< of tracks made so far

private:
  struct Curve;

  Document& document_;
  const Animation& animation_;
  std::span<const PlacedNode> nodes_;
  const DAffine& world_from_file_;
  std::map<size_t, uint32_t> tracks_; ///< of movers; kNoTrack: it keeps its place
  uint64_t count_ = 0;

  uint32_t make_track(size_t mover, const DAffine& mover_from_thing, bool needs_inverse);
};

} // namespace packtrace::gltf
