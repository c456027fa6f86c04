#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>

#include "runtime/gpu/device/buffer.h"

namespace packtrace::gpu {

/// Number of an acceleration structure; 0: none.
using StructureNumber = uint64_t;

/// Acceleration structures of a device, many to a memory allocation. All functions may be called from several threads.
class StructureMemory {
public:
  explicit StructureMemory(std::shared_ptr<Device> device) : device_(std::move(device)) {}
  ~StructureMemory();
  StructureMemory(const StructureMemory&) = delete;
  StructureMemory& operator=(const StructureMemory&) = delete;

  const std::shared_ptr<Device>& device() const { return device_; }

  /// Makes a structure without contents. Throws as Buffer does.
  StructureNumber create(uint64_t bytes, VkAccelerationStructureTypeKHR type);
  /// The device must not use it any more.
  void destroy(StructureNumber number);

  VkAccelerationStructureKHR handle(StructureNumber number) const;
  uint64_t address(StructureNumber number) const;
  /// Bytes of the allocations that the structures lie in.
  uint64_t allocated_bytes() const;

private:
  struct Block {
    Buffer buffer;
    std::map<uint64_t, uint64_t> free; ///< offset, bytes; neither touch nor overlap
  };
  using BlockAt = std::list<Block>::iterator;
  struct Structure {
    VkAccelerationStructureKHR handle = VK_NULL_HANDLE;
    uint64_t address = 0, offset = 0, bytes = 0;
    BlockAt block;
  };

  BlockAt find_room(uint64_t bytes, uint64_t& offset);
  void free_range(BlockAt block, uint64_t offset, uint64_t bytes);

  std::shared_ptr<Device> device_;
  mutable std::mutex mutex_;
  std::list<Block> blocks_;
  std::unordered_map<StructureNumber, Structure> structures_;
  StructureNumber last_ = 0;
  uint64_t allocated_ = 0;
};

} // namespace packtrace::gpu
