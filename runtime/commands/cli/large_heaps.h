#pragma once

namespace packtrace {

/// Makes malloc keep freed memory, and requests large pages (2 MiB) for the heaps of the calling thread and of TBB's
/// workers, until the process ends. Without this, page faults and address translation take a tenth to a third of a
/// verb's time. Later calls have no effect.
void prepare_heaps();

} // namespace packtrace
