#include "runtime/denoise/kernels/history_rows_body.h"

namespace packtrace {

extern const HistoryKernels kHistoryKernelsAvx512;
const HistoryKernels kHistoryKernelsAvx512 = kHistoryRows;

} // namespace packtrace
