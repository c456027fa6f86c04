#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <unordered_map>

#include "runtime/gpu/device/buffer.h"

namespace packtrace::gpu {

/// Number of an acceleration structure; 0 stands for none.
using StructureNumber = uint64_t;

/// Acceleration structures of a device, many to a memory allocation. Not for several threads at once.
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

  VkAccelerationStructureKHR handle(StructureNumber number) const { return structures_.at(number).handle; }
  uint64_t address(StructureNumber number) const { return structures_.at(number).address; }
  /// Bytes of all structures.
  uint64_t bytes() const { return bytes_; }
  /// Bytes of the allocations that they lie in.
  uint64_t allocated_bytes() const { return allocated_; }

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
  std::list<Block> blocks_;
  std::unordered_map<StructureNumber, Structure> structures_;
  StructureNumber last_ = 0;
  uint64_t bytes_ = 0, allocated_ = 0;
};

} // namespace packtrace::gpu
