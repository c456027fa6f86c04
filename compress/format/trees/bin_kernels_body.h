// Kernels of bin_kernels.h, compiled once per instruction set. Code here must not use inline functions of other
// headers, because they would be compiled for AVX2.

#ifdef __AVX__
#include <immintrin.h>
#endif

#include "compress/format/trees/bin_kernels.h"

namespace packtrace::bin_kernels {
namespace {

using Float4 = float __attribute__((vector_size(16), may_alias));
using Float8 = float __attribute__((vector_size(32)));
using Double4 = double __attribute__((vector_size(32)));
using Int4 = int32_t __attribute__((vector_size(16)));
using Long4 = int64_t __attribute__((vector_size(32)));
constexpr float kInfinity = __builtin_inff();

[[gnu::always_inline]] inline Float4 load(const float* from) {
  Float4 out;
  __builtin_memcpy(&out, from, sizeof out);
  return out;
}
[[gnu::always_inline]] inline Float4 min_of(Float4 a, Float4 b) { return a < b ? a : b; }
[[gnu::always_inline]] inline Float4 max_of(Float4 a, Float4 b) { return a > b ? a : b; }
[[gnu::always_inline]] inline Float8 max_of(Float8 a, Float8 b) { return a > b ? a : b; }
[[gnu::always_inline]] inline Double4 to_doubles(Float4 lanes) {
#ifdef __AVX__ // GCC 12 would convert halves and join them
  return _mm256_cvtps_pd(lanes);
#else
  return __builtin_convertvector(lanes, Double4);
#endif
}

/// A box in two overlapping vectors of its six floats.
struct BoxLanes {
  Float4 front; ///< low ends, then the first high end
  Float4 back;  ///< the last low end, then high ends

  [[gnu::always_inline]] explicit BoxLanes(const float* box) : front(load(box)), back(load(box + 2)) {}

  /// High ends; the fourth lane is not used.
  [[gnu::always_inline]] Float4 high() const { return __builtin_shufflevector(back, back, 1, 2, 3, 3); }
  /// The centre along each axis, rounded to floats; the fourth lane is not used.
  [[gnu::always_inline]] Float4 centre() const {
    return __builtin_convertvector((to_doubles(front) + to_doubles(high())) * 0.5, Float4);
  }
};

void measure(const Run& run, RunBounds& out) {
  const BoxLanes first(run.boxes + uint64_t{6} * run.order[0]);
  Float4 front = first.front, back = first.back, lowest = first.centre(), highest = lowest;
  for (uint32_t i = 1; i < run.count; ++i) {
    const BoxLanes box(run.boxes + uint64_t{6} * run.order[i]);
    front = min_of(box.front, front);
    back = max_of(box.back, back);
    const Float4 place = box.centre();
    lowest = min_of(place, lowest);
    highest = max_of(place, highest);
  }
  __builtin_memcpy(out.boxes + 2, &back, sizeof back);
  __builtin_memcpy(out.boxes, &front, 3 * sizeof(float));
  __builtin_memcpy(out.centres, &lowest, 3 * sizeof(float));
  __builtin_memcpy(out.centres + 3, &highest, 3 * sizeof(float));
}

constexpr uint32_t kWordBits = 64, kMaxWords = 512, kFewBoxes = kWordBits * kMaxWords;

/// The bins of up to kFewBoxes boxes, by axis.
struct BinNumbers {
  uint8_t of_axis[3][kFewBoxes];
};

/// Boxes in the bins of three axes, and how many there are.
struct BinBoxes {
  Float8 boxes[3][kMaxBins];   ///< negated low ends in lanes 0..2, high ends in lanes 4..6; other lanes are not used
  int32_t counts[kMaxBins][4]; ///< by axis

