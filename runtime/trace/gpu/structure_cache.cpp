#include "runtime/trace/gpu/structure_cache.h"

#include <algorithm>
#include <utility>

namespace packtrace {
namespace {

constexpr uint64_t kKeepFrames = 8; ///< that an unused structure is kept, as the same one may be needed again

} // namespace

StructureCache::StructureCache(const GpuConfig& config, const CompactionConfig& compaction)
    : memory_(std::make_shared<gpu::StructureMemory>(gpu::Device::share(config))), config_(compaction),
      compactor_(std::make_unique<BlasCompactor>(static_cast<BlasMemoryBackend&>(*this), compaction)) {}

StructureCache::~StructureCache() = default;

BlasBuffer StructureCache::allocate(uint64_t bytes) {
  return memory_->create(bytes, VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR);
}

void StructureCache::record_build(uint32_t blas, BlasBuffer into) {
  builds_.push_back({blas, {levels_.at(blas), into, 0}});
}

void StructureCache::record_copy(uint32_t blas, BlasBuffer from, BlasBuffer to) {
  copies_.push_back({from, to});
  entries_[blas].now = entries_[blas].compacted;
}

void StructureCache::begin_frame(gpu::RayStructures& builder) {
  ++frame_;
  copies_.clear();
  compactor_->begin_frame();
  drop_unused();
  if (copies_.empty()) return;
  stats_.copy_ms += builder.copy(copies_);
  stats_.compacted += copies_.size();
  ++generation_;
}

void StructureCache::drop_unused() {
  for (uint32_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    if (entry.key == nullptr || entry.users > 0 || entry.last_used + kKeepFrames >= frame_) continue;
    compactor_->remove(i);
    numbers_.erase(numbers_.find(*entry.key));
    entry = Entry{};
    unused_numbers_.push_back(i);
    ++stats_.dropped;
  }
}

/// Builds what was recorded.
void StructureCache::build(gpu::RayStructures& builder) {
  std::vector<gpu::BottomBuild> builds;
  for (const auto& [blas, recorded] : builds_) builds.push_back(recorded);
  stats_.build_ms += builder.build(builds);
  for (size_t i = 0; i < builds.size(); ++i) entries_[builds_[i].first].compacted = builds[i].compacted_bytes;
  builds_.clear();
  levels_.clear();
}

bool StructureCache::settled() const {
  for (uint32_t i = 0; i < entries_.size(); ++i)
    if (entries_[i].key != nullptr && compactor_->state_of(i) != BlasMemoryState::kSettled) return false;
  return true;
}

std::vector<uint32_t> StructureCache::take(gpu::RayStructures& builder, std::span<const gpu::BottomLevel> levels,
                                           std::span<const StructureKey> keys) {
  const std::lock_guard lock(mutex_);
  const bool first = numbers_.empty();
  begin_frame(builder);
  std::vector<uint32_t> taken;
  for (size_t i = 0; i < levels.size(); ++i) {
    const auto [at, is_new] = numbers_.try_emplace(keys[i], 0);
    if (is_new) {
      if (unused_numbers_.empty()) {
        unused_numbers_.push_back(static_cast<uint32_t>(entries_.size()));
        entries_.emplace_back();
      }
      const uint32_t number = unused_numbers_.back();
      unused_numbers_.pop_back();
      at->second = number;
      Entry& entry = entries_[number];
      entry.key = &at->first;
      entry.worst_case = entry.now = gpu::RayStructures::worst_case_bytes(*memory_->device(), levels[i]);
      levels_[number] = &levels[i];
      compactor_->add(number, number);
      ++stats_.built;
      stats_.built_triangles += levels[i].triangles();
    }
    taken.push_back(at->second);
    ++entries_[at->second].users;
    entries_[at->second].last_used = frame_;
  }
  build(builder);
  if (!first) return taken;
  while (!settled()) begin_frame(builder);
  for (uint32_t i = 0; i < config_.frames_in_flight; ++i) begin_frame(builder); // releases the structures copied from
  return taken;
}

void StructureCache::give_back(std::span<const uint32_t> taken) {
  const std::lock_guard lock(mutex_);
  for (const uint32_t blas : taken) {
    --entries_[blas].users;
    entries_[blas].last_used = frame_;
  }
}

void StructureCache::next_frame(gpu::RayStructures& builder) {
  const std::lock_guard lock(mutex_);
  begin_frame(builder);
}

uint64_t StructureCache::generation() const {
  const std::lock_guard lock(mutex_);
  return generation_;
}

std::vector<gpu::StructureNumber> StructureCache::structures(std::span<const uint32_t> taken) const {
  const std::lock_guard lock(mutex_);
  std::vector<gpu::StructureNumber> numbers;
  for (const uint32_t blas : taken) numbers.push_back(compactor_->buffer_of(blas));
  return numbers;
}

std::pair<uint64_t, uint64_t> StructureCache::bytes(uint32_t taken) const {
  const std::lock_guard lock(mutex_);
  return {entries_[taken].worst_case, entries_[taken].now};
}

StructureStats StructureCache::stats() const {
  const std::lock_guard lock(mutex_);
  StructureStats stats = stats_;
  stats.live = numbers_.size();
  for (const auto& [key, number] : numbers_) stats.worst_case_bytes += entries_[number].worst_case;
  stats.resident_bytes = compactor_->resident_bytes();
  stats.peak_bytes = compactor_->peak_bytes();
  stats.allocated_bytes = memory_->allocated_bytes();
  return stats;
}

} // namespace packtrace
