#include "runtime/gpu/device/device.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <limits>

#include "pbrt_import/base/error.h"
#include "runtime/gpu/device/buffer.h"
#include "runtime/gpu/device/commands.h"
#include "runtime/gpu/device/kernel.h"

namespace packtrace::gpu {

void check(VkResult result, const char* call) {
  if (result == VK_SUCCESS) return;
  if (result == VK_ERROR_DEVICE_LOST) throw DeviceLost(std::string("the GPU stopped working during ") + call);
  if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY)
    throw Error(ErrorKind::kLimitExceeded, std::string("out of device memory during ") + call);
  throw Error(ErrorKind::kUnsupported, std::string("backend gpu: ") + call + " failed with VkResult " +
                                           std::to_string(static_cast<int>(result)));
}

/// Records commands, submits them and waits. Returns their time on the device, or on CPU devices that of the host, in
/// ms.
/// @param times of the spans between the pairs of timestamps that `record` wrote from number 2 on
template <typename Record>
double Device::submit(const Record& record, std::span<double> times) {
  const std::lock_guard lock(queue_mutex_);
  check(vkResetCommandPool(device_, pool_, 0), "vkResetCommandPool");
  const VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, nullptr,
                                       VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT, nullptr};
  check(vkBeginCommandBuffer(commands_, &begin), "vkBeginCommandBuffer");
  if (queries_ != VK_NULL_HANDLE) {
    vkCmdResetQueryPool(commands_, queries_, 0, 2 + 2 * static_cast<uint32_t>(times.size()));
    vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, queries_, 0);
  }
  record(commands_);
  if (queries_ != VK_NULL_HANDLE) vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, queries_, 1);
  const VkMemoryBarrier visible{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_MEMORY_WRITE_BIT,
                                VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT | VK_ACCESS_HOST_READ_BIT};
  vkCmdPipelineBarrier(commands_, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                       VK_PIPELINE_STAGE_ALL_COMMANDS_BIT | VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &visible, 0, nullptr, 0,
                       nullptr);
  check(vkEndCommandBuffer(commands_), "vkEndCommandBuffer");
  VkSubmitInfo submit{};
  submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &commands_;
  const auto before = std::chrono::steady_clock::now();
  const VkResult submitted = vkQueueSubmit(queue_, 1, &submit, fence_);
  const VkResult waited = submitted != VK_SUCCESS
                              ? submitted
                              : vkWaitForFences(device_, 1, &fence_, VK_TRUE, std::numeric_limits<uint64_t>::max());
  lost_ = lost_ || waited == VK_ERROR_DEVICE_LOST;
  check(submitted, "vkQueueSubmit");
  check(waited, "vkWaitForFences");
  check(vkResetFences(device_, 1, &fence_), "vkResetFences");
  const double wall_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - before).count();
  if (queries_ == VK_NULL_HANDLE || on_cpu()) return wall_ms;
  std::vector<uint64_t> stamps(2 + 2 * times.size());
  check(vkGetQueryPoolResults(device_, queries_, 0, static_cast<uint32_t>(stamps.size()),
                              stamps.size() * sizeof stamps[0], stamps.data(), sizeof stamps[0],
                              VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
        "vkGetQueryPoolResults");
  const auto span_ms = [&](size_t first) {
    return static_cast<double>((stamps[first + 1] - stamps[first]) & stamp_mask_) * double{limits().timestampPeriod} *
           1e-6;
  };
  for (size_t i = 0; i < times.size(); ++i) times[i] = span_ms(2 + 2 * i);
  return span_ms(0);
}

double Device::run(const Kernel& kernel, std::span<const std::byte> push, uint32_t groups) {
  return submit([&](VkCommandBuffer commands) { kernel.record(commands, push, groups, 1); });
}

double Device::run(const std::function<void(VkCommandBuffer)>& record) { return submit(record); }

