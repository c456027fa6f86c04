#include "compress/format/deformation/deformation_player.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

using ClusterVertices = std::array<FrameVertex, kMaxClusterVertices>;

DeformationView view_of(const BakedFile& file, uint32_t animation) {
  const std::span<const uint8_t> section = file.sections().deformation;
  const baked::DeformationRecord& record = deformation_records(section)[animation];
  return {section, record, file.geometries()[record.geometry].cluster_count};
}

} // namespace

DeformationPlayer::DeformationPlayer(const BakedFile& file, uint32_t animation)
    : file_(file), view_(view_of(file, animation)) {
  const auto clusters = file.clusters(record().geometry);
  for (const baked::ClusterRecord& cluster : clusters) begins_.push_back(cluster.first_vertex);
  for (auto& frame : vertices_) frame.resize(record().vertex_count);
  next_bits_.resize(clusters.size());
  tbb::parallel_for(uint32_t{0}, static_cast<uint32_t>(clusters.size()), [&](uint32_t c) { advance(c, 0, 1); });
  newest_ = 1;
}

void DeformationPlayer::read_stored(uint32_t cluster, std::span<FrameVertex> out) const {
  const ClusterView view = file_.cluster(record().geometry, cluster);
  for (uint32_t v = 0; v < out.size(); ++v) {
    const LatticePoint q = view.lattice(v);
    for (size_t axis = 0; axis < 3; ++axis)
      out[v][axis] = static_cast<uint32_t>(static_cast<uint64_t>(q[axis]) - static_cast<uint64_t>(record().lo[axis]));
  }
}

std::span<FrameVertex> DeformationPlayer::vertices(uint32_t frame, uint32_t cluster) {
  return std::span(vertices_[frame % 2])
      .subspan(begins_[cluster], file_.clusters(record().geometry)[cluster].vertex_count);
}

/// Decodes frames first to last of a cluster. The frames before `first` in its group have been decoded.
void DeformationPlayer::advance(uint32_t cluster, uint32_t first, uint32_t last) {
  ClusterVertices stored;
  for (uint32_t frame = first; frame <= last; ++frame) {
    const uint32_t group = view_.group_of(frame), before = frame - view_.first_frame(group);
    const uint8_t* bits = view_.block(group, cluster).data();
    const uint64_t bit = before == 0 ? 0 : next_bits_[cluster];
    const std::span<FrameVertex> out = vertices(frame, cluster);
    FrameReferences references{std::span(stored).first(out.size()), {}, {}};
    if (uses_stored(bits, bit)) read_stored(cluster, std::span(stored).first(out.size()));
    if (before > 0) references.previous = vertices(frame - 1, cluster);
    if (before > 1) references.older = out;
    next_bits_[cluster] = decode_frame(bits, bit, references, out);
  }
}

void DeformationPlayer::seek(double frame) {
  const double last = record().frame_count - 1;
  frame = frame > 0.0 ? std::min(frame, last) : 0.0; // NaN is 0
  frame_ = std::min(static_cast<uint32_t>(frame), record().frame_count - 2);
  fraction_ = frame - frame_;
  const uint32_t wanted = frame_ + 1;
  if (wanted == newest_) return;
  // Either onwards from the newest frame, or from the begin of the group of the earlier frame.
  uint32_t first = view_.first_frame(view_.group_of(frame_));
  if (wanted > newest_ && newest_ >= first) first = newest_ + 1;
  tbb::parallel_for(uint32_t{0}, static_cast<uint32_t>(begins_.size()), [&](uint32_t c) { advance(c, first, wanted); });
  newest_ = wanted;
}

double DeformationPlayer::frame_at(double seconds, bool repeat) const {
  const double frame = seconds * record().frames_per_second, count = record().frame_count;
  if (!repeat || !std::isfinite(frame)) return frame;
  const double rest = std::fmod(frame, count);
  return std::min(rest < 0.0 ? rest + count : rest, count - 1.0);
}

void DeformationPlayer::read(uint32_t cluster, std::span<FramePoint> out) const {
  const FrameVertex* a = vertices_[frame_ % 2].data() + begins_[cluster];
  if (fraction_ == 0.0) {
    for (size_t v = 0; v < out.size(); ++v)
      out[v] = {static_cast<int32_t>(a[v][0]), static_cast<int32_t>(a[v][1]), static_cast<int32_t>(a[v][2]), 0};
    return;
  }
  const FrameVertex* b = vertices_[(frame_ + 1) % 2].data() + begins_[cluster];
  for (size_t v = 0; v < out.size(); ++v) {
    out[v][3] = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto step = static_cast<int32_t>(b[v][axis] - a[v][axis]);
      const auto moved = static_cast<uint32_t>(std::lrint(fraction_ * step));
      out[v][axis] = static_cast<int32_t>(a[v][axis] + moved);
    }
  }
}

void DeformationPlayer::decode(uint32_t frame, uint32_t cluster, std::span<FrameVertex> out) const {
  assert(frame < record().frame_count);
  std::array<ClusterVertices, 2> ring;
  ClusterVertices stored;
  const std::span<FrameVertex> from = std::span(stored).first(out.size());
  read_stored(cluster, from);
  const uint32_t group = view_.group_of(frame), first = view_.first_frame(group);
  const uint8_t* bits = view_.block(group, cluster).data();
  uint64_t bit = 0;
  for (uint32_t i = 0; i <= frame - first; ++i) {
    const std::span<FrameVertex> now = std::span(ring[i % 2]).first(out.size());
    const std::span<FrameVertex> before = std::span(ring[(i + 1) % 2]).first(out.size());
    FrameReferences references{from, {}, {}};
    if (i > 0) references.previous = before;
    if (i > 1) references.older = now;
    bit = decode_frame(bits, bit, references, now);
  }
  std::copy_n(ring[(frame - first) % 2].begin(), out.size(), out.begin());
}

uint64_t DeformationPlayer::bytes() const {
  return (vertices_[0].size() + vertices_[1].size()) * sizeof(FrameVertex) + begins_.size() * sizeof begins_[0] +
         next_bits_.size() * sizeof next_bits_[0];
}

} // namespace packtrace
