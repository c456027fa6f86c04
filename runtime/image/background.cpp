#include "runtime/image/background.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr std::string_view kSky = "sky", kTransparent = "transparent";

/// CSS colours, except darkgrey, which is darker here.
constexpr std::array<std::pair<std::string_view, uint32_t>, 16> kColors{{{"white", 0xffffff},
                                                                         {"black", 0x000000},
                                                                         {"grey", 0x808080},
                                                                         {"gray", 0x808080},
                                                                         {"lightgrey", 0xd3d3d3},
                                                                         {"lightgray", 0xd3d3d3},
                                                                         {"darkgrey", 0x404040},
                                                                         {"darkgray", 0x404040},
                                                                         {"red", 0xff0000},
                                                                         {"green", 0x008000},
                                                                         {"blue", 0x0000ff},
                                                                         {"cyan", 0x00ffff},
                                                                         {"magenta", 0xff00ff},
                                                                         {"yellow", 0xffff00},
                                                                         {"orange", 0xffa500},
                                                                         {"pink", 0xffc0cb}}};

Vec3 color_of(uint32_t rgb) {
  const auto channel = [&](int shift) { return static_cast<float>((rgb >> shift) & 0xff) / 255.0f; };
  return {channel(16), channel(8), channel(0)};
}

std::optional<uint32_t> hexadecimal(std::string_view digits) {
  if (digits.starts_with('#')) digits.remove_prefix(1);
  if (digits.size() != 3 && digits.size() != 6) return std::nullopt;
  uint32_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
  if (error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
  if (digits.size() == 6) return value;
  return ((value & 0xf00) << 8 | (value & 0x0f0) << 4 | (value & 0x00f)) * 0x11; // expands "rgb" to "rrggbb"
}

/// Linear colour of a sky gradient that gets lighter towards the bottom of the picture.
Vec3 sky(uint32_t y, uint32_t height) {
  const float t = (static_cast<float>(y) + 0.5f) / static_cast<float>(height);
  return glm::mix(Vec3(0.30f, 0.50f, 0.78f), Vec3(0.86f, 0.90f, 0.93f), std::pow(t, 0.8f));
}

Vec3 linear_from_display(Vec3 c) { return {linear_from_srgb(c.x), linear_from_srgb(c.y), linear_from_srgb(c.z)}; }
Vec3 display_from_linear(Vec3 c) { return {srgb_from_linear(c.x), srgb_from_linear(c.y), srgb_from_linear(c.z)}; }

} // namespace

const std::vector<std::string>& background_names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names{std::string(kTransparent), std::string(kSky)};
    for (const auto& [name, rgb] : kColors) names.emplace_back(name);
    return names;
  }();
  return kNames;
}

Background parse_background(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (lower == kSky) return {Background::Kind::kSky, Vec3(0)};
  if (lower == kTransparent) return {Background::Kind::kTransparent, Vec3(0)};
  for (const auto& [name, rgb] : kColors)
    if (lower == name) return {Background::Kind::kColor, color_of(rgb)};
  if (const auto rgb = hexadecimal(lower)) return {Background::Kind::kColor, color_of(*rgb)};
  const std::vector<std::string_view> known(background_names().begin(), background_names().end());
  throw Error(ErrorKind::kUsage, "--background " + std::string(text) +
                                     ": must be a colour name, rrggbb in hexadecimal digits, transparent or sky" +
                                     did_you_mean_text(closest_name(lower, known)));
}

Image over_background(Image preview, std::span<const float> coverage, const Background& background) {
  assert(preview.channels == 3 && coverage.size() == preview.size.pixels());
  const bool transparent = background.kind == Background::Kind::kTransparent;
  Image with_alpha;
  if (transparent) with_alpha = Image(preview.size, 4);
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, preview.size.height, 16), [&](const auto& rows) {
    for (uint32_t y = rows.begin(); y < rows.end(); ++y) {
      const Vec3 behind = background.kind == Background::Kind::kSky ? display_from_linear(sky(y, preview.size.height))
                                                                    : background.color;
      for (uint32_t x = 0; x < preview.size.width; ++x) {
        const float covered = coverage[size_t{y} * preview.size.width + x];
        const std::span<const float> from = preview.pixel(x, y);
        const std::span<float> to = transparent ? with_alpha.pixel(x, y) : preview.pixel(x, y);
        Vec3 color(from[0], from[1], from[2]);
        if (transparent)
          to[3] = covered;
        else if (covered <= 0.0f)
          color = behind;
        else if (covered < 1.0f)
          color = display_from_linear(glm::mix(linear_from_display(behind), linear_from_display(color), covered));
        std::copy_n(&color.x, 3, to.begin());
      }
    }
  });
  if (transparent) return with_alpha;
  return preview;
}

} // namespace packtrace
