#pragma once

namespace packtrace {

/// Requests large pages for what malloc returns to the calling thread and to TBB's workers until the process ends.
/// Programs with many arrays of megabytes spend a tenth of their time on small pages: on faults, and on translating
/// addresses. To be called by the thread that starts the work; later calls have no effect.
void prefer_large_heaps();

} // namespace packtrace
