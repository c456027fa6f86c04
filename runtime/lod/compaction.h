#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <utility>
#include <vector>

namespace packtrace {

/// A piece of memory of the backend's.
using BlasBuffer = uint64_t;

/// What compaction needs of whoever builds BLASes. What is recorded runs in order; a frame's has run when as many later
/// frames have begun as may be in flight.
class BlasMemoryBackend {
public:
  virtual ~BlasMemoryBackend() = default;
  /// @return never 0
  virtual BlasBuffer allocate(uint64_t bytes) = 0;
  /// Nothing that still runs uses it.
  virtual void release(BlasBuffer buffer) = 0;
  /// Bytes that a build of it may need.
  virtual uint64_t worst_case_bytes(uint32_t blas) = 0;
  /// Records the build, and the question for its compacted size.
  virtual void record_build(uint32_t blas, BlasBuffer into) = 0;
  /// The answer; the build has run.
  virtual uint64_t compacted_bytes(uint32_t blas) = 0;
  /// Records a compacting copy.
  virtual void record_copy(uint32_t blas, BlasBuffer from, BlasBuffer to) = 0;
};

/// Knobs of BlasCompactor. Values out of range are rejected, never clamped.
struct CompactionConfig {
  /// Frames that may be recorded or running at a time, the one being recorded counted. [1..16]
  uint32_t frames_in_flight = 2;
  /// Compacted bytes copied in one frame; one BLAS is copied in any case. [1..2^63]
  uint64_t bytes_per_frame = 32 << 20;
  /// BLASes stay as they are that would save less than this share of their bytes. [0..1]
  double smallest_saving = 0.05;

  /// Throws Error(kUsage), naming the field.
  void validate() const;
};

/// Where the memory of a BLAS is on its way.
enum class BlasMemoryState : uint8_t {
  kBuilding, ///< at its worst-case size; how large it is will be known when the build's frame has run
  kMeasured, ///< waits for its turn to be copied
  kSettled,  ///< compacted, or not worth it, or animated
};

/// Bytes over the BLASes of one geometry that there are.
struct GeometryBytes {
  uint64_t worst_case = 0; ///< as allocated for their builds
  uint64_t now = 0;        ///< of the buffers they are traced from
};

/// Memory of BLASes from build to release: allocated for the worst case, built, measured, copied to where it fits, the
/// source released when no frame can use it any more. Depends on the calls only. Not for several threads at once.
///
/// Each frame: begin_frame(), then remove(), add(), then trace buffer_of().
class BlasCompactor {
public:
  BlasCompactor(BlasMemoryBackend& backend, const CompactionConfig& config);

  /// Releases, measures, and records copies within the budget, oldest builds first; what is copied is traced from its
  /// new place from this frame on.
  void begin_frame();
  /// Allocates and records the build. @param blas a number that is not in use @param animated built again often: stays
  /// at its worst-case size
  void add(uint32_t blas, uint32_t geometry, bool animated = false);
  /// It is used no more, from this frame on. Its number may be used again at once.
  void remove(uint32_t blas);

  BlasBuffer buffer_of(uint32_t blas) const { return entry(blas).buffer; }
  BlasMemoryState state_of(uint32_t blas) const { return entry(blas).state; }

  uint64_t resident_bytes() const { return resident_; } ///< allocated, also what waits for its release
  uint64_t peak_bytes() const { return peak_; }
  uint64_t copies() const { return copies_; }
  /// By geometry; those that ever had a BLAS.
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
    uint64_t frame; ///< may happen when this one begins
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
  std::map<uint32_t, Entry> entries_; ///< by BLAS
  /// Builds in order: the BLAS and the frame, which tells builds of one number apart.
  std::deque<std::pair<uint32_t, uint64_t>> building_, measured_;
  std::deque<Release> releases_;
  std::map<uint32_t, GeometryBytes> geometries_;
};

} // namespace packtrace