  /// @param numbers if kKeep, receives the bin of each box
  template <bool kKeep>
  [[gnu::always_inline]] void fill(const Run& run, const Bins& bins, BinNumbers* numbers) {
    const Float8 nothing = Float8{} - kInfinity;
    for (auto& axis : boxes)
      for (uint32_t b = 0; b < bins.count; ++b) axis[b] = nothing;
    for (uint32_t b = 0; b < bins.count; ++b)
      for (int32_t& count : counts[b]) count = 0;
    const Double4 low{bins.low[0], bins.low[1], bins.low[2]}, scale{bins.scale[0], bins.scale[1], bins.scale[2]};
    const Int4 last = Int4{} + static_cast<int32_t>(bins.count - 1);
    for (uint32_t i = 0; i < run.count; ++i) {
      const BoxLanes box(run.boxes + uint64_t{6} * run.order[i]);
      const Float8 lanes = __builtin_shufflevector(-box.front, box.high(), 0, 1, 2, 3, 4, 5, 6, 7);
      const Double4 place = to_doubles(box.centre()) * 2.0;
      Int4 bin = __builtin_convertvector((place - low) * scale, Int4); // not negative
      bin = bin < last ? bin : last;
      uint32_t bin_of[4];
      __builtin_memcpy(bin_of, &bin, sizeof bin_of);
      for (uint32_t axis = 0; axis < 3; ++axis) {
        Float8& of_bin = boxes[axis][bin_of[axis]];
        of_bin = max_of(lanes, of_bin);
        ++counts[bin_of[axis]][axis];
        if (kKeep) numbers->of_axis[axis][i] = static_cast<uint8_t>(bin_of[axis]);
      }
    }
  }
};

/// A box and a number of boxes per axis.
struct Side {
  Float8 x, y, z;
  Int4 count;

  [[gnu::always_inline]] void add(const BinBoxes& bins, uint32_t b) {
    x = max_of(bins.boxes[0][b], x), y = max_of(bins.boxes[1][b], y), z = max_of(bins.boxes[2][b], z);
    Int4 more;
    __builtin_memcpy(&more, bins.counts[b], sizeof more);
    count += more;
  }
  /// Half the surface area of each box, times its units; NaN for no boxes. The fourth lane repeats the third.
  [[gnu::always_inline]] Double4 cost(double unit) const {
    const Float8 low = __builtin_shufflevector(x, y, 0, 8, 1, 9, 4, 12, 5, 13),
                 high = __builtin_shufflevector(x, y, 2, 10, 3, 11, 6, 14, 7, 15);
    const Double4 width = extent(__builtin_shufflevector(low, z, 0, 1, 8, 8, 4, 5, 12, 12)),
                  height = extent(__builtin_shufflevector(low, z, 2, 3, 9, 9, 6, 7, 13, 13)),
                  depth = extent(__builtin_shufflevector(high, z, 0, 1, 10, 10, 4, 5, 14, 14));
    // Half a box more keeps the quotient away from integers, so that its rounding does not matter.
    const Double4 units = (__builtin_convertvector(count, Double4) + (unit - 0.5)) * (1.0 / unit);
    return (width * height + height * depth + depth * width) *
           __builtin_convertvector(__builtin_convertvector(units, Int4), Double4);
  }

private:
  /// @param ends negated low ends, then high ends
  [[gnu::always_inline]] static Double4 extent(Float8 ends) {
    return to_doubles(__builtin_shufflevector(ends, ends, 4, 5, 6, 7)) +
           to_doubles(__builtin_shufflevector(ends, ends, 0, 1, 2, 3));
  }
};

struct BinSplit {
  uint32_t axis, bin; ///< the first bin on the right; 0 if there is no split
};

[[gnu::always_inline]] inline BinSplit find_split(const BinBoxes& bins, uint32_t count, double unit) {
  const Float8 nothing = Float8{} - kInfinity;
  Double4 right[kMaxBins]; // cost of bins b and above
  Side side{nothing, nothing, nothing, Int4{}};
  for (uint32_t b = count; b-- > 1;) {
    side.add(bins, b);
    right[b] = side.cost(unit);
  }
  side = {nothing, nothing, nothing, Int4{}};
  Double4 least = Double4{} + __builtin_inf();
  Long4 best = {}, at = {};
  for (uint32_t b = 1; b < count; ++b) {
    side.add(bins, b - 1);
    at += 1;
    const Double4 cost = side.cost(unit) + right[b]; // NaN if a side is empty
    const Long4 less = cost < least;
    least = less ? cost : least;
    best = less ? at : best;
  }
  double costs[4];
  int64_t places[4];
  __builtin_memcpy(costs, &least, sizeof costs);
  __builtin_memcpy(places, &best, sizeof places);
  uint32_t axis = 0;
  for (uint32_t i = 1; i < 3; ++i)
    if (costs[i] < costs[axis]) axis = i;
  return {axis, static_cast<uint32_t>(places[axis])};
}

/// Tells on which side of a split a box is.
class Sides {
public:
  Sides(const Run& run, const Bins& bins, const BinSplit& split)
      : low_end_(run.boxes + split.axis), low_(bins.low[split.axis]), scale_(bins.scale[split.axis]), bin_(split.bin) {}

