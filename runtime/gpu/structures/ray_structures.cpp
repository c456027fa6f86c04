#include "runtime/gpu/structures/ray_structures.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include <glm/glm.hpp>

#include "pbrt_import/base/error.h"
#include "runtime/gpu/gpu_scene_state.h"
#include "runtime/gpu/shaders/spirv.h"

namespace packtrace::gpu {
namespace {

constexpr uint64_t kTriangleBytes = 9 * sizeof(float);
constexpr uint64_t kBatchTriangles = uint64_t{1} << 21; ///< that are decoded at once, unless a structure has more
constexpr uint32_t kMaxGroups = 65535;                  ///< of a dispatch, on every device
constexpr VkBuildAccelerationStructureFlagsKHR kBottomFlags =
    VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR |
    VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_COMPACTION_BIT_KHR;

uint64_t round_up(uint64_t value, uint64_t unit) { return (value + unit - 1) / unit * unit; }

/// The geometries of a bottom level, without addresses.
class Geometries {
public:
  explicit Geometries(const BottomLevel& level) {
    for (const BottomLevel::Part& part : level.parts) {
      if (part.triangles == 0) continue;
      VkAccelerationStructureGeometryKHR& geometry = geometries_[count_];
      geometry.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR;
      geometry.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_KHR;
      const bool opaque = &part == level.parts.data();
      geometry.flags = opaque ? VK_GEOMETRY_OPAQUE_BIT_KHR : VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_KHR;
      auto& triangles = geometry.geometry.triangles;
      triangles = {};
      triangles.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_TRIANGLES_DATA_KHR;
      triangles.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT, triangles.vertexStride = 3 * sizeof(float);
      triangles.maxVertex = static_cast<uint32_t>(3 * part.triangles - 1);
      triangles.indexType = VK_INDEX_TYPE_NONE_KHR;
      triangle_counts_[count_++] = static_cast<uint32_t>(part.triangles);
    }
  }

  /// @param vertices address of the first triangle; those of the parts follow each other
  void set_vertices(uint64_t vertices) {
    for (uint32_t i = 0; i < count_; ++i) {
      geometries_[i].geometry.triangles.vertexData.deviceAddress = vertices;
      vertices += triangle_counts_[i] * kTriangleBytes;
      ranges_[i] = {triangle_counts_[i], 0, 0, 0};
    }
  }
  /// Valid as long as this object stays where it is.
  VkAccelerationStructureBuildGeometryInfoKHR info() const {
    VkAccelerationStructureBuildGeometryInfoKHR info{};
    info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR;
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR, info.flags = kBottomFlags;
    info.geometryCount = count_, info.pGeometries = geometries_.data();
    return info;
  }
  const uint32_t* triangle_counts() const { return triangle_counts_.data(); }
  const VkAccelerationStructureBuildRangeInfoKHR* ranges() const { return ranges_.data(); }

private:
  std::array<VkAccelerationStructureGeometryKHR, 2> geometries_{};
  std::array<uint32_t, 2> triangle_counts_{};
  std::array<VkAccelerationStructureBuildRangeInfoKHR, 2> ranges_{};
  uint32_t count_ = 0;
};

VkAccelerationStructureBuildSizesInfoKHR
sizes_of(const Device& device, const VkAccelerationStructureBuildGeometryInfoKHR& info, const uint32_t* counts) {
  VkAccelerationStructureBuildSizesInfoKHR sizes{};
  sizes.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR;
  vkGetAccelerationStructureBuildSizesKHR(device.handle(), VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR, &info,
                                          counts, &sizes);
  return sizes;
}

/// Lets what follows read what was written before.
void wait_for_writes(VkCommandBuffer commands) {
  const VkMemoryBarrier visible{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_MEMORY_WRITE_BIT,
                                VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT};
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 1, &visible,
                       0, nullptr, 0, nullptr);
}

/// Compacted sizes of structures.
class SizeQueries {
public:
  SizeQueries(const Device& device, uint32_t count) : device_(device), count_(count) {
    VkQueryPoolCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
    info.queryType = VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR, info.queryCount = count;
    check(vkCreateQueryPool(device.handle(), &info, nullptr, &pool_), "vkCreateQueryPool");
  }
  ~SizeQueries() { vkDestroyQueryPool(device_.handle(), pool_, nullptr); }
  SizeQueries(const SizeQueries&) = delete;

