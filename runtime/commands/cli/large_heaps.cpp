#include "runtime/commands/cli/large_heaps.h"

#include "pbrt_import/base/large_pages.h"

namespace packtrace {
namespace {

constexpr size_t kOwnBytes = 240u << 20;   // enough for scenes of two million triangles
constexpr size_t kWorkerBytes = 48u << 20; // glibc's heaps of other threads hold up to 64 MiB each

} // namespace

LargeHeaps::LargeHeaps() {
  prefer_large_heap_pages(kOwnBytes);
  observe(true);
}

void LargeHeaps::on_scheduler_entry(bool is_worker) {
  if (bool& prepared = prepared_.local(); is_worker && !prepared) {
    prepared = true;
    prefer_large_heap_pages(kWorkerBytes);
  }
}

} // namespace packtrace
