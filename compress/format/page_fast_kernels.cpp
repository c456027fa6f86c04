#include "compress/format/page_fast_kernels.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace packtrace::page_fast {
namespace {

/// All of `a` where mask is ~0, of `b` where it is 0.
uint64_t select(uint64_t mask, uint64_t a, uint64_t b) { return b ^ ((a ^ b) & mask); }
uint64_t mask_of(uint64_t bit) { return 0 - bit; }

constexpr WalkMemory::Words kAll = [] {
  WalkMemory::Words all{};
  for (uint64_t& word : all) word = ~uint64_t{0};
  return all;
}();

/// The words of the last triangle's corners in one channel.
struct Corners {
  uint64_t a = 0, b = 0, c = 0;
};

/// The channels behind the first are attributes, which creases have of their own.
template <uint32_t kCount, bool kImports, bool kCreases>
class Walk {
public:
  Walk(const WalkInput& input, WalkMemory& memory, const std::array<uint32_t, kCount>& channels)
      : input_(input), memory_(memory) {
    for (uint32_t k = 0; k < kCount; ++k) {
      words_[k] = memory.words[channels[k]].data();
      residuals_[k] = memory.residuals[channels[k]].data();
      guessed_[k] = input.imported[channels[k]] ? memory.guessed.data() : kAll.data();
    }
  }

  void run() {
    const uint8_t* left = memory_.left.data();
    std::array<Corners, kCount> t{};
    for (uint32_t strip = 0; strip < input_.run_count; ++strip) {
      first_triangle(t);
      ++left;
      for (uint32_t i = 1; i < input_.runs[strip]; ++i) {
        const uint64_t go_left = mask_of(*left++);
        std::array<uint64_t, kCount> guess;
        for (uint32_t k = 0; k < kCount; ++k) {
          Corners& one = t[k];
          guess[k] = one.c + ((one.b - one.a) ^ go_left) - go_left; // p + q - o
          const uint64_t a = select(go_left, one.a, one.c);
          one.b = select(go_left, one.c, one.b);
          one.a = a;
        }
        corner(t, guess);
      }
    }
    if constexpr (!kCreases) std::memcpy(memory_.explicits.data(), memory_.olds.data(), memory_.explicits.size());
  }

private:
  void first_triangle(std::array<Corners, kCount>& t) {
    for (uint32_t i = 0; i < 3; ++i) {
      std::array<uint64_t, kCount> guess;
      for (uint32_t k = 0; k < kCount; ++k) {
        guess[k] = t[k].c;
        t[k].a = t[k].b, t[k].b = t[k].c;
      }
      corner(t, guess);
    }
  }

  void corner(std::array<Corners, kCount>& t, const std::array<uint64_t, kCount>& guess) {
    const uint32_t fresh = memory_.fresh[corner_++], named = memory_.olds[old_];
    const uint32_t placed = kCreases ? fresh & (memory_.crease[vertex_] ^ 1u) : fresh; // not at a named vertex
    old_ += placed ^ 1u;
    if constexpr (kCreases) {
      memory_.explicits[explicit_] = static_cast<uint8_t>(named);
      explicit_ += fresh ^ 1u;
    }
    for (uint32_t k = 0; k < kCount; ++k) {
      // All but the last two operations can be done before the guess is known.
      const uint64_t is_new = mask_of(k == 0 ? placed : fresh);
      const uint64_t rest = select(is_new, residuals_[k][vertex_], words_[k][named]);
      const uint64_t word = (guess[k] & (kImports ? is_new & guessed_[k][vertex_] : is_new)) + rest;
      words_[k][vertex_] = word; // overwritten unless it is a new vertex
      t[k].c = word;
    }
    vertex_ += fresh;
  }

  const WalkInput& input_;
  WalkMemory& memory_;
  std::array<uint64_t*, kCount> words_;
  std::array<const uint64_t*, kCount> residuals_, guessed_;
  uint32_t corner_ = 0, vertex_ = 0, old_ = 0, explicit_ = 0;
};

template <uint32_t kCount>
void walk_channels(const WalkInput& input, WalkMemory& memory, const std::array<uint32_t, kCount>& channels) {
  if (input.creases)
    Walk<kCount, true, true>(input, memory, channels).run();
  else if (input.imported[kPositions])
    Walk<kCount, true, false>(input, memory, channels).run();
  else
    Walk<kCount, false, false>(input, memory, channels).run();
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
    // Byte k keeps bit k of eight copies, and then says whether there is anything.
    const uint64_t spread = (byte * 0x0101010101010101u) & 0x8040201008040201u;
    const uint64_t bytes = ((spread + 0x7f7f7f7f7f7f7f7fu) >> 7) & 0x0101010101010101u;
    ones += static_cast<uint32_t>((bytes * 0x0101010101010101u) >> 56);
    std::memcpy(out + i, &bytes, sizeof bytes);
  }
  return ones;
}

void add_up_olds(const uint8_t* differences, uint32_t count, uint8_t* out) {
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

void spread_residuals(const uint64_t* residuals, const uint8_t* flags, uint32_t count, uint64_t* out) {
  for (uint32_t i = 0, k = 0; i < count; ++i) {
    out[i] = residuals[k];
    k += flags[i] ^ 1u;
  }
}

void walk_strips(const WalkInput& input, WalkMemory& memory) {
  if (input.has[kNormals] && input.has[kUvs])
    walk_channels<3>(input, memory, {kPositions, kNormals, kUvs});
  else if (input.has[kNormals])
    walk_channels<2>(input, memory, {kPositions, kNormals});
  else if (input.has[kUvs])
    walk_channels<2>(input, memory, {kPositions, kUvs});
  else
    walk_channels<1>(input, memory, {kPositions});
}

void keep_field(const uint64_t* words, uint32_t count, uint32_t shift, uint32_t width, uint32_t base, uint32_t* out) {
  const uint64_t mask = (uint64_t{1} << width) - 1;
  for (uint32_t i = 0; i < count; ++i) out[i] = static_cast<uint32_t>((words[i] >> shift) & mask) + base;
}

const FieldKernels& field_kernels() {
  static constexpr FieldKernels kPortable{read_residuals, keep_field};
#if defined(__x86_64__)
  static constexpr FieldKernels kAvx2{avx2::read_residuals, avx2::keep_field};
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  if (has_avx2) return kAvx2;
#endif
  return kPortable;
}

} // namespace packtrace::page_fast
