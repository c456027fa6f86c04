#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/gpu/device/kernel.h"
#include "runtime/gpu/records/gpu_records.h"
#include "runtime/gpu/structures/structure_memory.h"

namespace packtrace::gpu {

class GpuScene;

/// Clusters of a placed tree whose triangles the same rays hit: the contents of a bottom-level structure.
struct BottomLevel {
  /// A geometry of the structure: a part of the table of ranges.
  struct Part {
    uint32_t first_range = 0, range_count = 0;
    uint64_t triangles = 0;
  };

  uint32_t tree = 0;
  uint32_t ray_classes = 0;
  /// Opaque clusters, and masked ones. One of them may be empty.
  std::array<Part, 2> parts;

  uint64_t triangles() const { return parts[0].triangles + parts[1].triangles; }
};

/// A build of a bottom level.
struct BottomBuild {
  const BottomLevel* level = nullptr;
  StructureNumber into = 0;
  uint64_t compacted_bytes = 0; ///< result
};

/// A copy of a structure into a smaller one.
struct CompactingCopy {
  StructureNumber from = 0, to = 0;
};

/// A scene's triangles as acceleration structures of the driver. The bottom levels lie in a memory that scenes share;
/// the top level over their placements belongs to one scene. Not for several threads at once.
class RayStructures {
public:
  /// @param scene must outlive this object; its clusters are decoded for builds
  /// @param ranges of all parts; within a part, first_triangle ascends
  RayStructures(const GpuScene& scene, std::shared_ptr<StructureMemory> memory, std::span<const RangeRecord> ranges);
  ~RayStructures();
  RayStructures(const RayStructures&) = delete;
  RayStructures& operator=(const RayStructures&) = delete;

  /// Bytes that a structure needs before it is compacted.
  /// Throws Error(kLimitExceeded) for more triangles than a structure may have.
  static uint64_t worst_case_bytes(const Device& device, const BottomLevel& level);

  /// Decodes triangles and builds structures. Returns the time on the device in ms.
  double build(std::span<BottomBuild> builds);
  double copy(std::span<const CompactingCopy> copies);

  /// Builds the top level. The one before is traced until this returns, also if there is no memory for the new one.
  /// @param structures by bottom level
  void place(std::span<const packed::TracePlacement> placements, std::span<const BottomLevel> levels,
             std::span<const StructureNumber> structures);

  /// Lets a ray tracing pipeline read the top level and the tables.
  void bind(Kernel& kernel) const;
  /// Of the top level and the tables.
  uint64_t bytes() const;

private:
  double build_batch(std::span<BottomBuild> builds);

  const GpuScene& scene_;
  std::shared_ptr<StructureMemory> memory_;
  Buffer ranges_, instances_, vertices_, scratch_;
  std::unique_ptr<Kernel> decode_;
  StructureNumber top_ = 0;
  uint64_t top_bytes_ = 0;
};

} // namespace packtrace::gpu
