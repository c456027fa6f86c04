#include "runtime/gpu/structures/structure_memory.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace packtrace::gpu {
namespace {

constexpr uint64_t kBlockBytes = uint64_t{16} << 20; ///< at least
constexpr uint64_t kAlignment = 256;                 ///< of structures in a buffer

uint64_t aligned(uint64_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; }

} // namespace

/// Takes the first range of free bytes that is long enough, of a new block if there is none.
StructureMemory::BlockAt StructureMemory::find_room(uint64_t bytes, uint64_t& offset) {
  for (BlockAt block = blocks_.begin(); block != blocks_.end(); ++block)
    for (const auto& [at, free] : block->free)
      if (free >= bytes) {
        offset = at;
        const uint64_t left = free - bytes;
        block->free.erase(at);
        if (left > 0) block->free.emplace(offset + bytes, left);
        return block;
      }
  const uint64_t all = std::max(bytes, kBlockBytes);
  blocks_.push_back({Buffer(device_, all, BufferPlace::kUnbound, "acceleration structures"), {}});
  allocated_ += all;
  if (all > bytes) blocks_.back().free.emplace(bytes, all - bytes);
  offset = 0;
  return std::prev(blocks_.end());
}

/// Returns bytes to a block, which is freed if nothing is left in it.
void StructureMemory::free_range(BlockAt block, uint64_t offset, uint64_t bytes) {
  auto next = block->free.lower_bound(offset);
  if (next != block->free.end() && next->first == offset + bytes) {
    bytes += next->second;
    next = block->free.erase(next);
  }
  if (next != block->free.begin())
    if (const auto before = std::prev(next); before->first + before->second == offset) {
      offset = before->first, bytes += before->second;
      block->free.erase(before);
    }
  if (bytes == block->buffer.bytes()) {
    allocated_ -= bytes;
    blocks_.erase(block);
  } else {
    block->free.emplace(offset, bytes);
  }
}

StructureNumber StructureMemory::create(uint64_t bytes, VkAccelerationStructureTypeKHR type) {
  const std::lock_guard lock(mutex_);
  Structure structure;
  structure.bytes = aligned(std::max<uint64_t>(bytes, 1));
  structure.block = find_room(structure.bytes, structure.offset);
  VkAccelerationStructureCreateInfoKHR info{};
  info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR;
  info.buffer = structure.block->buffer.handle();
  info.offset = structure.offset, info.size = structure.bytes, info.type = type;
  const VkResult result = vkCreateAccelerationStructureKHR(device_->handle(), &info, nullptr, &structure.handle);
  if (result != VK_SUCCESS) free_range(structure.block, structure.offset, structure.bytes);
  check(result, "vkCreateAccelerationStructureKHR");
  const VkAccelerationStructureDeviceAddressInfoKHR address{
      VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR, nullptr, structure.handle};
  structure.address = vkGetAccelerationStructureDeviceAddressKHR(device_->handle(), &address);
  structures_.emplace(++last_, structure);
  return last_;
}

void StructureMemory::destroy(StructureNumber number) {
  const std::lock_guard lock(mutex_);
  const Structure structure = structures_.at(number);
  vkDestroyAccelerationStructureKHR(device_->handle(), structure.handle, nullptr);
  free_range(structure.block, structure.offset, structure.bytes);
  structures_.erase(number);
}

VkAccelerationStructureKHR StructureMemory::handle(StructureNumber number) const {
  const std::lock_guard lock(mutex_);
  return structures_.at(number).handle;
}

uint64_t StructureMemory::address(StructureNumber number) const {
  const std::lock_guard lock(mutex_);
  return structures_.at(number).address;
}

uint64_t StructureMemory::allocated_bytes() const {
  const std::lock_guard lock(mutex_);
  return allocated_;
}

StructureMemory::~StructureMemory() {
  for (const auto& [number, structure] : structures_)
    vkDestroyAccelerationStructureKHR(device_->handle(), structure.handle, nullptr);
}

} // namespace packtrace::gpu
