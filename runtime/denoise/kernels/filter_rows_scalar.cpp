#include "runtime/denoise/kernels/filter_rows_body.h"

namespace packtrace {

extern const FilterKernels kFilterKernelsScalar;
const FilterKernels kFilterKernelsScalar = kKernels;

} // namespace packtrace
