#include "runtime/denoise/kernels/filter_rows_body.h"

namespace packtrace {

extern const FilterKernels kFilterKernelsAvx512;
const FilterKernels kFilterKernelsAvx512 = kKernels;

} // namespace packtrace
