#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <utility>
#include <vector>

namespace packtrace {

/// A memory allocation of the backend.
using BlasBuffer = uint64_t;

/// Builds BLASes for BlasCompactor. Recorded commands run in order; those of a frame have finished once
/// CompactionConfig::frames_in_flight later frames have begun.
class BlasMemoryBackend {
public:
  virtual ~BlasMemoryBackend() = default;
  /// @return nonzero
  virtual BlasBuffer allocate(uint64_t bytes) = 0;
  /// Called when nothing that still runs uses the buffer.
  virtual void release(BlasBuffer buffer) = 0;
  /// Upper limit of the bytes that a build may need.
  virtual uint64_t worst_case_bytes(uint32_t blas) = 0;
  /// Records the build and the query for its compacted size.
  virtual void record_build(uint32_t blas, BlasBuffer into) = 0;
  /// Result of the query, once the build has finished.
  virtual uint64_t compacted_bytes(uint32_t blas) = 0;
  /// Records a compacting copy.
  virtual void record_copy(uint32_t blas, BlasBuffer from, BlasBuffer to) = 0;
};

/// Parameters of BlasCompactor. Values out of range are rejected, not clamped.
struct CompactionConfig {
  /// Frames that may be recorded or running at once, including the one being recorded. [1..16]
  uint32_t frames_in_flight = 2;
  /// Limit of the compacted bytes copied per frame; at least one BLAS is copied. [1..2^63]
  uint64_t bytes_per_frame = 32 << 20;
  /// BLASes that would save a smaller share of their bytes are not compacted. [0..1]
  double smallest_saving = 0.05;

  /// Throws Error(kUsage) that names the field.
  void validate() const;
};

/// The state of a BLAS's memory.
enum class BlasMemoryState : uint8_t {
  kBuilding, ///< at worst-case size; its compacted size is known once the build's frame has finished
  kMeasured, ///< waits to be copied
  kSettled,  ///< compacted, not worth compacting, or animated
};

/// Bytes of the live BLASes of one geometry.
struct GeometryBytes {
  uint64_t worst_case = 0; ///< as allocated for the builds
  uint64_t now = 0;        ///< of the buffers that are traced
};

/// Manages BLAS memory from build to release: allocates the worst case, builds, queries the compacted size, copies, and
/// releases the source when no frame can use it any more. Deterministic. Not thread safe.
///
/// Per frame: call begin_frame(), then remove(), then add(), then trace buffer_of().
class BlasCompactor {
public:
  BlasCompactor(BlasMemoryBackend& backend, const CompactionConfig& config);

  /// Releases and measures, and records copies within the budget, oldest builds first. Copied BLASes are traced from
  /// their new buffer from this frame on.
  void begin_frame();
  /// Allocates and records the build.
  /// @param blas a number that is not in use
  /// @param animated rebuilt often; stays at its worst-case size
  void add(uint32_t blas, uint32_t geometry, bool animated = false);
  /// The BLAS is unused from this frame on. Its number may be reused at once.
  void remove(uint32_t blas);

  BlasBuffer buffer_of(uint32_t blas) const { return entry(blas).buffer; }
  BlasMemoryState state_of(uint32_t blas) const { return entry(blas).state; }

  uint64_t resident_bytes() const { return resident_; } ///< allocated, including buffers that wait for release
  uint64_t peak_bytes() const { return peak_; }
  uint64_t copies() const { return copies_; }
  /// Per geometry that ever had a BLAS.
  const std::map<uint32_t, GeometryBytes>& geometry_bytes() const { return geometries_; }

private:
  struct Entry {
    uint32_t blas = 0, geometry = 0;
    BlasBuffer buffer = 0;
    uint64_t bytes = 0, worst_case = 0, compacted = 0;
    uint64_t built_frame = 0;
    BlasMemoryState state = BlasMemoryState::kSettled;
  };
  struct Release {
    uint64_t frame; ///< first frame at whose start it may be released
    BlasBuffer buffer;
    uint64_t bytes;
  };

  const Entry& entry(uint32_t blas) const;
  BlasBuffer allocate(uint64_t bytes);
  void release_later(BlasBuffer buffer, uint64_t bytes);
  void measure();
  void copy();

  BlasMemoryBackend& backend_;
  CompactionConfig config_;
  uint64_t frame_ = 0, resident_ = 0, peak_ = 0, copies_ = 0;
  std::map<uint32_t, Entry> entries_; ///< per BLAS number
  /// Builds in order: BLAS number, and frame to distinguish builds of the same number.
  std::deque<std::pair<uint32_t, uint64_t>> building_, measured_;
  std::deque<Release> releases_;
  std::map<uint32_t, GeometryBytes> geometries_;
};

} // namespace packtrace