  [[gnu::always_inline]] bool on_left(uint32_t box) const {
    const float* const ends = low_end_ + uint64_t{6} * box;
    const double place = 2.0 * double{static_cast<float>(0.5 * (double{ends[0]} + ends[3]))};
    return (place - low_) * scale_ < bin_; // as the bins are computed; the last bin is never on the left
  }

private:
  const float* low_end_;
  double low_, scale_, bin_;
};

[[gnu::always_inline]] inline void swap_boxes(uint32_t& a, uint32_t& b) {
  const uint32_t box = a;
  a = b, b = box;
}

/// Exchanges the first box on the wrong side with the last one, and so on.
uint32_t partition(uint32_t* order, uint32_t count, const Sides& sides) {
  uint32_t first = 0, last = count;
  for (;; ++first) {
    while (first < last && sides.on_left(order[first])) ++first;
    while (first < last && !sides.on_left(order[last - 1])) --last;
    if (first == last) return first;
    swap_boxes(order[first], order[--last]);
  }
}

/// Returns a bit for each of eight numbers, the first in the lowest bit: whether it is below `limit`.
/// @param limit at most 128, like all numbers below
[[gnu::always_inline]] inline uint64_t eight_below(const uint8_t* numbers, uint64_t limit) {
  constexpr uint64_t kOnes = 0x0101010101010101;
  uint64_t eight;
  __builtin_memcpy(&eight, numbers, sizeof eight);
  const uint64_t below = ~((eight | kOnes << 7) - limit * kOnes) >> 7 & kOnes;
  return below * 0x0102040810204080 >> 56;
}

/// The same for at most kFewBoxes boxes. Finds all sides first, because a branch on each would be mispredicted often.
/// @param numbers bins of the boxes along the split's axis; those behind the last box are readable
/// @param bin the first bin on the right
uint32_t partition_few(uint32_t* order, uint32_t count, const uint8_t* numbers, uint32_t bin) {
  uint64_t left[kMaxWords]; // a bit per box
  const uint32_t words = (count + kWordBits - 1) / kWordBits;
  uint32_t on_left = 0;
  for (uint32_t w = 0; w < words; ++w) {
    const uint32_t begin = w * kWordBits, bits = count - begin < kWordBits ? count - begin : kWordBits;
    uint64_t word = 0;
    for (uint32_t i = 0; i < bits; i += 8) word |= eight_below(numbers + begin + i, bin) << i;
    left[w] = word & ~uint64_t{0} >> (kWordBits - bits);
    on_left += static_cast<uint32_t>(__builtin_popcountll(left[w]));
  }
  uint32_t front = 0, back = words - 1;
  uint64_t misplaced_front = ~left[0], misplaced_back = left[back]; // those not exchanged yet
  for (;;) {
    while (misplaced_front == 0 && front * kWordBits + kWordBits < on_left) misplaced_front = ~left[++front];
    if (misplaced_front == 0) return on_left;
    const uint32_t i = front * kWordBits + static_cast<uint32_t>(__builtin_ctzll(misplaced_front));
    if (i >= on_left) return on_left;
    while (misplaced_back == 0) misplaced_back = left[--back]; // as many are misplaced there
    const auto bit = 63u - static_cast<uint32_t>(__builtin_clzll(misplaced_back));
    swap_boxes(order[i], order[back * kWordBits + bit]);
    misplaced_front &= misplaced_front - 1;
    misplaced_back &= ~(uint64_t{1} << bit);
  }
}

uint32_t split(const Run& run, const Bins& bins, uint32_t unit) {
  BinBoxes boxes;
  if (run.count > kFewBoxes) {
    boxes.fill<false>(run, bins, nullptr);
    const BinSplit best = find_split(boxes, bins.count, unit);
    return best.bin == 0 ? 0 : partition(run.order, run.count, Sides(run, bins, best));
  }
  BinNumbers numbers;
  boxes.fill<true>(run, bins, &numbers);
  for (auto& of_axis : numbers.of_axis) // completes eight numbers
    for (uint32_t i = run.count; i % 8 != 0; ++i) of_axis[i] = 0;
  const BinSplit best = find_split(boxes, bins.count, unit);
  return best.bin == 0 ? 0 : partition_few(run.order, run.count, numbers.of_axis[best.axis], best.bin);
}

} // namespace
} // namespace packtrace::bin_kernels
