#include "runtime/trace/packed/scene/mesh_motion.h"

#include <algorithm>

#include "runtime/stopwatch.h"

namespace packtrace {

MeshMotion::MeshMotion(const BakedFile& file) {
  const std::span<const baked::DeformationRecord> records = deformation_records(file.sections().deformation);
  for (uint32_t i = 0; i < records.size(); ++i) {
    const baked::DeformationRecord& record = records[i];
    DeformingGeometry geometry{record.geometry, {record.lo, record.lo}};
    for (size_t axis = 0; axis < 3; ++axis) geometry.range.hi[axis] += record.extent[axis];
    geometries_.push_back(geometry);
    triangles_.push_back(file.geometries()[record.geometry].triangle_count);
    players_.push_back(std::make_unique<DeformationPlayer>(file, i));
    duration_ = std::max(duration_, (record.frame_count - 1) / record.frames_per_second);
  }
  shown_.resize(players_.size());
  last_.assign(players_.size(), 0.0);
}

/// By player: its frame at a time.
std::vector<double> MeshMotion::frames_at(double seconds, bool repeat) const {
  std::vector<double> frames;
  for (const auto& player : players_) {
    const double last = player->record().frame_count - 1, frame = player->frame_at(seconds, repeat);
    frames.push_back(frame > 0.0 ? std::min(frame, last) : 0.0);
  }
  return frames;
}

MeshMotion::Update MeshMotion::set_time(double seconds, bool repeat, PackedTracer& tracer,
                                        std::span<const uint8_t> used) {
  Update update;
  const std::vector<double> frames = frames_at(seconds, repeat);
  std::vector<size_t> late, moved; // players that must reach the frame before first; all that change
  for (size_t i = 0; i < players_.size(); ++i) {
    if (!used.empty() && used[geometries_[i].geometry] == 0) continue;
    update.moved |= frames[i] != last_[i];
    if (shown_[i] == Frames{frames[i], last_[i]}) continue;
    moved.push_back(i);
    if (shown_[i].now != last_[i]) late.push_back(i);
  }
  if (!late.empty()) deform(late, last_, tracer, update);
  if (!moved.empty()) deform(moved, frames, tracer, update);
  last_ = frames;
  return update;
}

/// Moves some geometries to a frame.
/// @param frames by player
void MeshMotion::deform(std::span<const size_t> players, std::span<const double> frames, PackedTracer& tracer,
                        Update& update) {
  const Stopwatch decoding;
  std::vector<DeformedFrame> moved;
  for (const size_t i : players) {
    players_[i]->seek(frames[i]);
    moved.push_back({geometries_[i].geometry, players_[i].get()});
    shown_[i] = {frames[i], shown_[i].now};
    update.triangles += triangles_[i];
  }
  update.decode_s += decoding.seconds();
  const Stopwatch fitting;
  std::vector<DeformStep> steps(moved.size());
  tracer.deform(moved, steps);
  update.refit_s += fitting.seconds();
  for (const DeformStep& step : steps) update.rebuilt_trees += step.rebuilt;
}

uint64_t MeshMotion::bytes() const {
  uint64_t bytes = 0;
  for (const auto& player : players_) bytes += player->bytes();
  return bytes;
}

} // namespace packtrace
