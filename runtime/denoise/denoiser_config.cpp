#include "runtime/denoise/denoiser_config.h"

namespace packtrace {
namespace {

/// Calls use(settings, fields) for the chosen denoiser.
template <typename Config, typename Use>
void with_settings(Config& config, const Use& use) {
  switch (config.kind) {
  case DenoiserKind::kOurs:
    use(flux_settings(), config.ours);
    break;
  case DenoiserKind::kReference:
    use(reference_settings(), config.reference);
    break;
  }
}

} // namespace

void DenoiserConfig::validate() const {
  switch (kind) {
  case DenoiserKind::kOurs:
    ours.validate();
    break;
  case DenoiserKind::kReference:
    reference.validate();
    break;
  }
}

void DenoiserConfig::set(std::string_view assignment) {
  with_settings(*this, [&](auto settings, auto& fields) { assign_setting(settings, assignment, fields, "denoiser"); });
}

std::vector<SettingView> denoiser_settings(const DenoiserConfig& config) {
  std::vector<SettingView> views;
  with_settings(config, [&](auto settings, const auto& fields) {
    for (const auto& setting : settings)
      views.push_back(
          {setting.info, setting.is_switch(), setting.is_integer(), setting.get(fields), setting.default_value()});
  });
  return views;
}

} // namespace packtrace
