// Traces rays of threads: by the packed kernels' traversal, or by the driver's.
#ifdef RAY_PIPELINE
#include "driver_traversal.glsl"
#else
#include "traversal.glsl"
layout(local_size_x = 64) in;
#endif
