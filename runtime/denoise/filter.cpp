#include "runtime/denoise/filter.h"

#include <algorithm>
#include <vector>

#include <tbb/enumerable_thread_specific.h>

#include "runtime/denoise/fill.h"

namespace packtrace {
namespace {

/// VarianceTerms::young of independent samples. The ratio of stratified ones has a similar effect: variances of young
/// pixels are rather too large, so that they are filtered more.
constexpr float kIndependentYoung = 12.0f;

/// Some rows of an image, in turn; the others share one row of zeros. Columns [-kRowPadding, width + kRowPadding)
/// exist, and those outside the image are zero.
template <typename T>
class RowRing {
public:
  /// @param rows number of rows to keep, a power of two
  RowRing(int width, int rows)
      : mask_(rows - 1), stride_(static_cast<size_t>(width) + 2 * kRowPadding),
        data_(static_cast<size_t>(rows + 1) * stride_) {}

  T* row(int y) { return data_.data() + static_cast<size_t>(y & mask_) * stride_ + kRowPadding; }
  const T* zeros() const { return data_.data() + static_cast<size_t>(mask_ + 1) * stride_ + kRowPadding; }

private:
  int mask_;
  size_t stride_;
  std::vector<T> data_;
};

/// Rows of an image of AO with variances, computed in ascending order.
class RowSource {
public:
  RowSource(ImageSize size, int kept)
      : width_(static_cast<int>(size.width)), height_(static_cast<int>(size.height)), value_(width_, kept),
        variance_(width_, kept) {}
  virtual ~RowSource() = default;

  /// Starts anew: rows from `first` on will be required.
  virtual void begin(const FilterInput& input, int first) = 0;
  /// Computes all rows up to y.
  void require(int y) {
    for (; next_ <= std::min(y, height_ - 1); ++next_) produce(next_);
  }
  const float* value(int y) { return inside(y) ? value_.row(y) : value_.zeros(); }
  const float* variance(int y) { return inside(y) ? variance_.row(y) : variance_.zeros(); }

protected:
  virtual void produce(int y) = 0;
  bool inside(int y) const { return y >= 0 && y < height_; }

  int width_, height_;
  int next_ = 0;
  RowRing<float> value_, variance_;
};

/// The history with the variance of its means, and with values for pixels without one.
class HistoryRows final : public RowSource {
public:
  static constexpr int kRadius = 2;
  static constexpr size_t kMoments = 5;

  HistoryRows(ImageSize size, const FilterKernels& kernels, const FluxConfig& config)
      : RowSource(size, 8), kernels_(kernels), config_(config), estimate_(width_, 1),
        sums_(kMoments, RowRing<float>(width_, 8)), scratch_(kMoments, RowRing<float>(width_, 1)) {
    terms_ = {config.variance_prior,    0.75f, 0.45f, 0.55f, 0.02f, static_cast<float>(config.max_tspp_moving),
              config.variance_distrust, 0.0f,  false};
    if (!config.stratified)
      terms_.young = kIndependentYoung, terms_.still_factor = 1.0f, terms_.still_power = 0.0f,
      terms_.moving_base = 1.0f, terms_.moving_gain = 0.0f;
  }

  /// Rows [first, end) of the variance of the means go to `variance`.
  void write_variance(std::span<float> variance, int first, int end) {
    written_ = variance, first_written_ = first, end_written_ = end;
  }

  void begin(const FilterInput& input, int first) override {
    input_ = &input;
    terms_.moving = input.moving;
    next_ = std::max(first, 0);
    next_sum_ = next_ - kRadius;
  }

private:
  void produce(int y) override {
    for (; next_sum_ <= y + kRadius; ++next_sum_) sum(next_sum_);
    std::array<float*, kMoments> window;
    for (size_t i = 0; i < kMoments; ++i) {
      window[i] = scratch_[i].row(0);
      std::copy_n(sums_[i].row(y - kRadius), width_, window[i]);
      for (int r = 1 - kRadius; r <= kRadius; ++r) kernels_.add(width_, sums_[i].row(y + r), window[i]);
    }
    const History& h = input_->history;
    kernels_.variance(width_, h.mean.row(y), h.square.row(y), h.samples.row(y),
                      {window[0], window[1], window[2], window[3], window[4]}, terms_, estimate_.row(0),
                      variance_.row(y));
    std::copy_n(h.mean.row(y), width_, value_.row(y));
    fill(y);
    if (y >= first_written_ && y < end_written_)
      std::copy_n(estimate_.row(0), width_, &written_[static_cast<size_t>(y) * static_cast<size_t>(width_)]);
  }

