#pragma once

#include <cstdint>

#include "runtime/trace/packed/kernels/kernel_types.h"

namespace packtrace {

/// A user, such as a tracer, of the memory that threads keep for kernels. Each thread has one cache of decoded batches,
/// which belongs to the owner that used it last, and memory for streams of rays.
class ThreadMemoryOwner {
public:
  ThreadMemoryOwner();
  ThreadMemoryOwner(const ThreadMemoryOwner&) = delete;
  ThreadMemoryOwner& operator=(const ThreadMemoryOwner&) = delete;

  /// Returns the calling thread's memory, whose cache holds batches of this owner only. Valid until the thread ends or
  /// calls this function for another owner.
  /// @param top_depth levels of nodes in the tree over placements, if rays traverse it as streams; 0: no memory for
  /// streams
  packed::ThreadMemory& of_this_thread(uint32_t top_depth) const;

  /// Forgets all cached batches: the clusters that they were decoded from have changed. Not while kernels run.
  void forget_batches();

  /// Bytes that all live threads keep, for any owner.
  static uint64_t bytes_of_all_threads();

private:
  uint64_t number_;
};

} // namespace packtrace
