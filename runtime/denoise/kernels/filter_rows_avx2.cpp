#include "runtime/denoise/kernels/filter_rows_body.h"

namespace packtrace {

extern const FilterKernels kFilterKernelsAvx2;
const FilterKernels kFilterKernelsAvx2 = kKernels;

} // namespace packtrace
