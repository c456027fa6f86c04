#include "compress/format/pages/page_fast_kernels.h"
#include "pbrt_import/base/cpu.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace packtrace::page_fast {
namespace {

/// Words of two channels in one register.
using Pair [[gnu::vector_size(16)]] = uint64_t;

/// Returns `a` in lanes where mask is ~0, and `b` where it is 0.
template <class Lane>
Lane select(Lane mask, Lane a, Lane b) {
  return b ^ ((a ^ b) & mask);
}
uint64_t mask_of(uint64_t bit) { return 0 - bit; }

/// State of one or two channels that share a register.
template <class Lane>
struct Channels {
  // NOLINTNEXTLINE(bugprone-sizeof-expression): Lane is a vector or a single word
  static constexpr size_t kCount = sizeof(Lane) / sizeof(uint64_t);

  std::array<uint64_t*, kCount> words;
  std::array<const uint64_t*, kCount> residuals;

  template <class Pointers>
  static Lane load(const Pointers& from, uint32_t i) {
    if constexpr (kCount == 1)
      return from[0][i];
    else
      return Lane{from[0][i], from[1][i]};
  }
  void store(uint32_t i, Lane word) const {
    if constexpr (kCount == 1)
      words[0][i] = word;
    else
      words[0][i] = word[0], words[1][i] = word[1];
  }
  static Lane both(uint64_t first, uint64_t second) {
    if constexpr (kCount == 1)
      return first;
    else
      return Lane{first, second};
  }

  Lane a{}, b{}, c{}; ///< words of the corners of the last triangle
};

/// Reconstructs the vertex words of a cluster along its strips. The first channel holds positions; a crease copies its
/// position from an older vertex, but has its own values in the other channels.
template <class Lane, uint32_t kCount, bool kCreases>
class Walk {
public:
  /// @param channels positions first; a channel may occur twice
  Walk(const WalkInput& input, WalkMemory& memory,
       const std::array<uint32_t, kCount * Channels<Lane>::kCount>& channels)
      : input_(input), memory_(memory) {
    for (uint32_t i = 0; i < channels.size(); ++i) {
      Channels<Lane>& one = t_[i / Channels<Lane>::kCount];
      one.words[i % Channels<Lane>::kCount] = memory.words[channels[i]].data();
      one.residuals[i % Channels<Lane>::kCount] = memory.residuals[channels[i]].data();
    }
  }

  void run() {
    const uint8_t* left = memory_.left.data();
    for (uint32_t strip = 0; strip < input_.run_count; ++strip) {
      first_triangle();
      ++left;
      for (uint32_t i = 1; i < input_.runs[strip]; ++i) {
        const uint64_t turn = mask_of(*left++);
        const Lane go_left = Channels<Lane>::both(turn, turn);
        std::array<Lane, kCount> guess;
        for (uint32_t k = 0; k < kCount; ++k) {
          Channels<Lane>& t = t_[k];
          guess[k] = t.c + ((t.b - t.a) ^ go_left) - go_left; // p + q - o
          const Lane a = select(go_left, t.a, t.c);
          t.b = select(go_left, t.c, t.b);
          t.a = a;
        }
        corner(guess);
      }
    }
    if constexpr (!kCreases)
      std::memcpy(memory_.explicits.data(), memory_.reused_vertices.data(), memory_.explicits.size());
  }

private:
  void first_triangle() {
    for (uint32_t i = 0; i < 3; ++i) {
      std::array<Lane, kCount> guess;
      for (uint32_t k = 0; k < kCount; ++k) {
        guess[k] = t_[k].c;
        t_[k].a = t_[k].b, t_[k].b = t_[k].c;
      }
      corner(guess);
    }
  }

  void corner(const std::array<Lane, kCount>& guess) {
    const uint32_t fresh = memory_.fresh[corner_++], named = memory_.reused_vertices[reused_];
    const uint32_t placed = kCreases ? fresh & (memory_.crease[vertex_] ^ 1u) : fresh; // fresh and no crease
    reused_ += placed ^ 1u;
    if constexpr (kCreases) {
      memory_.explicits[explicit_] = static_cast<uint8_t>(named);
      explicit_ += fresh ^ 1u;
    }
    for (uint32_t k = 0; k < kCount; ++k) {
      // All but the last two operations are independent of the guess.
      Channels<Lane>& t = t_[k];
      const Lane is_new = Channels<Lane>::both(mask_of(k == 0 ? placed : fresh), mask_of(fresh));
      const Lane rest = select(is_new, t.load(t.residuals, vertex_), t.load(t.words, named));
      t.c = (guess[k] & is_new) + rest;
      t.store(vertex_, t.c); // harmless for an old vertex: a later one overwrites it
    }
    vertex_ += fresh;
  }

