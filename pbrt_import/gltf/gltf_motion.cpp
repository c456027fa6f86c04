#include "pbrt_import/gltf/gltf_motion.h"

#include <algorithm>
#include <cmath>

#include "pbrt_import/language/transforms.h"
#include "pbrt_import/scene/motion_pose.h"

namespace packtrace::gltf {
namespace {

double norm(const glm::dmat3& m) {
  return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
}

/// A map that turns or mirrors and scales uniformly: linear = scale * rotation; the scale is negative if it mirrors.
struct Similarity {
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  double scale = 1.0;
};

std::optional<Similarity> similarity_of(const DAffine& map) {
  constexpr double kEqual = 1e-9;
  const glm::dmat3 linear(map);
  const double scale = glm::length(linear[0]);
  if (!(scale > 0.0) || !std::isfinite(scale)) return std::nullopt;
  glm::dmat3 turn = linear / scale;
  if (!(norm(glm::transpose(turn) * turn - glm::dmat3(1.0)) < kEqual)) return std::nullopt;
  const bool mirrors = glm::determinant(turn) < 0.0;
  if (mirrors) turn = -turn;
  return Similarity{glm::normalize(glm::quat_cast(turn)), mirrors ? -scale : scale};
}

/// Chooses the sign of a quaternion so that it is reached the shorter way.
void join(const MotionKey& before, MotionKey& key) {
  if (glm::dot(before.rotation, key.rotation) < 0.0) key.rotation = -key.rotation;
}

bool equal(const MotionKey& a, const MotionKey& b) {
  return a.translation == b.translation && a.rotation == b.rotation && a.scale == b.scale;
}

/// Whether a key has the limits of files of keys.
bool is_within_range(const MotionKey& key) {
  constexpr double kMaxMagnitude = 1e30;
  const auto small = [](const DVec3& v) {
    return std::abs(v.x) <= kMaxMagnitude && std::abs(v.y) <= kMaxMagnitude && std::abs(v.z) <= kMaxMagnitude;
  };
  const glm::dquat& q = key.rotation;
  return small(key.translation) && small(key.scale[0]) && small(key.scale[1]) && small(key.scale[2]) &&
         std::isfinite(q.x + q.y + q.z + q.w);
}

} // namespace

/// The motion of a mover, and of a thing with a fixed place in it.
struct NodeTracks::Curve {
  Curve(const NodeTracks& tracks, size_t mover, const DAffine& mover_from_thing)
      : document(tracks.document_), animation(tracks.animation_), nodes(tracks.nodes_),
        world_from_file(tracks.world_from_file_), inner(mover_from_thing) {
    for (size_t at = mover; at != kNoNode;) {
      movers.push_back(at);
      if (movers.size() > kMaxMovers)
        node(at).fail("has descendants under more than " + std::to_string(kMaxMovers) + " moving nodes");
      const size_t parent = nodes[at].parent;
      at = parent == kNoNode ? kNoNode : nodes[parent].mover;
    }
    for (const size_t one : movers) {
      reserve((times.size() + animation.max_times(nodes[one].node)) * sizeof(double));
      animation.add_times(nodes[one].node, times);
    }
    for (const double end : {animation.span().begin_s, animation.span().end_s}) times.push_back(end);
    std::ranges::sort(times);
    times.erase(std::unique(times.begin(), times.end()), times.end());
    similar = std::ranges::all_of(times, [&](double t) {
      document.context().progress.check_cancelled();
      return similarity_of(above(t)).has_value();
    });
    const bool turns_about_itself = inner[3] == DVec3(0.0);
    exact = similar && movers.size() == 1 && !animation.curved(nodes[mover].node) && turns_about_itself;
  }

  ~Curve() { document.memory().resize(document.memory().bytes() - reserved, "the glTF document's animation"); }
  Curve(const Curve&) = delete;

  void reserve(uint64_t bytes) {
    document.memory().resize(document.memory().bytes() - reserved + bytes, "the glTF document's animation");
    reserved = bytes;
  }

  Value node(size_t placed) const { return document.element("nodes", nodes[placed].node); }

  Trs parts(size_t placed, double time) const {
    return local_parts(node(placed), animation.at(nodes[placed].node, time));
  }

  /// World from the mover's parent.
  DAffine above(double time) const {
    DAffine map = world_from_file;
    for (size_t k = movers.size(); k-- > 0;) {
      const size_t parent = nodes[movers[k]].parent;
      if (parent != kNoNode)
        map = compose(map,
                      nodes[parent].mover == kNoNode ? nodes[parent].world_from_node : nodes[parent].mover_from_node);
      if (k > 0) map = compose(map, compose_trs(parts(movers[k], time)));
    }
    return map;
  }

  MotionKey key(double time) const {
    const DAffine world_from_parent = above(time);
    const Trs local = parts(movers.front(), time);
    const DAffine whole = compose(compose(world_from_parent, compose_trs(local)), inner);
    MotionKey key;
    key.time_s = time;
    key.translation = whole[3];
    if (similar) {
      if (const std::optional<Similarity> outer = similarity_of(world_from_parent)) {
        const DVec3 scale = local.scale * outer->scale;
        key.rotation = glm::normalize(outer->rotation * local.rotation);
        key.scale = glm::dmat3(scale.x, 0, 0, 0, scale.y, 0, 0, 0, scale.z) * glm::dmat3(inner);
        return key;
      }
    }
    const std::optional<TransformKey> parts = decompose(whole);
    if (!parts) node(movers.front()).fail("is flattened at " + to_text(time) + " s");
    key.rotation = parts->rotation, key.scale = parts->scale;
    return key;
  }

