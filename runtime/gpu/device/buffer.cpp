#include "runtime/gpu/device/buffer.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "pbrt_import/base/error.h"

namespace packtrace::gpu {
namespace {

constexpr uint64_t kMinBytes = 256;
constexpr uint64_t kStagingBytes = uint64_t{64} << 20;

void copy_bytes(std::byte* to, const std::byte* from, size_t bytes) {
  if (bytes > 0) std::memcpy(to, from, bytes);
}

} // namespace

Buffer::Buffer(std::shared_ptr<Device> device, uint64_t bytes, BufferPlace place, const char* what)
    : device_(std::move(device)), bytes_((std::max(bytes, kMinBytes) + 15) / 16 * 16) {
  if (place != BufferPlace::kUnbound && bytes_ > device_->limits().maxStorageBufferRange)
    throw Error(ErrorKind::kUnsupported, "backend gpu: " + std::string(what) + " need " + std::to_string(bytes_) +
                                             " bytes, but kernels of " + device_->name() + " can address " +
                                             std::to_string(device_->limits().maxStorageBufferRange));
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.size = bytes_;
  info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  if (device_->config().structures == GpuStructures::kDriver)
    info.usage |= VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT | VK_BUFFER_USAGE_SHADER_BINDING_TABLE_BIT_KHR |
                  VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR |
                  VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR;
  check(vkCreateBuffer(device_->handle(), &info, nullptr, &buffer_), "vkCreateBuffer");
  try {
    allocate(place, what);
  } catch (...) {
    vkDestroyBuffer(device_->handle(), buffer_, nullptr);
    vkFreeMemory(device_->handle(), memory_, nullptr);
    device_->allocated_ -= allocated_;
    throw;
  }
}

void Buffer::allocate(BufferPlace place, const char* what) {
  VkMemoryRequirements needed;
  vkGetBufferMemoryRequirements(device_->handle(), buffer_, &needed);
  const uint64_t there = device_->memory_bytes(), used = device_->allocated_bytes();
  const auto throw_full = [&] {
    throw Error(ErrorKind::kLimitExceeded, "out of device memory: " + std::string(what) + " need " +
                                               std::to_string(needed.size) + " bytes; " + device_->name() + " has " +
                                               std::to_string(there) + ", of which " + std::to_string(used) +
                                               " are in use; use --backend packed, or a smaller picture");
  };
  if (used > there || needed.size > there - used) throw_full();
  const bool has_address = device_->config().structures == GpuStructures::kDriver;
  const VkMemoryAllocateFlagsInfo flags{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO, nullptr,
                                        VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT, 0};
  const VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, has_address ? &flags : nullptr, needed.size,
                                  device_->memory_type(needed.memoryTypeBits, place == BufferPlace::kHost)};
  const VkResult result = vkAllocateMemory(device_->handle(), &info, nullptr, &memory_);
  if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY) throw_full();
  check(result, "vkAllocateMemory");
  allocated_ = needed.size;
  device_->allocated_ += allocated_;
  check(vkBindBufferMemory(device_->handle(), buffer_, memory_, 0), "vkBindBufferMemory");
  if (place != BufferPlace::kHost) return;
  void* mapped = nullptr;
  check(vkMapMemory(device_->handle(), memory_, 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
  mapped_ = static_cast<std::byte*>(mapped);
}

uint64_t Buffer::address() const {
  const VkBufferDeviceAddressInfo info{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, nullptr, buffer_};
  return vkGetBufferDeviceAddress(device_->handle(), &info);
}

Buffer::~Buffer() {
  if (!device_) return;
  vkDestroyBuffer(device_->handle(), buffer_, nullptr);
  vkFreeMemory(device_->handle(), memory_, nullptr);
  device_->allocated_ -= allocated_;
}

void Buffer::swap(Buffer& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(buffer_, other.buffer_);
  std::swap(memory_, other.memory_);
  std::swap(bytes_, other.bytes_);
  std::swap(allocated_, other.allocated_);
  std::swap(mapped_, other.mapped_);
}

Buffer upload(const std::shared_ptr<Device>& device, std::span<const std::byte> bytes, const char* what,
              uint64_t extra_bytes) {
  Buffer buffer(device, bytes.size() + extra_bytes, BufferPlace::kDevice, what);
  device->fill(buffer, 0);
  update(device, buffer, 0, bytes);
  return buffer;
}

void update(const std::shared_ptr<Device>& device, const Buffer& buffer, uint64_t offset,
            std::span<const std::byte> bytes) {
  if (bytes.empty()) return;
  const Buffer staging(device, std::min<uint64_t>(bytes.size(), kStagingBytes), BufferPlace::kHost, "staged bytes");
  for (uint64_t at = 0; at < bytes.size(); at += kStagingBytes) {
    const uint64_t part = std::min<uint64_t>(bytes.size() - at, kStagingBytes);
    copy_bytes(staging.data(), bytes.data() + at, part);
    device->copy(staging, buffer, 0, offset + at, part);
  }
}

void download(const std::shared_ptr<Device>& device, const Buffer& buffer, uint64_t offset,
              std::span<std::byte> bytes) {
  if (bytes.empty()) return;
  const Buffer staging(device, std::min<uint64_t>(bytes.size(), kStagingBytes), BufferPlace::kHost, "staged bytes");
  for (uint64_t at = 0; at < bytes.size(); at += kStagingBytes) {
    const uint64_t part = std::min<uint64_t>(bytes.size() - at, kStagingBytes);
    device->copy(buffer, staging, offset + at, 0, part);
    copy_bytes(bytes.data() + at, staging.data(), part);
  }
}

} // namespace packtrace::gpu
