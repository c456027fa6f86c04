#include "runtime/trace/gpu/structure_cache.h"

#include <algorithm>
#include <utility>

#include "pbrt_import/base/error.h"

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

/// Returns whether there was memory for all copies that the budget allows.
bool StructureCache::begin_frame(gpu::RayStructures& builder) {
  ++frame_;
  copies_.clear();
  bool fits = true;
  try {
    compactor_->begin_frame();
  } catch (const Error& error) { // what could not be copied stays as it is
    if (error.kind() != ErrorKind::kLimitExceeded) throw;
    fits = false;
  }
  drop_unused();
  if (copies_.empty()) return fits;
  stats_.copy_ms += builder.copy(copies_);
  stats_.compacted += copies_.size();
  ++generation_;
  return fits;
}

/// Adds a structure to build, and returns its number.
uint32_t StructureCache::add(const StructureKey& key, const gpu::BottomLevel& level) {
  const uint64_t worst_case = gpu::RayStructures::worst_case_bytes(*memory_->device(), level);
  if (unused_numbers_.empty()) {
    unused_numbers_.push_back(static_cast<uint32_t>(entries_.size()));
    entries_.emplace_back();
  }
  const uint32_t number = unused_numbers_.back();
  entries_[number].worst_case = entries_[number].now = worst_case;
  levels_[number] = &level;
  compactor_->add(number, number);
  unused_numbers_.pop_back();
  entries_[number].key = &numbers_.emplace(key, number).first->first;
  return number;
}

void StructureCache::remove(uint32_t number) {
  compactor_->remove(number);
  numbers_.erase(numbers_.find(*entries_[number].key));
  entries_[number] = Entry{};
  unused_numbers_.push_back(number);
}

void StructureCache::drop_unused() {
  for (uint32_t i = 0; i < entries_.size(); ++i) {
    const Entry& entry = entries_[i];
    if (entry.key == nullptr || entry.users > 0 || entry.last_used + kKeepFrames >= frame_) continue;
    remove(i);
    ++stats_.dropped;
  }
}

/// Builds what was recorded.
void StructureCache::build(gpu::RayStructures& builder) {
  std::vector<gpu::BottomBuild> builds;
  uint64_t triangles = 0;
  for (const auto& [blas, recorded] : builds_) {
    builds.push_back(recorded);
    triangles += recorded.level->triangles();
  }
  stats_.build_ms += builder.build(builds);
  for (size_t i = 0; i < builds.size(); ++i) entries_[builds_[i].first].compacted = builds[i].compacted_bytes;
  stats_.built += builds.size(), stats_.built_triangles += triangles;
}

bool StructureCache::settled() const {
  for (uint32_t i = 0; i < entries_.size(); ++i)
    if (entries_[i].key != nullptr && compactor_->state_of(i) != BlasMemoryState::kSettled) return false;
  return true;
}

TakenStructures StructureCache::take(gpu::RayStructures& builder, std::span<const gpu::BottomLevel> levels,
                                     std::span<const StructureKey> keys) {
  const std::lock_guard lock(mutex_);
  const bool first = numbers_.empty();
  begin_frame(builder);
  builds_.clear(), levels_.clear();
  std::vector<uint32_t> taken;
  try {
    for (size_t i = 0; i < levels.size(); ++i) {
      const auto known = numbers_.find(keys[i]);
      taken.push_back(known != numbers_.end() ? known->second : add(keys[i], levels[i]));
    }
    build(builder);
  } catch (...) {
    for (const uint32_t number : taken)
      if (levels_.contains(number)) remove(number);
    throw;
  }
  for (const uint32_t number : taken) ++entries_[number].users, entries_[number].last_used = frame_;
  try {
    if (first) settle(builder);
  } catch (...) {
    give_back(taken);
    throw;
  }
  return {*this, std::move(taken)};
}

/// Compacts all structures, as far as there is memory, and releases those that were copied.
void StructureCache::settle(gpu::RayStructures& builder) {
  while (!settled() && begin_frame(builder)) continue;
  for (uint32_t i = 0; i < config_.frames_in_flight; ++i) begin_frame(builder);
}

TakenStructures::~TakenStructures() {
  if (cache_ == nullptr) return;
  const std::lock_guard lock(cache_->mutex_);
  cache_->give_back(numbers_);
}

void StructureCache::give_back(std::span<const uint32_t> taken) {
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
