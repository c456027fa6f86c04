#include "runtime/lod/compaction.h"

#include <algorithm>
#include <cassert>
#include <string>

#include "pbrt_import/base/error.h"

namespace packtrace {

void CompactionConfig::validate() const {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw Error(ErrorKind::kUsage, std::string("compaction: ") + what);
  };
  require(frames_in_flight >= 1 && frames_in_flight <= 16, "frames_in_flight is not in [1..16]");
  require(bytes_per_frame >= 1 && bytes_per_frame <= uint64_t{1} << 63, "bytes_per_frame is not in [1..2^63]");
  require(smallest_saving >= 0.0 && smallest_saving <= 1.0, "smallest_saving is not in [0..1]");
}

BlasCompactor::BlasCompactor(BlasMemoryBackend& backend, const CompactionConfig& config)
    : backend_(backend), config_(config) {
  config.validate();
}

const BlasCompactor::Entry& BlasCompactor::entry(uint32_t blas) const {
  const auto at = entries_.find(blas);
  assert(at != entries_.end() && "no such BLAS");
  return at->second;
}

BlasBuffer BlasCompactor::allocate(uint64_t bytes) {
  const BlasBuffer buffer = backend_.allocate(bytes);
  resident_ += bytes;
  peak_ = std::max(peak_, resident_);
  return buffer;
}

void BlasCompactor::release_later(BlasBuffer buffer, uint64_t bytes) {
  releases_.push_back({frame_ + config_.frames_in_flight, buffer, bytes}); // this frame may still use it
}

void BlasCompactor::begin_frame() {
  ++frame_;
  while (!releases_.empty() && releases_.front().frame <= frame_) {
    backend_.release(releases_.front().buffer);
    resident_ -= releases_.front().bytes;
    releases_.pop_front();
  }
  measure();
  copy();
}

void BlasCompactor::measure() {
  while (!building_.empty() && building_.front().second + config_.frames_in_flight <= frame_) {
    const auto [blas, built] = building_.front();
    building_.pop_front();
    const auto at = entries_.find(blas);
    if (at == entries_.end() || at->second.built_frame != built || at->second.state != BlasMemoryState::kBuilding)
      continue; // removed in the meantime
    Entry& e = at->second;
    e.compacted = backend_.compacted_bytes(blas);
    const double kept = (1.0 - config_.smallest_saving) * static_cast<double>(e.bytes);
    const bool worthwhile = e.compacted < e.bytes && static_cast<double>(e.compacted) <= kept;
    e.state = worthwhile ? BlasMemoryState::kMeasured : BlasMemoryState::kSettled;
    if (worthwhile) measured_.emplace_back(blas, built);
  }
}

void BlasCompactor::copy() {
  uint64_t copied = 0;
  while (!measured_.empty()) {
    const auto [blas, built] = measured_.front();
    const auto at = entries_.find(blas);
    if (at == entries_.end() || at->second.built_frame != built || at->second.state != BlasMemoryState::kMeasured) {
      measured_.pop_front(); // removed in the meantime
      continue;
    }
    Entry& e = at->second;
    if (copied > 0 && (copied >= config_.bytes_per_frame || e.compacted > config_.bytes_per_frame - copied)) return;
    const BlasBuffer target = allocate(e.compacted); // may throw: the entry then waits for another frame
    measured_.pop_front();
    backend_.record_copy(blas, e.buffer, target);
    release_later(e.buffer, e.bytes);
    geometries_[e.geometry].now -= e.bytes - e.compacted;
    e.buffer = target;
    e.bytes = e.compacted;
    e.state = BlasMemoryState::kSettled;
    copied += std::max<uint64_t>(e.compacted, 1);
    ++copies_;
  }
}

void BlasCompactor::add(uint32_t blas, uint32_t geometry, bool animated) {
  assert(!entries_.contains(blas) && "the BLAS is there already");
  Entry e{blas, geometry, 0, 0, 0, 0, frame_, animated ? BlasMemoryState::kSettled : BlasMemoryState::kBuilding};
  e.bytes = e.worst_case = backend_.worst_case_bytes(blas);
  e.buffer = allocate(e.bytes);
  backend_.record_build(blas, e.buffer);
  if (!animated) building_.emplace_back(blas, frame_);
  geometries_[geometry].worst_case += e.bytes;
  geometries_[geometry].now += e.bytes;
  entries_[blas] = e;
}

void BlasCompactor::remove(uint32_t blas) {
  const auto at = entries_.find(blas);
  assert(at != entries_.end() && "no such BLAS");
  const Entry& e = at->second;
  geometries_[e.geometry].worst_case -= e.worst_case;
  geometries_[e.geometry].now -= e.bytes;
  release_later(e.buffer, e.bytes);
  entries_.erase(at);
}

} // namespace packtrace
