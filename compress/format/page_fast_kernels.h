#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "compress/format/index_codec.h"
#include "compress/format/page_fast.h"

namespace packtrace::page_fast {

/// Kernels read and write whole words: so many bytes behind the parts and the arrays belong to nobody.
inline constexpr size_t kPartSlackBytes = 64;
inline constexpr size_t kSpareWords = 8;

/// Of one cluster. Bits are expanded to a byte each.
struct WalkMemory {
  using Words = std::array<uint64_t, kMaxClusterVertices + kSpareWords>;

  std::array<uint8_t, kMaxClusterTriangles + kSpareWords> left{};
  std::array<uint8_t, kMaxClusterCorners + kSpareWords> fresh{};
  std::array<uint8_t, kMaxClusterVertices + kSpareWords> crease{}, import{}; ///< by vertex
  std::array<uint8_t, kMaxClusterCorners + kMaxClusterVertices + kSpareWords> olds{};
  std::array<uint8_t, kMaxClusterCorners + kSpareWords> explicits{}; ///< vertices that corners name which are not fresh
  std::array<Words, kChannels> residuals{}; ///< by vertex: what it is off its guess, or all of it where it is imported
  Words guessed{};                          ///< by vertex: 0 where it is imported, else ~0
  std::array<Words, kChannels> words{};
};

struct WalkInput {
  const uint8_t* runs = nullptr; ///< triangles of each strip, at most 128 in all
  uint32_t run_count = 0;
  std::array<bool, kChannels> has{}; ///< of the positions always
  std::array<bool, kChannels> imported{}; ///< `guessed` is to be looked at
  bool creases = false;              ///< so is `crease`, and olds[] holds their originals as well
};

/// Bit i as byte i, 0 or 1, for i < count; some bytes behind are zeroed. Returns how many are 1.
uint32_t expand_bits(const uint8_t* bits, uint32_t count, uint8_t* out);

/// Zigzag differences to the last, modulo 256, added up.
void add_up_olds(const uint8_t* differences, uint32_t count, uint8_t* out);

/// Adds to out[i] the signed number with bytes[i] above low_bits bits, as a zigzag number, times 2^shift.
void add_residuals(const uint8_t* bytes, uint32_t count, const uint8_t* bits, uint64_t bit, uint32_t low_bits,
                   uint32_t shift, uint64_t* out);

/// Makes room for the vertices with flags[i] != 0: out[i] = residuals[k] for the k-th of the others. Those get any.
void spread_residuals(const uint64_t* residuals, const uint8_t* flags, uint32_t count, uint64_t* out);

/// Words and explicit vertices of a cluster. Stays within its memory whatever it is given, if as many corners are fresh
/// as there are vertices.
void walk_strips(const WalkInput& input, WalkMemory& memory);

/// out[i] = the field of words[i], plus base.
void keep_field(const uint64_t* words, uint32_t count, uint32_t shift, uint32_t width, uint32_t base, uint32_t* out);

} // namespace packtrace::page_fast
