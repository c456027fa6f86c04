#pragma once

#include <cstdint>

#include "runtime/trace/packed/kernel_types.h"

namespace packtrace {

/// Who fills the caches of decoded batches, which threads keep: each thread has one, for whoever used it last.
class BatchCacheOwner {
public:
  BatchCacheOwner();
  BatchCacheOwner(const BatchCacheOwner&) = delete;
  BatchCacheOwner& operator=(const BatchCacheOwner&) = delete;

  /// The calling thread's, holding nothing that this owner did not put there. Valid until the thread ends.
  packed::BatchCache& of_this_thread() const;

  static uint64_t bytes_of_all_threads();

private:
  uint64_t number_;
};

} // namespace packtrace