/// Records commands with a barrier before each dispatch, and before the first copy behind dispatches.
void Device::record(const Commands& commands) {
  uint32_t stamp = 2;
  bool wrote_by_kernel = true; // work submitted before
  const auto write_stamp = [&](VkPipelineStageFlagBits stage) {
    if (queries_ != VK_NULL_HANDLE) vkCmdWriteTimestamp(commands_, stage, queries_, stamp++);
  };
  for (const Commands::Step& step : commands.steps_) {
    const bool dispatches = step.kind == Commands::Kind::kDispatch;
    if (dispatches || wrote_by_kernel) {
      const VkMemoryBarrier visible{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_MEMORY_WRITE_BIT,
                                    VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT};
      constexpr VkPipelineStageFlags kStages = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
      vkCmdPipelineBarrier(commands_, kStages, kStages, 0, 1, &visible, 0, nullptr, 0, nullptr);
    }
    wrote_by_kernel = dispatches;
    if (step.kind == Commands::Kind::kFill) {
      vkCmdFillBuffer(commands_, step.to, step.offset, step.bytes, step.value);
    } else if (step.kind == Commands::Kind::kCopy) {
      const VkBufferCopy region{step.from_offset, step.offset, step.bytes};
      vkCmdCopyBuffer(commands_, step.from, step.to, 1, &region);
    } else {
      write_stamp(VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT); // once the work before has ended
      step.kernel->record(commands_, std::span(step.push).first(step.push_bytes), step.groups_x, step.groups_y);
      write_stamp(VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT);
    }
  }
}

std::vector<double> Device::run(const Commands& commands) {
  const auto dispatches = static_cast<size_t>(std::ranges::count_if(
      commands.steps_, [](const Commands::Step& step) { return step.kind == Commands::Kind::kDispatch; }));
  assert(dispatches <= Commands::kMaxDispatches);
  std::vector<double> times(dispatches);
  submit([&](VkCommandBuffer) { record(commands); }, times);
  if (queries_ == VK_NULL_HANDLE || on_cpu()) times.clear();
  return times;
}

double Device::copy(const Buffer& from, const Buffer& to, uint64_t from_offset, uint64_t to_offset, uint64_t bytes) {
  return submit([&](VkCommandBuffer commands) {
    const VkBufferCopy region{from_offset, to_offset, bytes};
    vkCmdCopyBuffer(commands, from.handle(), to.handle(), 1, &region);
  });
}

void Device::fill(const Buffer& buffer, uint32_t word) {
  submit([&](VkCommandBuffer commands) { vkCmdFillBuffer(commands, buffer.handle(), 0, VK_WHOLE_SIZE, word); });
}

uint64_t Device::memory_bytes() const {
  uint64_t bytes = 0;
  for (uint32_t i = 0; i < memory_.memoryHeapCount; ++i)
    if ((memory_.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) != 0) bytes += memory_.memoryHeaps[i].size;
  if (config_.memory_limit_bytes != 0 && config_.memory_limit_bytes < bytes) return config_.memory_limit_bytes;
  return bytes;
}

uint32_t Device::memory_type(uint32_t allowed, bool host_visible) const {
  constexpr VkMemoryPropertyFlags kHost = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  const VkMemoryPropertyFlags wanted[2] = {host_visible ? kHost | VK_MEMORY_PROPERTY_HOST_CACHED_BIT
                                                        : VkMemoryPropertyFlags{VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT},
                                           host_visible ? kHost : VkMemoryPropertyFlags{0}};
  for (const VkMemoryPropertyFlags flags : wanted)
    for (uint32_t i = 0; i < memory_.memoryTypeCount; ++i)
      if (((allowed >> i) & 1u) != 0 && (memory_.memoryTypes[i].propertyFlags & flags) == flags) return i;
  throw Error(ErrorKind::kUnsupported, "backend gpu: the device has no memory of a kind that is needed");
}

} // namespace packtrace::gpu
