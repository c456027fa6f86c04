#include "runtime/denoise/reference/reference_config.h"

namespace packtrace {
namespace {

constexpr Setting<ReferenceConfig> kSettings[] = {
    {{"max_tspp", "Maximum length of the history in frames", 1, 100}, &ReferenceConfig::max_tspp},
};

} // namespace

std::span<const Setting<ReferenceConfig>> reference_settings() { return kSettings; }

void ReferenceConfig::validate() const { check_settings(reference_settings(), *this, "denoiser"); }

} // namespace packtrace
