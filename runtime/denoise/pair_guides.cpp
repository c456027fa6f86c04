#include "runtime/denoise/pair_guides.h"

#include <tbb/enumerable_thread_specific.h>

#include "runtime/denoise/depth_derivatives.h"

namespace packtrace {
namespace {

/// Rows that a thread keeps, padded with zeros.
template <typename T>
class KeptRows {
public:
  explicit KeptRows(uint32_t width)
      : stride_(static_cast<size_t>(width) + 2 * kRowPadding), data_((kKept + 1) * stride_) {}
  T* row(int y) { return data_.data() + static_cast<size_t>(y & (kKept - 1)) * stride_ + kRowPadding; }
  const T* zeros() const { return data_.data() + kKept * stride_ + kRowPadding; }

private:
  static constexpr size_t kKept = 8; ///< more than the largest step and the rows above and below
  size_t stride_;
  std::vector<T> data_;
};

/// Guide weights of consecutive rows, as one thread computes them.
class GuideRows {
public:
  GuideRows(const Guides& guides, const GuideTerms& terms, const FilterKernels& kernels)
      : guides_(guides), terms_(terms), kernels_(kernels), width_(static_cast<int>(guides.size.width)),
        height_(static_cast<int>(guides.size.height)), dx_(guides.size.width), dy_(guides.size.width),
        lone_(guides.size.width), near_{KeptRows<uint8_t>(guides.size.width), KeptRows<uint8_t>(guides.size.width),
                                        KeptRows<uint8_t>(guides.size.width), KeptRows<uint8_t>(guides.size.width)} {}

  /// Starts anew at row y.
  void begin(int y) { next_derived_ = next_near_ = std::max(y - 1, 0), next_lone_ = y; }

  /// Computes the weights of a row; rows come in ascending order.
  void write(int y, size_t step_index, const std::array<uint8_t*, 4>& weights) {
    const int step = PairGuides::kSteps[step_index];
    for (; next_lone_ <= std::min(y + PairGuides::kSteps.back(), height_ - 1); ++next_lone_) find_lone(next_lone_);
    if (step == 1)
      for (size_t d = 0; d < weights.size(); ++d) std::copy_n(near_[d].row(y), width_, weights[d]);
    else
      kernels_.guide(width_, step, surface(y), surface(y + step), terms_, weights);
    kernels_.raise_guides(width_, step, lone_.row(y), y + step < height_ ? lone_.row(y + step) : lone_.zeros(),
                          weights);
  }

private:
  SurfaceRow surface(int y) {
    return {guides_.disparity.row(y), dx_.row(y), dy_.row(y), guides_.normal_x.row(y), guides_.normal_y.row(y),
            guides_.normal_z.row(y)};
  }

  void find_lone(int y) {
    for (; next_near_ <= y; ++next_near_) {
      for (; next_derived_ <= std::min(next_near_ + 1, height_ - 1); ++next_derived_)
        derive_row(width_, guides_.disparity.row(next_derived_ - 1), guides_.disparity.row(next_derived_),
                   guides_.disparity.row(next_derived_ + 1), dx_.row(next_derived_), dy_.row(next_derived_));
      kernels_.guide(
          width_, 1, surface(next_near_), surface(next_near_ + 1), terms_,
          {near_[0].row(next_near_), near_[1].row(next_near_), near_[2].row(next_near_), near_[3].row(next_near_)});
    }
    const auto pairs = [&](int row) {
      PairRow rows;
      for (size_t d = 0; d < rows.size(); ++d) rows[d] = row >= 0 ? near_[d].row(row) : near_[d].zeros();
      return rows;
    };
    kernels_.lone_guide(width_, pairs(y), pairs(y - 1), guides_.disparity.row(y), lone_.row(y));
  }

  const Guides& guides_;
  const GuideTerms terms_;
  const FilterKernels& kernels_;
  int width_, height_;
  int next_derived_ = 0, next_near_ = 0, next_lone_ = 0;
  KeptRows<float> dx_, dy_; ///< derivatives of the disparity
  KeptRows<uint8_t> lone_;
  std::array<KeptRows<uint8_t>, 4> near_; ///< weights of the pairs one pixel apart, not raised
};

} // namespace

void PairGuides::compute(const Guides& guides, const FluxConfig& config, const FilterKernels& kernels,
                         const Memory& memory) {
  begin_ = {reinterpret_cast<uint8_t*>(memory.first.row(0)), reinterpret_cast<uint8_t*>(memory.second.row(0)),
            reinterpret_cast<uint8_t*>(memory.third.row(0))};
  static_assert(sizeof(*memory.first.row(0)) == kPairOffsets.size());
  stride_ = memory.first.stride() * static_cast<ptrdiff_t>(kPairOffsets.size());
  width_ = static_cast<ptrdiff_t>(guides.size.width);
  // With arguments instead of a function it would keep copies of them, and so of all guides.
  tbb::enumerable_thread_specific<GuideRows> threads(
      [&] { return GuideRows(guides, {config.guide_depth, config.guide_slope, config.guide_bend}, kernels); });
  for_row_blocks(guides.size.height, [&](int first, int last) {
    GuideRows& rows = threads.local();
    rows.begin(first);
    for (int y = first; y < last; ++y)
      for (size_t i = 0; i < kSteps.size(); ++i) {
        uint8_t* const weights = begin_[i] + y * stride_;
        rows.write(y, i, {weights, weights + width_, weights + 2 * width_, weights + 3 * width_});
      }
  });
}

} // namespace packtrace