  void fill(int y) {
    const float *disparity = input_->guides.disparity.row(y), *samples = input_->history.samples.row(y);
    float* value = value_.row(y);
    for (int x = 0; x < width_; ++x)
      if (disparity[x] > 0.0f && !(samples[x] > 0.0f)) value[x] = filled_value(*input_, kernels_, config_, x, y);
  }

  void sum(int y) {
    const History& h = input_->history;
    if (!inside(y)) {
      for (auto& ring : sums_) std::fill_n(ring.row(y), width_, 0.0f);
      return;
    }
    kernels_.moments(
        width_, h.mean.row(y), h.square.row(y), h.samples.row(y),
        {scratch_[0].row(0), scratch_[1].row(0), scratch_[2].row(0), scratch_[3].row(0), scratch_[4].row(0)});
    for (size_t i = 0; i < kMoments; ++i) kernels_.sum_along_row(width_, kRadius, scratch_[i].row(0), sums_[i].row(y));
  }

  const FilterKernels& kernels_;
  const FluxConfig& config_;
  VarianceTerms terms_;
  const FilterInput* input_ = nullptr;
  std::span<float> written_;
  int first_written_ = 0, end_written_ = 0;
  RowRing<float> estimate_;
  std::vector<RowRing<float>> sums_, scratch_;
  int next_sum_ = 0;
};

/// One pass of the filter.
class PassRowsSource final : public RowSource {
public:
  /// @param lone lone samples give way, in the first pass
  PassRowsSource(ImageSize size, RowSource& source, int step, bool lone, const FilterKernels& kernels,
                 const FluxConfig& config)
      : RowSource(size, 16), kernels_(kernels), config_(config), source_(source), step_(step), lone_(lone),
        scale_(width_, 16), column_(width_, 1), distance_(kPairOffsets.size(), RowRing<float>(width_, 4)),
        guide_(kPairOffsets.size(), RowRing<uint8_t>(width_, 4)),
        weights_(kPairOffsets.size(), RowRing<uint8_t>(width_, 16)) {}

  void begin(const FilterInput& input, int first) override {
    input_ = &input;
    next_ = std::max(first, 0);
    next_weights_ = std::max(next_ - 2 * step_, 0);
    next_distance_ = std::max(next_weights_ - 1, 0);
    first_weights_ = next_weights_;
    source_.begin(input, next_distance_);
  }

private:
  void produce(int y) override {
    for (; next_weights_ <= std::min(y + step_, height_ - 1); ++next_weights_) weigh(next_weights_);
    const auto scale = [&](int row) { return inside(row) ? scale_.row(row) : scale_.zeros(); };
    const PassRows rows{source_.value(y),
                        source_.value(y - step_),
                        source_.value(y + step_),
                        source_.variance(y),
                        source_.variance(y - step_),
                        source_.variance(y + step_),
                        scale(y),
                        scale(y - step_),
                        scale(y + step_),
                        pairs(y),
                        pairs(y - step_)};
    kernels_.exchange(width_, step_, rows, value_.row(y), variance_.row(y));
  }

  void weigh(int y) {
    source_.require(y + 1 + step_);
    for (; next_distance_ <= std::min(y + 1, height_ - 1); ++next_distance_) compare(next_distance_);
    for (size_t d = 0; d < kPairOffsets.size(); ++d) {
      const auto distance = [&](int row) { return inside(row) ? distance_[d].row(row) : distance_[d].zeros(); };
      kernels_.weigh(width_, {distance(y - 1), distance(y), distance(y + 1)}, guide_[d].row(y), config_.patch_limit,
                     column_.row(0), weights_[d].row(y));
    }
    kernels_.normalise(width_, step_, pairs(y), pairs(y - step_), lone_ ? input_->history.samples.row(y) : nullptr,
                       scale_.row(y));
  }

  void compare(int y) {
    for (size_t d = 0; d < kPairOffsets.size(); ++d) {
      const int dx = step_ * kPairOffsets[d][0], dy = step_ * kPairOffsets[d][1];
      kernels_.guide(width_, surface_at(*input_, 0, y), surface_at(*input_, dx, y + dy), guide_terms(config_, dx, dy),
                     guide_[d].row(y));
      kernels_.compare(width_, source_.value(y), source_.variance(y), source_.value(y + dy) + dx,
                       source_.variance(y + dy) + dx, guide_[d].row(y), config_.noise_tolerance, distance_[d].row(y));
    }
  }

