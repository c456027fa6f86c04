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
  frames_.assign(players_.size(), 0.0);
}

MeshMotion::Update MeshMotion::set_time(double seconds, bool repeat, PackedTracer& tracer) {
  Update update;
  std::vector<double> frames;
  for (const auto& player : players_) {
    const double last = player->record().frame_count - 1, frame = player->frame_at(seconds, repeat);
    frames.push_back(frame > 0.0 ? std::min(frame, last) : 0.0);
  }
  update.moved = frames != frames_;
  if (!update.moved && still_) return update;
  const Stopwatch decoding;
  std::vector<DeformedFrame> moved;
  for (size_t i = 0; i < players_.size(); ++i) {
    players_[i]->seek(frames[i]);
    moved.push_back({geometries_[i].geometry, players_[i].get()});
  }
  update.decode_s = decoding.seconds();
  const Stopwatch fitting;
  std::vector<DeformStep> steps(moved.size());
  tracer.deform(moved, steps);
  update.refit_s = fitting.seconds();
  for (size_t i = 0; i < steps.size(); ++i) {
    update.rebuilt_trees += steps[i].rebuilt;
    update.triangles += triangles_[i];
  }
  frames_ = std::move(frames);
  still_ = !update.moved;
  return update;
}

uint64_t MeshMotion::bytes() const {
  uint64_t bytes = 0;
  for (const auto& player : players_) bytes += player->bytes();
  return bytes;
}

} // namespace packtrace
