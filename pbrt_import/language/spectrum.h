#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/language/parameters.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Linear sRGB from CIE XYZ, D65 white.
Vec3 rgb_from_xyz(Vec3 xyz);

/// Linear sRGB of a spectrum given as (wavelength in nm, value) pairs in any order, linear between samples and constant
/// outside. A flat spectrum of 1 has Y = 1. Components may be negative for saturated colours.
/// Source: Chris Wyman, Peter-Pike Sloan, Peter Shirley, Simple Analytic Approximations to the CIE XYZ Color Matching
/// Functions, JCGT 2013, multi-lobe fit.
Vec3 rgb_from_samples(std::span<const float> pairs);

/// Linear sRGB of a black body spectrum, normalised to 1 at its peak wavelength (pbrt-v3's convention), times scale.
Vec3 rgb_from_blackbody(double kelvin, double scale);

/// Parses the (wavelength, value) pairs of an .spd file: numbers, with `#` comments to the end of the line.
/// @return nullopt if there is anything else, or an odd number of values or none
std::optional<std::vector<float>> parse_spd(std::string_view text);

/// Directional-hemispherical reflectance of a smooth conductor in air, averaged over cosine-weighted directions.
/// Source: Fresnel equations for complex indices, Physically Based Rendering, 3rd edition, 2016, section 8.2.1.
float conductor_albedo(float eta, float k);

/// Complex indices of refraction at the wavelengths of sRGB's primaries.
struct MetalIndices {
  Vec3 eta{0.0f};
  Vec3 k{0.0f};
};

/// Indices of refraction by chemical symbol, which starts file names such as "metals/Cu.eta.spd". Copper is pbrt-v3's
/// default metal.
/// @return nullopt if the metal is not in the table
std::optional<MetalIndices> metal_by_name(std::string_view name);

} // namespace packtrace