  void record(VkCommandBuffer commands, std::span<const VkAccelerationStructureKHR> structures) const {
    vkCmdResetQueryPool(commands, pool_, 0, count_);
    vkCmdWriteAccelerationStructuresPropertiesKHR(commands, count_, structures.data(),
                                                  VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR, pool_, 0);
  }
  std::vector<uint64_t> read() const {
    std::vector<uint64_t> sizes(count_);
    check(vkGetQueryPoolResults(device_.handle(), pool_, 0, count_, count_ * sizeof sizes[0], sizes.data(),
                                sizeof sizes[0], VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
          "vkGetQueryPoolResults");
    return sizes;
  }

private:
  const Device& device_;
  uint32_t count_;
  VkQueryPool pool_ = VK_NULL_HANDLE;
};

/// The rows of the transform from a tree's grid to unit space.
VkTransformMatrixKHR unit_from_grid(const packed::TracePlacement& placement) {
  const double* const m = placement.grid_from_unit;
  const glm::dmat3 linear(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8]);
  const glm::dmat3 inverse = glm::inverse(linear);
  const glm::dvec3 moved = -(inverse * glm::dvec3(m[9], m[10], m[11]));
  VkTransformMatrixKHR out{};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out.matrix[row][column] = static_cast<float>(inverse[column][row]);
    out.matrix[row][3] = static_cast<float>(moved[row]);
  }
  return out;
}

/// Scratch buffers have no contents between builds.
void make_room(Buffer& scratch, const std::shared_ptr<Device>& device, uint64_t bytes, BufferPlace place,
               const char* what) {
  if (scratch.bytes() >= bytes && scratch.bytes() > 0) return;
  scratch = Buffer();
  scratch = Buffer(device, bytes, place, what);
}

struct PlacedStructures {
  std::vector<VkAccelerationStructureInstanceKHR> placed;
  std::vector<InstanceRecord> records; // one per placed structure
};

/// Returns an instance of each bottom level for each placement of its tree, in the order of the placements.
/// @param structures by bottom level
PlacedStructures placed_structures(std::span<const packed::TracePlacement> placements,
                                   std::span<const BottomLevel> levels, std::span<const StructureNumber> structures,
                                   const StructureMemory& memory) {
  PlacedStructures result;
  std::vector<uint32_t> by_tree(levels.size());
  for (uint32_t i = 0; i < by_tree.size(); ++i) by_tree[i] = i;
  std::ranges::stable_sort(by_tree, {}, [&](uint32_t i) { return levels[i].tree; });
  for (uint32_t p = 0; p < placements.size(); ++p) {
    const auto same =
        std::ranges::equal_range(by_tree, placements[p].tree, {}, [&](uint32_t i) { return levels[i].tree; });
    const VkTransformMatrixKHR transform = unit_from_grid(placements[p]);
    for (const uint32_t i : same) {
      VkAccelerationStructureInstanceKHR& instance = result.placed.emplace_back();
      instance = {};
      instance.transform = transform;
      instance.mask = levels[i].ray_classes & 0xffu;
      instance.flags = VK_GEOMETRY_INSTANCE_TRIANGLE_FACING_CULL_DISABLE_BIT_KHR;
      instance.accelerationStructureReference = memory.address(structures[i]);
      InstanceRecord record{};
      record.placement = p;
      uint32_t geometry = 0;
      for (const BottomLevel::Part& part : levels[i].parts)
        if (part.triangles > 0) {
          record.first_range[geometry] = part.first_range;
          record.range_count[geometry++] = part.range_count;
        }
      result.records.push_back(record);
    }
  }
  return result;
}

} // namespace

