#include "runtime/denoise/kernels/history_rows_body.h"

namespace packtrace {

extern const HistoryKernels kHistoryKernelsAvx2;
const HistoryKernels kHistoryKernelsAvx2 = kHistoryRows;

} // namespace packtrace
