#include "runtime/frame/frame_config.h"

#include <algorithm>
#include <string>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr uint32_t kMaxSupersample = 8;
constexpr uint32_t kMaxTracedSide = 1u << 16;
constexpr size_t kMaxTracedPixels = size_t{1} << 28;

void require_setting(bool condition, const std::string& message) {
  if (!condition) throw Error(ErrorKind::kUsage, message);
}

} // namespace

void DetailConfig::validate() const {
  if (error_px) {
    std::string text = std::to_string(*error_px);
    require_setting(*error_px > 0.0 && *error_px <= 1e9,
                    text.insert(0, "--lod-error ").append(": must be a number of pixels above 0"));
  }
  require_setting(!cull_invisible || only_occlusion,
                  "--lod-cull visible requires --lod-rays occlusion, where camera rays are traced before the levels "
                  "are chosen");
  sharing.validate();
}

void FrameConfig::validate() const {
  require_setting(size.width >= 1 && size.height >= 1, "image size must be at least 1x1");
  require_setting(supersample >= 1 && supersample <= kMaxSupersample, "supersample must be in [1, 8]");
  const uint64_t width = uint64_t{size.width} * supersample;
  const uint64_t height = uint64_t{size.height} * supersample;
  require_setting(width <= kMaxTracedSide && height <= kMaxTracedSide && width * height <= kMaxTracedPixels,
                  "image size times supersample exceeds 65536 per side or 2^28 pixels");
  detail.validate();
  packtrace::validate(shade);
  require_setting(proxy_error >= 0.0 && proxy_error <= 1.0, "--proxy-error must be 0 to 1");
  if (!proxy_beyond_px) return;
  require_setting(*proxy_beyond_px > 0.0 && *proxy_beyond_px <= 1e9,
                  "--proxy-beyond must be a number of pixels above 0");
  require_setting(!detail.error_px, "--proxy-beyond and --lod-error exclude each other");
  require_setting(ao.interreflection == 0.0f,
                  "--proxy-beyond requires an interreflection of 0: voxels have no material");
}

uint32_t gbuffer_channels(const FrameConfig& config) {
  if (config.all_channels) return kAllChannels;
  uint32_t channels = 0;
  const bool albedo = config.shades() || (config.plain_layers & (kAlbedoLayer | kShadedLayer)) != 0;
  if (albedo) channels |= kAlbedoChannel | kMaterialChannel;                         // to recognise emitters
  if (config.shades() || config.detail.only_occlusion) channels |= kBackFaceChannel; // for lift_origins()
  if (config.surface_layers) channels |= kTriangleChannel | kMaterialChannel;
  if (config.lod_layers) channels |= kTriangleChannel;
  return channels;
}

uint64_t picture_bytes(const FrameConfig& config) {
  const double pixel_bytes =
      (config.jitters() ? 400.0 : 320.0) + (config.view_layers ? 60.0 : 0.0) + (config.shades() ? 300.0 : 0.0);
  constexpr double kMax = 0x1p62;
  const double side = config.supersample;
  const double bytes = pixel_bytes * side * side * static_cast<double>(config.size.width) * config.size.height;
  return static_cast<uint64_t>(std::min(kMax, bytes));
}

} // namespace packtrace
