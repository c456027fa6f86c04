#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// How a geometry's normals are stored. The numbers are on disk.
enum class NormalEncoding : uint32_t { kZsign32, kAxis32, kAxis24, kAxis16, kOct32, kOct24, kOct20, kOct16 };

enum class NormalFamily : uint32_t {
  kZsign, ///< the sign of z and two components
  kAxis,  ///< the dominant axis, its sign, and the two other components
  kOct    ///< octahedron, unfolded
};

/// One encoding. A code is (chart * x_codes + x) * y_codes + y, below 2^bits.
struct NormalFormat {
  std::string_view name;
  NormalFamily family;
  uint32_t bits;
  uint32_t charts; ///< zsign: sign of z; axis: 2 axis + sign; oct: 1
  uint32_t x_codes, y_codes;
  double max_error_degrees; ///< no unit vector is farther from its decoded code
};

/// By NormalEncoding. The axis formats have the largest odd number of codes that leaves room for six charts, so that 0
/// is a code.
inline constexpr std::array<NormalFormat, 8> kNormalFormats{{
    {"zsign32", NormalFamily::kZsign, 32, 2, 1u << 15, 1u << 16, 0.33},
    {"axis32", NormalFamily::kAxis, 32, 6, 26753, 26753, 0.0024},
    {"axis24", NormalFamily::kAxis, 24, 6, 1671, 1671, 0.0385},
    {"axis16", NormalFamily::kAxis, 16, 6, 103, 103, 0.63},
    {"oct32", NormalFamily::kOct, 32, 1, 1u << 16, 1u << 16, 0.0025},
    {"oct24", NormalFamily::kOct, 24, 1, 1u << 12, 1u << 12, 0.0405},
    {"oct20", NormalFamily::kOct, 20, 1, 1u << 10, 1u << 10, 0.162},
    {"oct16", NormalFamily::kOct, 16, 1, 1u << 8, 1u << 8, 0.65},
}};

constexpr const NormalFormat& format_of(NormalEncoding encoding) {
  return kNormalFormats[static_cast<size_t>(encoding)];
}

/// Of the cubic of the axis encodings, t (slope + cubic t^2): the slope at 0, a multiple of 2^-10 near the best for the
/// largest error, and what leads to sqrt(1/2) at t = 1.
inline constexpr double kAxisSlope = 803.0 / 1024.0;
inline constexpr double kAxisCubic = 0.70710678118654752440 - kAxisSlope;

std::optional<NormalEncoding> find_normal_encoding(std::string_view name);

/// The parts of a code. Those of split_normal_code() are canonical: chart < charts, 0 <= x < x_codes, 0 <= y < y_codes.
struct NormalFields {
  uint32_t chart = 0;
  int32_t x = 0, y = 0;
  bool operator==(const NormalFields&) const = default;
};

NormalFields split_normal_code(NormalEncoding encoding, uint32_t code);
/// @param fields canonical
uint32_t join_normal_code(NormalEncoding encoding, NormalFields fields);

/// The axis encodings' charts are the faces of a cube. Unfolding lays a face and its four neighbours into the plane of
/// the face `chart` as a cross, in which they join without a gap: x and y are then -codes .. 2 codes - 1. The
/// face itself keeps its x and y. Nothing for the opposite face; in the other families nothing for any other chart.
/// @param fields canonical
std::optional<NormalFields> unfold_normal(NormalEncoding encoding, NormalFields fields, uint32_t chart);

/// The canonical fields of unfolded ones; inverse of unfold_normal(). Total: for all other fields (|x|, |y| < 2^29),
/// the canonical fields of a nearby place.
NormalFields fold_normal(NormalEncoding encoding, NormalFields fields);

/// Unit length within 3e-7, the same bits on every machine: +, -, x, / and square root of floats.
/// @param fields canonical
/// zsign: x = 2 X / 32766 - 1, y = 2 Y / 65534 - 1, |z| = sqrt(1 - x^2 - y^2); outside the unit disc z = 0 and (x, y)
/// is scaled to length 1. axis: for axis a of x, y, z and C codes, with t = (2 X - (C - 1)) / (C - 1) and s likewise of
/// Y, component a + 1 is t (A + B t^2), component a + 2 (cyclic) is s (A + B s^2), and component a the rest of the unit
/// length with the chart's sign. A + B = sqrt(1/2), where two components are equally large; the cubic spreads the codes
/// evenly, as sin(t pi / 4) does. oct: x = (X - K) / K, y = (Y - K) / K, K = codes / 2 - 1, z = 1 - |x| - |y|, folded
/// where z < 0, normalised. Source: Meyer, Suessmuth, Sussner, Stamminger, Greiner, "On Floating-Point Normal Vectors",
/// 2010.
Vec3 decode_normal(NormalEncoding encoding, NormalFields fields);

/// For every code; those that encode_normal() never writes decode to some unit vector.
Vec3 decode_normal(NormalEncoding encoding, uint32_t code);

/// The code nearest to n among the four around it; for zsign32 among the nine around the rounded one, as published.
/// Inputs of any non-zero length are normalised first. n must be finite and not zero.
/// Source for oct: Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors", 2014.
uint32_t encode_normal(NormalEncoding encoding, DVec3 n);

} // namespace packtrace