  Document& document;
  const Animation& animation;
  std::span<const PlacedNode> nodes;
  const DAffine& world_from_file;
  const DAffine& inner;
  std::vector<size_t> movers; ///< the mover, then those above it
  std::vector<double> times;
  uint64_t reserved = 0; ///< bytes for them
  bool similar = false;  ///< what is above the mover only turns, moves and scales uniformly at all keys
  bool exact = false;    ///< nothing needs keys between those of the channels
};

NodeTracks::NodeTracks(Document& document, const Animation& animation, std::span<const PlacedNode> nodes,
                       const DAffine& world_from_file)
    : document_(document), animation_(animation), nodes_(nodes), world_from_file_(world_from_file) {}

uint32_t NodeTracks::make_track(size_t mover, const DAffine& mover_from_thing, bool needs_inverse) {
  const Curve curve(*this, mover, mover_from_thing);
  MemoryReservation& memory = document_.memory();
  MotionTrack track;
  track.loop = true;
  const auto add = [&](MotionKey key) {
    const std::string when = " at " + to_text(key.time_s) + " s";
    if (!is_within_range(key)) curve.node(mover).fail("leaves the range of positions and scales" + when);
    // The determinant of a rotation is 1.
    const double volume = glm::determinant(key.scale);
    if (needs_inverse && !(volume * (track.keys.empty() ? volume : glm::determinant(track.keys.back().scale)) > 0.0))
      curve.node(mover).fail("is flattened or mirrored" + when);
    if (!track.keys.empty()) join(track.keys.back(), key);
    memory.resize(memory.bytes() + sizeof key, "the glTF document's animation");
    track.keys.push_back(key);
  };
  constexpr double kRounding = 1e-12;
  const DVec3 first = curve.key(curve.times.front()).translation;
  double allowed = kRounding * glm::length(first);
  for (const double time : curve.times) {
    document_.context().progress.check_cancelled();
    allowed = std::max(allowed, kTolerance * glm::distance(first, curve.key(time).translation));
  }
  const auto close = [&](const MotionTrack& piece, double time) {
    const DAffine straight = pose(piece, time);
    const MotionKey wanted = curve.key(time);
    const glm::dmat3 linear = glm::mat3_cast(wanted.rotation) * wanted.scale;
    const double size = std::max({norm(piece.keys[0].scale), norm(piece.keys[1].scale), norm(wanted.scale)});
    return norm(linear - glm::dmat3(straight)) <= kTolerance * size &&
           glm::distance(wanted.translation, straight[3]) <= allowed;
  };
  /// Adds the end of an interval, after keys within it where they are needed.
  const auto add_interval = [&](const auto& self, const MotionKey& from, MotionKey to, int halvings) -> void {
    join(from, to);
    MotionTrack piece;
    piece.keys = {from, to};
    const double middle = 0.5 * from.time_s + 0.5 * to.time_s, quarter = 0.25 * (to.time_s - from.time_s);
    const bool divisible = middle > from.time_s && middle < to.time_s && halvings < kMaxHalvings;
    if (!divisible || (close(piece, middle) && close(piece, middle - quarter) && close(piece, middle + quarter)))
      return add(to);
    MotionKey half = curve.key(middle);
    join(from, half);
    self(self, from, half, halvings + 1);
    self(self, half, to, halvings + 1);
  };
  for (const double time : curve.times) {
    document_.context().progress.check_cancelled();
    MotionKey next = curve.key(time);
    if (track.keys.empty() || curve.exact)
      add(next);
    else
      add_interval(add_interval, MotionKey(track.keys.back()), next, 0);
  }
  const bool moves = std::ranges::any_of(track.keys, [&](const MotionKey& k) { return !equal(k, track.keys.front()); });
  if (!moves) return kNoTrack;
  ++count_;
  return document_.context().feed.add_track(std::move(track));
}

std::optional<NodeMotion> NodeTracks::of(size_t placed) {
  const size_t mover = nodes_[placed].mover;
  if (mover == kNoNode) return std::nullopt;
  const auto [found, inserted] = tracks_.try_emplace(mover, kNoTrack);
  if (inserted) found->second = make_track(mover, DAffine(1.0), false);
  if (found->second == kNoTrack) return std::nullopt;
  return NodeMotion{found->second, nodes_[placed].mover_from_node};
}

std::optional<uint32_t> NodeTracks::track_with(size_t placed, const DAffine& node_from_thing) {
  const size_t mover = nodes_[placed].mover;
  if (mover == kNoNode) return std::nullopt;
  const uint32_t track = make_track(mover, compose(nodes_[placed].mover_from_node, node_from_thing), true);
  return track == kNoTrack ? std::nullopt : std::optional(track);
}

} // namespace packtrace::gltf
