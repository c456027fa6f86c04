#include "pbrt_import/language/spectrum.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pbrt_import/text/number.h"

namespace packtrace {
namespace {

constexpr double kFirstNm = 380.0, kLastNm = 780.0, kStepNm = 5.0;

/// A Gaussian with different widths on either side of its mean.
double lobe(double x, double mean, double inverse_width_below, double inverse_width_above) {
  const double t = (x - mean) * (x < mean ? inverse_width_below : inverse_width_above);
  return std::exp(-0.5 * t * t);
}

DVec3 matching_functions(double nm) {
  return {0.362 * lobe(nm, 442.0, 0.0624, 0.0374) + 1.056 * lobe(nm, 599.8, 0.0264, 0.0323) -
              0.065 * lobe(nm, 501.1, 0.0490, 0.0382),
          0.821 * lobe(nm, 568.8, 0.0213, 0.0247) + 0.286 * lobe(nm, 530.9, 0.0613, 0.0322),
          1.217 * lobe(nm, 437.0, 0.0845, 0.0278) + 0.681 * lobe(nm, 459.0, 0.0385, 0.0725)};
}

/// Linear sRGB of a spectrum, normalised so that a flat spectrum of 1 has Y = 1.
template <class Spectrum>
Vec3 rgb_from_spectrum(Spectrum spectrum) {
  DVec3 xyz(0.0);
  double flat_y = 0.0;
  for (double nm = kFirstNm; nm <= kLastNm; nm += kStepNm) {
    const DVec3 matching = matching_functions(nm);
    xyz += matching * spectrum(nm);
    flat_y += matching.y;
  }
  return rgb_from_xyz(Vec3(xyz / flat_y));
}

double planck(double nm, double kelvin) {
  const double metres = nm * 1e-9;
  constexpr double kSecondConstant = 1.438776877e-2; // h c / k_B
  return 1.0 / (std::pow(metres, 5.0) * std::expm1(kSecondConstant / (metres * kelvin)));
}

} // namespace

Vec3 rgb_from_xyz(Vec3 xyz) {
  return {3.240479f * xyz.x - 1.537150f * xyz.y - 0.498535f * xyz.z,
          -0.969256f * xyz.x + 1.875991f * xyz.y + 0.041556f * xyz.z,
          0.055648f * xyz.x - 0.204043f * xyz.y + 1.057311f * xyz.z};
}

Vec3 rgb_from_samples(std::span<const float> pairs) {
  std::vector<std::pair<double, double>> samples;
  for (size_t i = 0; i + 1 < pairs.size(); i += 2)
    if (std::isfinite(pairs[i])) samples.emplace_back(pairs[i], pairs[i + 1]);
  if (samples.empty()) return Vec3(0.0f);
  std::stable_sort(samples.begin(), samples.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return rgb_from_spectrum([&](double nm) {
    const auto above = std::upper_bound(samples.begin(), samples.end(), nm,
                                        [](double x, const auto& sample) { return x < sample.first; });
    if (above == samples.begin()) return above->second;
    const auto below = above - 1;
    if (above == samples.end()) return below->second;
    const double t = (nm - below->first) / (above->first - below->first);
    return below->second + t * (above->second - below->second);
  });
}

Vec3 rgb_from_blackbody(double kelvin, double scale) {
  if (!(kelvin > 0.0)) return Vec3(0.0f);
  constexpr double kWien = 2.8977721e-3; // metres x kelvin
  const double peak = planck(kWien / kelvin * 1e9, kelvin);
  return rgb_from_spectrum([&](double nm) { return scale * planck(nm, kelvin) / peak; });
}

std::optional<std::vector<float>> parse_spd(std::string_view text) {
  std::vector<float> values;
  while (!text.empty()) {
    if (text[0] == '#') {
      text.remove_prefix(std::min(text.find_first_of("\r\n"), text.size()));
    } else if (is_space(text[0])) {
      text.remove_prefix(1);
    } else {
      const NumberText<float> number = parse_number<float>(text);
      if (number.used == 0) return std::nullopt;
      values.push_back(number.value);
      text.remove_prefix(number.used);
    }
  }
  if (values.empty() || values.size() % 2 != 0) return std::nullopt;
  return values;
}

float conductor_albedo(float eta, float k) {
  constexpr int kSteps = 64;
  const double eta2 = static_cast<double>(eta) * eta, k2 = static_cast<double>(k) * k;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    // Samples cos^2 at midpoints: d(cos^2) = 2 cos d(cos) is the cosine weight.
    const double cos2 = (i + 0.5) / kSteps, sin2 = 1.0 - cos2, cosine = std::sqrt(cos2);
    const double t0 = eta2 - k2 - sin2;
    const double a2b2 = std::sqrt(t0 * t0 + 4.0 * eta2 * k2);
    const double a = std::sqrt(std::max(0.0, 0.5 * (a2b2 + t0)));
    const double s1 = a2b2 + cos2, s2 = 2.0 * a * cosine;
    const double perpendicular = (s1 - s2) / (s1 + s2);
    const double p1 = cos2 * a2b2 + sin2 * sin2, p2 = s2 * sin2;
    const double parallel = perpendicular * (p1 - p2) / (p1 + p2);
    sum += 0.5 * (perpendicular + parallel);
  }
  const double albedo = sum / kSteps;
  return std::isfinite(albedo) ? static_cast<float>(std::clamp(albedo, 0.0, 1.0)) : 1.0f;
}

std::optional<MetalIndices> metal_by_name(std::string_view name) {
  struct Entry {
    std::string_view symbol;
    MetalIndices indices;
  };
  static const Entry kMetals[] = {
      {"Cu", {{0.200f, 0.924f, 1.102f}, {3.912f, 2.448f, 2.142f}}},
      {"Au", {{0.143f, 0.375f, 1.442f}, {3.983f, 2.386f, 1.603f}}},
      {"Ag", {{0.155f, 0.117f, 0.138f}, {4.828f, 3.122f, 2.147f}}},
      {"Al", {{1.657f, 0.880f, 0.521f}, {9.224f, 6.270f, 4.837f}}},
      {"Cr", {{4.369f, 2.917f, 1.655f}, {5.206f, 4.231f, 3.755f}}},
      {"W", {{4.367f, 3.300f, 2.998f}, {3.496f, 2.605f, 2.273f}}},
  };
  const size_t slash = name.find_last_of("/\\");
  if (slash != std::string_view::npos) name.remove_prefix(slash + 1);
  const std::string_view symbol = name.substr(0, name.find('.'));
  for (const Entry& entry : kMetals)
    if (entry.symbol == symbol) return entry.indices;
  return std::nullopt;
}

} // namespace packtrace
