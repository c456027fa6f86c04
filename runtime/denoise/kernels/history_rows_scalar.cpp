#include "runtime/denoise/kernels/history_rows_body.h"

namespace packtrace {

extern const HistoryKernels kHistoryKernelsScalar;
const HistoryKernels kHistoryKernelsScalar = kHistoryRows;

} // namespace packtrace
