#include "runtime/view/view_difference.h"

#include <algorithm>
#include <cmath>

#include "pbrt_import/base/error.h"
#include "runtime/image/false_color.h"
#include "runtime/image/metrics.h"
#include "runtime/view/layer_previews.h"

namespace packtrace {
namespace {

constexpr Vec3 kOnlyOne{0.35f, 0.35f, 0.40f};

Image from_vectors(ImageSize size, const std::vector<Vec3>& vectors, float scale, float offset) {
  Image out(size, 3);
  for (size_t i = 0; i < vectors.size(); ++i)
    for (int c = 0; c < 3; ++c) out.data[3 * i + static_cast<size_t>(c)] = offset + scale * vectors[i][c];
  return out;
}

Image from_numbers(ImageSize size, const auto& values, float scale) {
  Image out(size, 1);
  std::ranges::transform(values, out.data.begin(), [&](auto v) {
    const auto value = static_cast<float>(v) * scale;
    return std::isfinite(value) ? value : 0.0f;
  });
  return out;
}

/// The numbers of a layer with one per pixel; null for others.
const std::vector<float>* numbers_of(const RenderedImage& image, const std::string& layer) {
  if (layer == "ao") return &image.ao;
  if (layer == "ao_raw") return &image.ao_raw;
  if (layer == "depth") return &image.depth;
  return layer == "lod-error" ? &image.lod_error : view_of(image, layer);
}

/// Pixels that show a surface in both images, with a value where the layer may have none.
std::vector<uint8_t> shown_in_both(const RenderedImage& a, const std::string& layer_a, const RenderedImage& b,
                                   const std::string& layer_b) {
  const auto shows = [](const RenderedImage& image, const std::string& layer, size_t i) {
    return image.coverage[i] > 0.0f && (layer != "ao" || image.ao[i] >= 0.0f) &&
           (layer != "ao_raw" || image.ao_raw[i] >= 0.0f);
  };
  std::vector<uint8_t> both(a.size.pixels());
  for (size_t i = 0; i < both.size(); ++i) both[i] = shows(a, layer_a, i) && shows(b, layer_b, i) ? 1 : 0;
  return both;
}

/// Both layers on the scale of the reference.
std::pair<Image, Image> comparable_pair(const RenderedImage& test, const std::string& test_layer,
                                        const RenderedImage& reference, const std::string& reference_layer) {
  if (test.size != reference.size) throw Error(ErrorKind::kUsage, "the two views have different sizes");
  const float scale = comparable_scale(reference, reference_layer);
  std::pair<Image, Image> pair{comparable_layer(test, test_layer, scale),
                               comparable_layer(reference, reference_layer, scale)};
  if (pair.first.channels != pair.second.channels)
    throw Error(ErrorKind::kUsage,
                "a colour and a number cannot be compared: " + test_layer + " and " + reference_layer);
  return pair;
}

} // namespace

float comparable_scale(const RenderedImage& image, const std::string& layer) {
  if (layer == "ao" || layer == "ao_raw") return 1.0f;
  const std::vector<float>* numbers = numbers_of(image, layer);
  return numbers != nullptr ? scale_end(*numbers) : 1.0f;
}

Image comparable_layer(const RenderedImage& image, const std::string& layer, float scale) {
  if (layer == "normal") return from_vectors(image.size, image.normal, 0.5f, 0.5f);
  if (layer == "albedo") return from_vectors(image.size, image.albedo, 1.0f, 0.0f);
  if (layer == "shaded") return from_vectors(image.size, image.shaded, 1.0f, 0.0f);
  if (const std::vector<float>* numbers = numbers_of(image, layer))
    return from_numbers(image.size, *numbers, 1.0f / scale);
  // Numbers of things and vectors: equal or not, by their colours.
  return keep_channels(layer_preview(image, layer, {std::nullopt, false}), 3);
}

DifferenceMetrics difference_metrics(const RenderedImage& test, const std::string& test_layer,
                                     const RenderedImage& reference, const std::string& reference_layer) {
  const auto [a, b] = comparable_pair(test, test_layer, reference, reference_layer);
  const std::vector<uint8_t> both = shown_in_both(test, test_layer, reference, reference_layer);
  DifferenceMetrics metrics;
  metrics.pixels = static_cast<uint64_t>(std::ranges::count(both, uint8_t{1}));
  if (metrics.pixels == 0) return metrics;
  const MetricOptions options{both, false};
  metrics.rmse = rmse(a, b, options).value;
  metrics.psnr = psnr(a, b, options).value;
  metrics.flip = flip(a, b, options).value;
  return metrics;
}

Image difference_picture(const RenderedImage& test, const std::string& test_layer, const RenderedImage& reference,
                         const std::string& reference_layer, float gain) {
  const auto [a, b] = comparable_pair(test, test_layer, reference, reference_layer);
  const std::vector<uint8_t> both = shown_in_both(test, test_layer, reference, reference_layer);
  std::vector<float> errors(both.size());
  for (size_t i = 0; i < both.size(); ++i)
    for (uint32_t c = 0; c < a.channels; ++c)
      if (both[i] != 0)
        errors[i] = std::max(errors[i], std::abs(a.data[i * a.channels + c] - b.data[i * a.channels + c]));
  Image picture = heat_map(test.size, errors, 1.0f / gain);
  for (size_t i = 0; i < both.size(); ++i)
    if (both[i] == 0 && (test.coverage[i] > 0.0f) != (reference.coverage[i] > 0.0f))
      for (size_t c = 0; c < 3; ++c) picture.data[3 * i + c] = kOnlyOne[static_cast<int>(c)];
  return picture;
}

} // namespace packtrace
