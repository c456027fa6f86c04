#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Encoding of a geometry's normals. Files store these numbers.
enum class NormalEncoding : uint32_t { kZsign32, kAxis32, kAxis24, kAxis16, kOct32, kOct24, kOct20, kOct16, kAxis12 };

enum class NormalFamily : uint32_t {
  kZsign, ///< the sign of z and two components
  kAxis,  ///< the dominant axis, its sign, and the other two components
  kOct    ///< unfolded octahedron
};

/// Parameters of one encoding. A code is (chart * x_codes + x) * y_codes + y, below 2^bits.
struct NormalFormat {
  std::string_view name;
  NormalFamily family;
  uint32_t bits;
  uint32_t charts; ///< zsign: sign of z; axis: 2 axis + sign; oct: 1
  uint32_t x_codes, y_codes;
  double max_error_degrees; ///< upper bound of the angle between a unit vector and its decoded code
};

/// Indexed by NormalEncoding. The axis formats have the largest odd number of codes per axis that leaves room for six
/// charts. An odd number makes 0 a code.
inline constexpr std::array<NormalFormat, 9> kNormalFormats{{
    {"zsign32", NormalFamily::kZsign, 32, 2, 1u << 15, 1u << 16, 0.33},
    {"axis32", NormalFamily::kAxis, 32, 6, 26753, 26753, 0.0024},
    {"axis24", NormalFamily::kAxis, 24, 6, 1671, 1671, 0.0385},
    {"axis16", NormalFamily::kAxis, 16, 6, 103, 103, 0.63},
    {"oct32", NormalFamily::kOct, 32, 1, 1u << 16, 1u << 16, 0.0025},
    {"oct24", NormalFamily::kOct, 24, 1, 1u << 12, 1u << 12, 0.0405},
    {"oct20", NormalFamily::kOct, 20, 1, 1u << 10, 1u << 10, 0.162},
    {"oct16", NormalFamily::kOct, 16, 1, 1u << 8, 1u << 8, 0.65},
    {"axis12", NormalFamily::kAxis, 12, 6, 25, 25, 2.68},
}};

constexpr const NormalFormat& format_of(NormalEncoding encoding) {
  return kNormalFormats[static_cast<size_t>(encoding)];
}

/// Codes of +1 in zsign encodings; larger codes are never written.
inline constexpr int32_t kZsignXLast = 32766, kZsignYLast = 65534;

/// Coefficients of the axis encodings' cubic t (slope + cubic t^2). The slope at 0 is a multiple of 2^-10 close to the
/// one with the least maximum error. The cubic coefficient makes the value sqrt(1/2) at t = 1.
inline constexpr double kAxisSlope = 803.0 / 1024.0;
inline constexpr double kAxisCubic = 0.70710678118654752440 - kAxisSlope;

std::optional<NormalEncoding> find_normal_encoding(std::string_view name);

/// Components of a code. Canonical fields, as split_normal_code() returns them, have chart < charts, 0 <= x < x_codes
/// and 0 <= y < y_codes.
struct NormalFields {
  uint32_t chart = 0;
  int32_t x = 0, y = 0;
  bool operator==(const NormalFields&) const = default;
};

NormalFields split_normal_code(NormalEncoding encoding, uint32_t code);
/// @param fields canonical
uint32_t join_normal_code(NormalEncoding encoding, NormalFields fields);

/// Unfolds a normal of an axis encoding into the plane of the face `chart`. The charts are the faces of a cube; a face
/// and its four neighbours form a gapless cross in that plane, in which x and y are -codes .. 2 codes - 1. Normals on
/// the face itself keep their x and y. Returns nothing for the opposite face; in the other families, nothing for any
/// chart but the normal's own.
/// @param fields canonical
std::optional<NormalFields> unfold_normal(NormalEncoding encoding, NormalFields fields, uint32_t chart);

/// Returns the canonical fields of unfolded ones; inverse of unfold_normal(). Accepts any fields with |x|, |y| < 2^29:
/// if they do not lie on the cross, the result is a nearby code.
NormalFields fold_normal(NormalEncoding encoding, NormalFields fields);

/// Decodes a normal. Its length is 1 within 3e-7. The bits are the same on every machine: only +, -, x, / and square
/// root of floats are used.
/// zsign: x = 2 X / 32766 - 1, y = 2 Y / 65534 - 1, |z| = sqrt(1 - x^2 - y^2); outside the unit disc z = 0 and (x, y)
/// is scaled to length 1.
/// axis: for axis a of x, y, z and C codes, with t = (2 X - (C - 1)) / (C - 1) and s likewise from Y, component a + 1
/// is t (A + B t^2), component a + 2 (cyclic) is s (A + B s^2), and component a completes the unit length, with the
/// chart's sign. A + B = sqrt(1/2), where two components are equally large. The cubic spaces the codes almost evenly,
/// like sin(t pi / 4).
/// oct: x = (X - K) / K, y = (Y - K) / K, K = codes / 2 - 1, z = 1 - |x| - |y|, folded where z < 0, then normalised.
/// Source: Meyer, Suessmuth, Sussner, Stamminger, Greiner, "On Floating-Point Normal Vectors", 2010.
/// @param fields canonical
Vec3 decode_normal(NormalEncoding encoding, NormalFields fields);

/// Decodes any code. Codes that encode_normal() never writes decode to some unit vector.
Vec3 decode_normal(NormalEncoding encoding, uint32_t code);

/// Returns the code nearest to n among the four codes around it; for zsign32 among the nine codes around the rounded
/// one, as published. n must be finite and not zero; it is normalised first.
/// Source for oct: Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors", 2014.
uint32_t encode_normal(NormalEncoding encoding, DVec3 n);

/// A code and what it decodes to.
struct NearestNormal {
  uint32_t code = 0;
  Vec3 decoded{};
};

/// Like encode_normal(), without decoding the code again.
NearestNormal find_nearest_normal(NormalEncoding encoding, DVec3 n);

} // namespace packtrace
