#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

namespace packtrace {

/// How a geometry's texture coordinates are stored. The numbers are on disk.
enum class UvEncoding : uint32_t {
  kLattice, ///< steps of 2^uv_exponent, chosen from the size of the textures
  kUnorm16, ///< steps of 1 / 65535: what 16-bit unorm texture coordinates hold, with whole tiles on top
  kFp16     ///< half floats, numbered from -31743 to 31743 by their value
};
inline constexpr std::array<std::string_view, 3> kUvEncodingNames{"lattice", "unorm16", "fp16"};
std::optional<UvEncoding> find_uv_encoding(std::string_view name);

/// A texture coordinate of u and v as whole numbers, in which neighbours differ little: what clusters store.
using UvLattice = std::array<int32_t, 2>;
inline constexpr int32_t kMaxUvLattice = (1 << 30) - 1;
inline constexpr int32_t kMinUvExponent = -148;
inline constexpr int32_t kMaxUvExponent = 98; // by which the largest float has 30 bits
inline constexpr int32_t kMaxFp16Code = 0x7bff;

/// Codes per texel of the finest texture that a geometry's coordinates look up.
inline constexpr double kUvCodesPerTexel = 16.0;

/// Exponent e of the lattice's step 2^e for one axis: at most 1 / (16 texels |scale|), but not so fine that max_abs
/// would leave the lattice; there the step is 2^-6 of the largest float's own.
/// @param texels the texture's size along the axis, >= 1
/// @param scale  texture coordinates per uv (AlphaMask::uv_scale)
/// @param max_abs largest |uv| of the geometry along the axis
int32_t choose_uv_exponent(uint32_t texels, float scale, float max_abs);

/// The nearest code, or nothing where uv is beyond what the encoding holds: |uv| <= 16384 for unorm16, < 65520 for
/// fp16.
/// @param uv finite
/// @param exponent of choose_uv_exponent() for at least |uv|; without meaning but for the lattice
std::optional<int32_t> encode_uv(UvEncoding encoding, float uv, int32_t exponent);

/// One axis of a geometry's texture coordinates, ready to decode.
class UvDecoder {
public:
  UvDecoder(UvEncoding encoding, int32_t exponent);

  /// Total: codes beyond fp16's, and results beyond floats, give the largest number.
  /// Lattice: the nearest float to code 2^exponent, which is exact where |code| <= 2^24 and else within half an ulp;
  /// a float that the step divides comes back exactly. unorm16: the nearest float to code / 65535.
  float operator()(int64_t code) const {
    if (encoding_ == UvEncoding::kFp16) return from_fp16(code);
    constexpr double kMost = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(static_cast<double>(code) * step_ / divisor_, -kMost, kMost));
  }

private:
  static float from_fp16(int64_t code);

  UvEncoding encoding_;
  double step_, divisor_;
};

} // namespace packtrace