  PairRow pairs(int y) {
    PairRow rows;
    for (size_t d = 0; d < rows.size(); ++d)
      rows[d] = y >= first_weights_ && inside(y) ? weights_[d].row(y) : weights_[d].zeros();
    return rows;
  }

  const FilterKernels& kernels_;
  const FluxConfig& config_;
  RowSource& source_;
  const int step_;
  const bool lone_;
  const FilterInput* input_ = nullptr;
  RowRing<float> scale_, column_;
  std::vector<RowRing<float>> distance_;
  std::vector<RowRing<uint8_t>> guide_, weights_;
  int next_weights_ = 0, next_distance_ = 0, first_weights_ = 0;
};

/// All passes, as one thread runs them.
class FilterChain {
public:
  FilterChain(ImageSize size, const FilterKernels& kernels, const FluxConfig& config)
      : history_(size, kernels, config) {
    RowSource* source = &history_;
    constexpr int kSteps[] = {1, 2, 4, 1};
    for (uint32_t i = 0; i < config.passes; ++i) {
      passes_.push_back(std::make_unique<PassRowsSource>(size, *source, kSteps[i], i == 0, kernels, config));
      source = passes_.back().get();
    }
    result_ = source;
  }

  void run(const FilterInput& input, const FilterOutput& output, int first, int last) {
    const size_t width = input.guides.size.width;
    result_->begin(input, first);
    history_.write_variance(output.variance, first, last);
    for (int y = first; y < last; ++y) {
      result_->require(y);
      const size_t begin = static_cast<size_t>(y) * width;
      const float* value = result_->value(y);
      const float *disparity = input.guides.disparity.row(y), *samples = input.history.samples.row(y);
      for (size_t x = 0; x < width; ++x) {
        output.ao[begin + x] = disparity[x] > 0.0f ? std::clamp(value[x], 0.0f, 1.0f) : kInvalidAo;
        output.tspp[begin + x] = samples[x];
      }
    }
  }

private:
  HistoryRows history_;
  std::vector<std::unique_ptr<PassRowsSource>> passes_;
  RowSource* result_;
};

} // namespace

SurfaceRow surface_at(const FilterInput& input, int x, int y) {
  const Guides& g = input.guides;
  const DepthDerivatives& d = input.derivatives;
  return {g.disparity.row(y) + x, d.x.row(y) + x,        d.y.row(y) + x,
          g.normal_x.row(y) + x,  g.normal_y.row(y) + x, g.normal_z.row(y) + x};
}

GuideTerms guide_terms(const FluxConfig& config, int dx, int dy) {
  return {config.guide_depth, config.guide_slope, static_cast<float>(dx), static_cast<float>(dy)};
}

struct AoFilter::State {
  FluxConfig config;
  const FilterKernels& kernels;
  ImageSize size;
  tbb::enumerable_thread_specific<std::unique_ptr<FilterChain>> chains;
};

AoFilter::AoFilter(const FluxConfig& config, Isa isa) : state_(new State{config, filter_kernels(isa), {}, {}}) {}
AoFilter::~AoFilter() = default;
AoFilter::AoFilter(AoFilter&&) noexcept = default;
AoFilter& AoFilter::operator=(AoFilter&&) noexcept = default;

void AoFilter::run(const FilterInput& input, const FilterOutput& output) {
  State& s = *state_;
  const ImageSize size = input.guides.size;
  if (s.size != size) s.chains.clear(), s.size = size;
  constexpr int kRowsPerStrip = 128;
  const int height = static_cast<int>(size.height), strips = std::max(1, (height + kRowsPerStrip / 2) / kRowsPerStrip);
  tbb::parallel_for(
      tbb::blocked_range<int>(0, strips, 1),
      [&](const tbb::blocked_range<int>& range) {
        std::unique_ptr<FilterChain>& chain = s.chains.local();
        if (!chain) chain = std::make_unique<FilterChain>(size, s.kernels, s.config);
        for (int i = range.begin(); i != range.end(); ++i)
          chain->run(input, output, height * i / strips, height * (i + 1) / strips);
      },
      tbb::simple_partitioner());
}

} // namespace packtrace