RayStructures::RayStructures(const GpuScene& scene, std::shared_ptr<StructureMemory> memory,
                             std::span<const RangeRecord> ranges)
    : scene_(scene), memory_(std::move(memory)),
      ranges_(upload(memory_->device(), std::as_bytes(ranges), "ranges of triangles")) {
  decode_ = scene_.state().make_kernel(spirv::decode_triangles(), kSceneBindings + 2, sizeof(SpanRecord));
  decode_->bind(kSceneBindings, ranges_);
}

RayStructures::~RayStructures() {
  if (top_ != 0) memory_->destroy(top_);
}

uint64_t RayStructures::worst_case_bytes(const Device& device, const BottomLevel& level) {
  if (level.triangles() > device.structure_limits().max_primitives || level.triangles() > UINT32_MAX / 3)
    throw Error(ErrorKind::kLimitExceeded,
                "backend gpu-rt: " + std::to_string(level.triangles()) +
                    " triangles of a geometry are more than an acceleration structure may have; use --backend gpu");
  const Geometries geometries(level);
  return sizes_of(device, geometries.info(), geometries.triangle_counts()).accelerationStructureSize;
}

double RayStructures::build(std::span<BottomBuild> builds) {
  double ms = 0.0;
  for (size_t first = 0; first < builds.size();) {
    size_t end = first;
    for (uint64_t triangles = 0; end < builds.size(); ++end) {
      triangles += builds[end].level->triangles();
      if (end > first && triangles > kBatchTriangles) break;
    }
    ms += build_batch(builds.subspan(first, end - first));
    first = end;
  }
  vertices_ = Buffer(), scratch_ = Buffer();
  return ms;
}

double RayStructures::build_batch(std::span<BottomBuild> builds) {
  const std::shared_ptr<Device>& device = memory_->device();
  std::vector<Geometries> geometries;
  std::vector<uint64_t> scratch_at, first_triangle;
  std::vector<VkAccelerationStructureKHR> handles;
  uint64_t triangles = 0, scratch_bytes = 0;
  const uint64_t alignment = std::max<uint64_t>(device->structure_limits().scratch_alignment, 1);
  for (const BottomBuild& build : builds) {
    const Geometries& all = geometries.emplace_back(*build.level);
    first_triangle.push_back(triangles), scratch_at.push_back(scratch_bytes);
    triangles += build.level->triangles();
    scratch_bytes += round_up(sizes_of(*device, all.info(), all.triangle_counts()).buildScratchSize, alignment);
    handles.push_back(memory_->handle(build.into));
  }
  make_room(vertices_, device, triangles * kTriangleBytes, BufferPlace::kDevice, "decoded triangles");
  make_room(scratch_, device, scratch_bytes + alignment, BufferPlace::kUnbound, "scratch memory of builds");
  decode_->bind(kSceneBindings + 1, vertices_);
  const uint64_t scratch = round_up(scratch_.address(), alignment);
  std::vector<VkAccelerationStructureBuildGeometryInfoKHR> infos;
  std::vector<const VkAccelerationStructureBuildRangeInfoKHR*> ranges;
  for (size_t i = 0; i < builds.size(); ++i) {
    geometries[i].set_vertices(vertices_.address() + first_triangle[i] * kTriangleBytes);
    infos.push_back(geometries[i].info());
    infos.back().dstAccelerationStructure = handles[i];
    infos.back().scratchData.deviceAddress = scratch + scratch_at[i];
    ranges.push_back(geometries[i].ranges());
  }
  const SizeQueries queries(*device, static_cast<uint32_t>(builds.size()));
  const double ms = device->run([&](VkCommandBuffer commands) {
    for (size_t i = 0; i < builds.size(); ++i) {
      uint64_t at = first_triangle[i];
      for (const BottomLevel::Part& part : builds[i].level->parts) {
        for (uint32_t done = 0; done < part.range_count; done += kMaxGroups) {
          const uint32_t count = std::min(part.range_count - done, kMaxGroups);
          const SpanRecord span{part.first_range + done, count, 0, static_cast<uint32_t>(at)};
          decode_->record(commands, std::as_bytes(std::span(&span, 1)), count, 1);
        }
        at += part.triangles;
      }
    }
    wait_for_writes(commands);
    vkCmdBuildAccelerationStructuresKHR(commands, static_cast<uint32_t>(infos.size()), infos.data(), ranges.data());
    wait_for_writes(commands);
    queries.record(commands, handles);
  });
  const std::vector<uint64_t> sizes = queries.read();
  for (size_t i = 0; i < builds.size(); ++i) builds[i].compacted_bytes = sizes[i];
  return ms;
}