  const WalkInput& input_;
  WalkMemory& memory_;
  std::array<Channels<Lane>, kCount> t_;
  uint32_t corner_ = 0, vertex_ = 0, reused_ = 0, explicit_ = 0;
};

template <class Lane, uint32_t kCount>
void walk_channels(const WalkInput& input, WalkMemory& memory,
                   const std::array<uint32_t, kCount * Channels<Lane>::kCount>& channels) {
  if (input.creases)
    Walk<Lane, kCount, true>(input, memory, channels).run();
  else
    Walk<Lane, kCount, false>(input, memory, channels).run();
}

template <uint32_t kCount>
void sum_fields(const ChannelCode& code, uint32_t count, uint64_t* out) {
  if (code.low_stride == 0) {
    for (uint32_t i = 0; i < count; ++i) {
      uint64_t word = 0;
      for (uint32_t f = 0; f < kCount; ++f) word += unzigzag(code.fields[f].bytes[i]) << code.fields[f].shift;
      out[i] = word;
    }
    return;
  }
  for (uint32_t i = 0; i < count; ++i) {
    const uint64_t low = code.low_of(i);
    uint64_t word = 0;
    for (uint32_t f = 0; f < kCount; ++f) word += residual_word(code.fields[f], code.fields[f].bytes[i], low);
    out[i] = word;
  }
}

} // namespace

uint32_t expand_bits(const uint8_t* bits, uint32_t count, uint8_t* out) {
  uint32_t ones = 0;
  for (uint32_t i = 0; i < count; i += 8) {
    uint64_t byte = bits[i / 8];
    if (count - i < 8) byte &= (1u << (count - i)) - 1;
    // Byte k keeps bit k of eight copies of the byte; then nonzero bytes become 1.
    const uint64_t spread = (byte * 0x0101010101010101u) & 0x8040201008040201u;
    const uint64_t bytes = ((spread + 0x7f7f7f7f7f7f7f7fu) >> 7) & 0x0101010101010101u;
    ones += static_cast<uint32_t>((bytes * 0x0101010101010101u) >> 56);
    std::memcpy(out + i, &bytes, sizeof bytes);
  }
  return ones;
}

void sum_reused_vertices(const uint8_t* differences, uint32_t count, uint8_t* out) {
  uint32_t last = 0;
  for (uint32_t i = 0; i < count; ++i) {
    last += static_cast<uint32_t>(unzigzag(differences[i]));
    out[i] = static_cast<uint8_t>(last);
  }
}

void read_residuals(const ChannelCode& code, uint32_t count, uint64_t* out) {
  if (code.field_count == 3)
    sum_fields<3>(code, count, out);
  else if (code.field_count == 2)
    sum_fields<2>(code, count, out);
  else
    sum_fields<1>(code, count, out);
}

uint64_t pack_four(const uint8_t* bytes, uint32_t width) {
  uint32_t four = 0;
  std::memcpy(&four, bytes, sizeof four);
  four &= ((1u << width) - 1) * 0x01010101u;
  const uint32_t two = (four & 0x00ff00ffu) | ((four & 0xff00ff00u) >> (8 - width));
  return (two & 0xffffu) | (uint64_t{two >> 16} << (2 * width));
}

void expand_residuals(const uint64_t* residuals, const uint8_t* flags, uint32_t count, uint64_t* out) {
  for (uint32_t i = 0, k = 0; i < count; ++i) {
    out[i] = residuals[k];
    k += flags[i] ^ 1u;
  }
}

void walk_strips(const WalkInput& input, WalkMemory& memory) {
  if (input.has[kNormals] && input.has[kUvs])
    walk_channels<Pair, 2>(input, memory, {kPositions, kNormals, kUvs, kUvs});
  else if (input.has[kNormals])
    walk_channels<Pair, 1>(input, memory, {kPositions, kNormals});
  else if (input.has[kUvs])
    walk_channels<Pair, 1>(input, memory, {kPositions, kUvs});
  else
    walk_channels<uint64_t, 1>(input, memory, {kPositions});
}

ResidualKernel residual_kernel() {
#if defined(__x86_64__)
  if (cpu_has_avx2()) return avx2::read_residuals;
#endif
  return read_residuals;
}

} // namespace packtrace::page_fast
