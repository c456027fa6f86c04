#include "runtime/denoise/reference/reference_pipeline.h"

#include "pbrt_import/base/error.h"

namespace packtrace {

std::unique_ptr<DenoisePipeline> make_reference_pipeline(const ReferenceConfig& config) {
  config.validate();
  throw Error(ErrorKind::kUnsupported, "denoiser: reference is not available yet");
}

} // namespace packtrace
