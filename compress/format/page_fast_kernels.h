#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "compress/format/index_codec.h"
#include "compress/format/page_fast.h"

namespace packtrace::page_fast {

/// Kernels read and write whole words: so many bytes behind the parts and the arrays belong to nobody.
inline constexpr size_t kPartSlackBytes = 64;
/// Imported words begin here.
inline constexpr uint32_t kFirstImport = kMaxClusterVertices + 8;
inline constexpr uint32_t kMaxImports = 255;

/// Of one cluster. Bits are expanded to a byte each.
struct WalkMemory {
  std::array<uint8_t, kMaxClusterTriangles + 8> left{};
  std::array<uint8_t, kMaxClusterCorners + 8> fresh{};
  std::array<uint8_t, kMaxClusterVertices + 8> crease{}, import{}; ///< by vertex
  std::array<uint8_t, kMaxClusterCorners + kMaxClusterVertices + 8> olds{};
  std::array<uint8_t, kMaxClusterCorners + 8> explicits{}; ///< vertices that corners name which are not fresh
  /// The first vertex, then what the next ones are off their predictions.
  std::array<std::array<uint64_t, kMaxClusterVertices + 8>, kChannels> residuals{};
  std::array<std::array<uint64_t, kFirstImport + kMaxImports + 1>, kChannels> words{}; ///< vertices, then imports
};

struct WalkInput {
  const uint8_t* runs = nullptr; ///< triangles of each strip, at most 128 in all
  uint32_t run_count = 0;
  bool imports_normals = false; ///< imports bring their normals
};

/// Bit i as byte i, 0 or 1, for i < count; some bytes behind are zeroed. Returns how many are 1.
uint32_t expand_bits(const uint8_t* bits, uint32_t count, uint8_t* out);

/// Zigzag differences to the last, modulo 256, added up.
void add_up_olds(const uint8_t* differences, uint32_t count, uint8_t* out);

/// Adds to out[i] the signed number with bytes[i] above low_bits bits, as a zigzag number, times 2^shift.
void add_residuals(const uint8_t* bytes, uint32_t count, const uint8_t* bits, uint64_t bit, uint32_t low_bits,
                   uint32_t shift, uint64_t* out);

/// Words and explicit vertices of a cluster. Stays within its memory whatever it is given, if as many corners are fresh
/// as there are vertices.
void walk_strips(const WalkInput& input, WalkMemory& memory, bool has_normals, bool has_uvs, bool shared);

/// out[i] = the field of words[i], plus base.
void keep_field(const uint64_t* words, uint32_t count, uint32_t shift, uint32_t width, uint32_t base, uint32_t* out);

} // namespace packtrace::page_fast
