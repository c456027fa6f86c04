#include "compress/format/page_fast_kernels.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace packtrace::page_fast {
namespace {

/// All of `a` where mask is ~0, of `b` where it is 0.
uint64_t select(uint64_t mask, uint64_t a, uint64_t b) { return b ^ ((a ^ b) & mask); }
uint64_t mask_of(uint64_t bit) { return 0 - bit; }

/// The words of the last triangle's corners in one channel.
struct Corners {
  uint64_t a = 0, b = 0, c = 0;
};

/// kShared: vertices may lie at older ones. The channels behind the first are attributes.
template <uint32_t kCount, bool kShared>
class Walk {
public:
  Walk(const WalkInput& input, WalkMemory& memory, const std::array<uint32_t, kCount>& channels)
      : input_(input), memory_(memory) {
    for (uint32_t i = 0; i < kCount; ++i) {
      words_[i] = memory.words[channels[i]].data();
      residuals_[i] = memory.residuals[channels[i]].data();
      carried_[i] = channels[i] == kNormals && !input.imports_normals ? 0 : 1;
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
    if constexpr (!kShared) std::memcpy(memory_.explicits.data(), memory_.olds.data(), memory_.explicits.size());
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
    const uint32_t fresh = memory_.fresh[corner_++];
    if constexpr (kShared) {
      const uint32_t import = memory_.import[vertex_] & fresh;
      const uint32_t old = (fresh ^ 1u) | ((memory_.crease[vertex_] | import) & fresh); // place
      const uint32_t named = memory_.olds[old_];
      memory_.explicits[explicit_] = static_cast<uint8_t>(named);
      const auto at = static_cast<uint32_t>(select(mask_of(import), kFirstImport + import_, named));
      old_ += old & (import ^ 1u), import_ += import, explicit_ += fresh ^ 1u;
      for (uint32_t k = 0; k < kCount; ++k) {
        const uint32_t kept = k == 0 ? old : (fresh ^ 1u) | (import & carried_[k]);
        const uint64_t word = select(mask_of(kept), words_[k][at], guess[k] + residuals_[k][used_[k]]);
        used_[k] += kept ^ 1u;
        words_[k][vertex_] = word;
        t[k].c = word;
      }
    } else {
      const uint64_t is_fresh = mask_of(fresh);
      const uint32_t at = memory_.olds[old_];
      old_ += fresh ^ 1u;
      for (uint32_t k = 0; k < kCount; ++k) {
        const uint64_t word = select(is_fresh, guess[k] + residuals_[k][vertex_], words_[k][at]);
        words_[k][vertex_] = word; // overwritten unless it is a new vertex
        t[k].c = word;
      }
    }
    vertex_ += fresh;
  }

  const WalkInput& input_;
  WalkMemory& memory_;
  std::array<uint64_t*, kCount> words_;
  std::array<const uint64_t*, kCount> residuals_;
  std::array<uint32_t, kCount> carried_, used_{};
  uint32_t corner_ = 0, vertex_ = 0, old_ = 0, explicit_ = 0, import_ = 0;
};

template <uint32_t kCount>
void walk_channels(const WalkInput& input, WalkMemory& memory, bool shared,
                   const std::array<uint32_t, kCount>& channels) {
  if (shared)
    Walk<kCount, true>(input, memory, channels).run();
  else
    Walk<kCount, false>(input, memory, channels).run();
}

} // namespace

uint32_t expand_bits(const uint8_t* bits, uint32_t count, uint8_t* out) {
  uint32_t ones = 0;
  for (uint32_t i = 0; i < count; i += 8) {
    uint64_t byte = bits[i / 8];
    if (count - i < 8) byte &= (1u << (count - i)) - 1;
    ones += static_cast<uint32_t>(std::popcount(byte));
    // Byte k keeps bit k of eight copies, and then says whether there is anything.
    const uint64_t spread = (byte * 0x0101010101010101u) & 0x8040201008040201u;
    const uint64_t bytes = ((spread + 0x7f7f7f7f7f7f7f7fu) >> 7) & 0x0101010101010101u;
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

void add_residuals(const uint8_t* bytes, uint32_t count, const uint8_t* bits, uint64_t bit, uint32_t low_bits,
                   uint32_t shift, uint64_t* out) {
  if (low_bits == 0) {
    for (uint32_t i = 0; i < count; ++i) out[i] += unzigzag(bytes[i]) << shift;
    return;
  }
  for (uint32_t i = 0; i < count; ++i, bit += low_bits)
    out[i] += unzigzag((uint64_t{bytes[i]} << low_bits) | read_bits(bits, bit, low_bits)) << shift;
}

void walk_strips(const WalkInput& input, WalkMemory& memory, bool has_normals, bool has_uvs, bool shared) {
  if (has_normals && has_uvs)
    walk_channels<3>(input, memory, shared, {kPositions, kNormals, kUvs});
  else if (has_normals)
    walk_channels<2>(input, memory, shared, {kPositions, kNormals});
  else if (has_uvs)
    walk_channels<2>(input, memory, shared, {kPositions, kUvs});
  else
    walk_channels<1>(input, memory, shared, {kPositions});
}

void keep_field(const uint64_t* words, uint32_t count, uint32_t shift, uint32_t width, uint32_t base, uint32_t* out) {
  const uint64_t mask = (uint64_t{1} << width) - 1;
  for (uint32_t i = 0; i < count; ++i) out[i] = static_cast<uint32_t>((words[i] >> shift) & mask) + base;
}

} // namespace packtrace::page_fast
