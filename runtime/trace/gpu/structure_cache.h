#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "runtime/gpu/gpu_config.h"
#include "runtime/gpu/structures/ray_structures.h"
#include "runtime/lod/compaction.h"

namespace packtrace {

/// Input from which a bottom-level structure was built: its ray classes, the grid of its tree, and its clusters.
using StructureKey = std::vector<uint64_t>;

/// Statistics of a StructureCache.
struct StructureStats {
  uint64_t built = 0, compacted = 0, dropped = 0; ///< structures
  uint64_t built_triangles = 0;
  double build_ms = 0.0, copy_ms = 0.0;        ///< on the device
  uint64_t live = 0;                           ///< structures
  uint64_t worst_case_bytes = 0;               ///< of the live ones, as allocated for their builds
  uint64_t resident_bytes = 0, peak_bytes = 0; ///< including structures that wait for release
  uint64_t allocated_bytes = 0;                ///< of the blocks that they lie in
};

class StructureCache;

/// The structures that a tracer uses, by bottom level. They go back to the cache with this object.
class TakenStructures {
public:
  TakenStructures() = default;
  TakenStructures(StructureCache& cache, std::vector<uint32_t> numbers)
      : cache_(&cache), numbers_(std::move(numbers)) {}
  ~TakenStructures();
  TakenStructures(TakenStructures&& other) noexcept { *this = std::move(other); }
  TakenStructures& operator=(TakenStructures&& other) noexcept {
    std::swap(cache_, other.cache_);
    std::swap(numbers_, other.numbers_);
    return *this;
  }

  std::span<const uint32_t> numbers() const { return numbers_; }

private:
  StructureCache* cache_ = nullptr; ///< outlives this object
  std::vector<uint32_t> numbers_;
};

/// The bottom-level structures of a scene: built when a tracer needs them, compacted over the following frames by
/// BlasCompactor, kept as long as a tracer uses them and some frames more. Tracers of the same file share one, so that
/// a new plan of levels builds only what the last one lacked. All functions may be called from several threads.
class StructureCache final : private BlasMemoryBackend {
public:
  /// Opens the device. Throws as gpu::Device::share() does.
  explicit StructureCache(const GpuConfig& config, const CompactionConfig& compaction = {});
  ~StructureCache() override;

  const std::shared_ptr<gpu::StructureMemory>& memory() const { return memory_; }

  /// Begins a frame, and builds the structures that are not there yet. The first ones are also compacted.
  /// @param builder of a scene of the file
  /// @param keys by level
  /// Throws as gpu::RayStructures does; nothing is taken then.
  TakenStructures take(gpu::RayStructures& builder, std::span<const gpu::BottomLevel> levels,
                       std::span<const StructureKey> keys);

  /// Begins a frame: compacts within the budget and as far as there is memory, and drops what was not used for long.
  void next_frame(gpu::RayStructures& builder);

  /// Changes whenever structures move.
  uint64_t generation() const;
  /// The current structures.
  std::vector<gpu::StructureNumber> structures(std::span<const uint32_t> taken) const;
  /// Bytes of a structure when it was built, and now.
  std::pair<uint64_t, uint64_t> bytes(uint32_t taken) const;
  StructureStats stats() const;

private:
  friend class TakenStructures;

  struct Entry {
    const StructureKey* key = nullptr; ///< null: not in use
    uint32_t users = 0;
    uint64_t last_used = 0; ///< frame
    uint64_t worst_case = 0, compacted = 0, now = 0;
  };

  BlasBuffer allocate(uint64_t bytes) override;
  void release(BlasBuffer buffer) override { memory_->destroy(buffer); }
  uint64_t worst_case_bytes(uint32_t blas) override { return entries_[blas].worst_case; }
  void record_build(uint32_t blas, BlasBuffer into) override;
  uint64_t compacted_bytes(uint32_t blas) override { return entries_[blas].compacted; }
  void record_copy(uint32_t blas, BlasBuffer from, BlasBuffer to) override;

  bool begin_frame(gpu::RayStructures& builder);
  uint32_t add(const StructureKey& key, const gpu::BottomLevel& level);
  void remove(uint32_t number);
  void build(gpu::RayStructures& builder);
  void settle(gpu::RayStructures& builder);
  void give_back(std::span<const uint32_t> taken);
  void drop_unused();
  bool settled() const;

  mutable std::mutex mutex_;
  std::shared_ptr<gpu::StructureMemory> memory_;
  CompactionConfig config_;
  std::unique_ptr<BlasCompactor> compactor_;
  std::map<StructureKey, uint32_t> numbers_;
  std::vector<Entry> entries_;
  std::vector<uint32_t> unused_numbers_;
  // Of the frame that is being recorded:
  std::vector<std::pair<uint32_t, gpu::BottomBuild>> builds_;
  std::map<uint32_t, const gpu::BottomLevel*> levels_; ///< of the structures to build
  std::vector<gpu::CompactingCopy> copies_;
  uint64_t frame_ = 0, generation_ = 0;
  StructureStats stats_;
};

} // namespace packtrace
