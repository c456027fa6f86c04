#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

namespace packtrace {

/// Encoding of a geometry's texture coordinates. Files store these numbers.
enum class UvEncoding : uint32_t {
  kLattice, ///< steps of 2^uv_exponent, chosen from the size of the textures
  kUnorm16, ///< steps of 1 / 65535: 16-bit unorm texture coordinates plus whole tiles
  kFp16     ///< half floats, numbered from -31743 to 31743 in order of their values
};
inline constexpr std::array<std::string_view, 3> kUvEncodingNames{"lattice", "unorm16", "fp16"};
std::optional<UvEncoding> find_uv_encoding(std::string_view name);

/// Codes of u and v as integers, as clusters store them. Neighbouring vertices have similar codes.
using UvLattice = std::array<int32_t, 2>;
inline constexpr int32_t kMaxUvLattice = (1 << 30) - 1;
inline constexpr int32_t kMinUvExponent = -148;
inline constexpr int32_t kMaxUvExponent = 98; // the largest float has 30 bits in steps of this size
inline constexpr int32_t kMaxFp16Code = 0x7bff;

/// A cluster's texture coordinates begin with the smallest code of each axis, then the field width of each axis.
inline constexpr uint32_t kUvAnchorBits = 32, kUvWidthBits = 5;
inline constexpr uint32_t kUvHeaderBits = 2 * (kUvAnchorBits + kUvWidthBits);

/// Codes per texel of the finest texture that a geometry uses.
inline constexpr double kUvCodesPerTexel = 16.0;

/// The exponents as geometry records hold them.
inline std::array<int16_t, 2> stored_uv_exponent(const std::array<int32_t, 2>& exponent) {
  return {static_cast<int16_t>(exponent[0]), static_cast<int16_t>(exponent[1])};
}

/// Chooses the exponent e of the lattice step 2^e for one axis. The step is at most 1 / (16 texels |scale|), unless
/// max_abs would then exceed the lattice; in that case it is 2^-6 ulp of max_abs.
/// @param texels the texture's size along the axis, >= 1
/// @param scale the texture's scale of uv (AlphaMask::uv_scale)
/// @param max_abs largest |uv| of the geometry along the axis
int32_t choose_uv_exponent(uint32_t texels, float scale, float max_abs);

/// Returns the nearest code, or nothing if uv exceeds the encoding's range: |uv| <= 16384 for unorm16, < 65520 for
/// fp16.
/// @param uv finite
/// @param exponent from choose_uv_exponent() for a max_abs of at least |uv|; only used for the lattice
std::optional<int32_t> encode_uv(UvEncoding encoding, float uv, int32_t exponent);

/// Decodes one axis of a geometry's texture coordinates.
class UvDecoder {
public:
  UvDecoder(UvEncoding encoding, int32_t exponent);

  /// Decodes any code; codes and results out of range are clamped to the largest number.
  /// Lattice: the float nearest to code 2^exponent. It is exact for |code| <= 2^24, and within half an ulp otherwise. A
  /// float that is a multiple of the step is restored exactly. unorm16: the float nearest to code / 65535.
  float operator()(int64_t code) const {
    if (encoding_ == UvEncoding::kFp16) return from_fp16(code);
    constexpr double kMax = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(static_cast<double>(code) * step_ / divisor_, -kMax, kMax));
  }

private:
  static float from_fp16(int64_t code);

  UvEncoding encoding_;
  double step_, divisor_;
};

} // namespace packtrace