double RayStructures::copy(std::span<const CompactingCopy> copies) {
  if (copies.empty()) return 0.0;
  return memory_->device()->run([&](VkCommandBuffer commands) {
    for (const CompactingCopy& copy : copies) {
      VkCopyAccelerationStructureInfoKHR info{};
      info.sType = VK_STRUCTURE_TYPE_COPY_ACCELERATION_STRUCTURE_INFO_KHR;
      info.src = memory_->handle(copy.from), info.dst = memory_->handle(copy.to);
      info.mode = VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_KHR;
      vkCmdCopyAccelerationStructureKHR(commands, &info);
    }
  });
}

void RayStructures::place(std::span<const packed::TracePlacement> placements, std::span<const BottomLevel> levels,
                          std::span<const StructureNumber> structures) {
  const std::shared_ptr<Device>& device = memory_->device();
  const auto [placed, records] = placed_structures(placements, levels, structures, *memory_);
  if (placed.size() > device->structure_limits().max_instances)
    throw Error(ErrorKind::kLimitExceeded, "backend gpu-rt: " + std::to_string(placed.size()) +
                                               " instances are more than an acceleration structure may have; use "
                                               "--backend gpu");
  Buffer new_instances = upload(device, std::as_bytes(std::span(records)), "the instances' table");
  const Buffer inputs = upload(device, std::as_bytes(std::span(placed)), "placed structures");

  VkAccelerationStructureGeometryKHR geometry{};
  geometry.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR;
  geometry.geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR;
  geometry.geometry.instances = {};
  geometry.geometry.instances.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR;
  geometry.geometry.instances.data.deviceAddress = inputs.address();
  VkAccelerationStructureBuildGeometryInfoKHR info{};
  info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR;
  info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR;
  info.flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
  info.geometryCount = 1, info.pGeometries = &geometry;
  const auto count = static_cast<uint32_t>(placed.size());
  const VkAccelerationStructureBuildSizesInfoKHR sizes = sizes_of(*device, info, &count);
  const uint64_t alignment = std::max<uint64_t>(device->structure_limits().scratch_alignment, 1);
  make_room(scratch_, device, sizes.buildScratchSize + alignment, BufferPlace::kUnbound, "scratch memory of builds");
  const StructureNumber new_top =
      memory_->create(sizes.accelerationStructureSize, VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR);
  info.dstAccelerationStructure = memory_->handle(new_top);
  info.scratchData.deviceAddress = round_up(scratch_.address(), alignment);
  const VkAccelerationStructureBuildRangeInfoKHR range{count, 0, 0, 0};
  const VkAccelerationStructureBuildRangeInfoKHR* const ranges = &range;
  device->run([&](VkCommandBuffer commands) { vkCmdBuildAccelerationStructuresKHR(commands, 1, &info, &ranges); });
  if (top_ != 0) memory_->destroy(top_);
  top_ = new_top, top_bytes_ = sizes.accelerationStructureSize;
  instances_ = std::move(new_instances);
}

void RayStructures::bind(Kernel& kernel) const {
  kernel.bind(Kernel::kRangesBinding, ranges_);
  kernel.bind(Kernel::kInstancesBinding, instances_);
  kernel.bind(memory_->handle(top_));
}

uint64_t RayStructures::bytes() const { return ranges_.bytes() + instances_.bytes() + scratch_.bytes() + top_bytes_; }

} // namespace packtrace::gpu
