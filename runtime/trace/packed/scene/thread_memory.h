#pragma once

#include <cstdint>

#include "runtime/trace/packed/kernels/kernel_types.h"

namespace packtrace {

/// Who uses what threads keep for kernels: each thread has one cache of decoded batches, for whoever used it last, and
/// room for streams of rays.
class ThreadMemoryOwner {
public:
  ThreadMemoryOwner();
  ThreadMemoryOwner(const ThreadMemoryOwner&) = delete;
  ThreadMemoryOwner& operator=(const ThreadMemoryOwner&) = delete;

  /// The calling thread's, holding nothing that this owner did not put there. Valid until the thread ends, or asks for
  /// another.
  /// @param top_depth levels of nodes over placements that rays go through together; 0: none
  packed::ThreadMemory& of_this_thread(uint32_t top_depth) const;

  /// What all threads that live keep, for whichever owner.
  static uint64_t bytes_of_all_threads();

private:
  uint64_t number_;
};

} // namespace packtrace
