#include "runtime/denoise/filter.h"

#include <algorithm>
#include <vector>

#include <tbb/cache_aligned_allocator.h>
#include <tbb/enumerable_thread_specific.h>

#include "runtime/denoise/fill.h"
#include "runtime/denoise/flux_terms.h"

namespace packtrace {
namespace {

/// Part of the rows of an image that is filtered by itself, so that what belongs to it stays in the cache.
struct Tile {
  int x, width; ///< columns, with a margin where other tiles adjoin
  int height;   ///< of the image
};

/// Some rows of a tile, in turn, and one for what is outside the image. Columns [-kRowPadding, width + kRowPadding)
/// exist; those outside the tile keep the value of the outside.
template <typename T>
class RowRing {
public:
  /// @param rows number of rows to keep, a power of two
  RowRing(int width, int rows, T outside = T{})
      : mask_(rows - 1), stride_(stride_of(static_cast<size_t>(width) + 2 * kRowPadding)),
        data_(static_cast<size_t>(rows + 1) * stride_, outside) {}

  T* row(int y) { return data_.data() + static_cast<size_t>(y & mask_) * stride_ + kRowPadding; }
  const T* outside() const { return data_.data() + static_cast<size_t>(mask_ + 1) * stride_ + kRowPadding; }

private:
  /// An odd number of cache lines, so that the same pixels of many rows do not compete for the same places of a cache.
  static size_t stride_of(size_t entries) {
    constexpr size_t kLine = 64 / sizeof(T);
    return ((entries + kLine - 1) / kLine | 1) * kLine;
  }

  int mask_;
  size_t stride_;
  std::vector<T, tbb::cache_aligned_allocator<T>> data_;
};

/// Rows of a tile of AO with precisions, computed in ascending order.
class RowSource {
public:
  /// @param kept number of rows that can be read at the same time, a power of two
  RowSource(const Tile& tile, int kept)
      : x_(tile.x), width_(tile.width), height_(tile.height), value_(width_, kept), precision_(width_, kept) {}
  virtual ~RowSource() = default;

  /// Starts anew: rows from `first` on will be required.
  virtual void begin(const FilterInput& input, int first) = 0;
  /// Computes all rows up to y.
  void require(int y) {
    for (; next_ <= std::min(y, height_ - 1); ++next_) produce(next_);
  }
  const int16_t* value(int y) { return inside(y) ? value_.row(y) : value_.outside(); }
  const uint16_t* precision(int y) { return inside(y) ? precision_.row(y) : precision_.outside(); }

protected:
  virtual void produce(int y) = 0;
  bool inside(int y) const { return y >= 0 && y < height_; }

  int x_, width_, height_;
  int next_ = 0;
  RowRing<int16_t> value_;
  RowRing<uint16_t> precision_;
};

/// The history with the variance of its means, and with values for pixels without one.
class HistoryRows final : public RowSource {
public:
  static constexpr int kRadius = kMomentWindow / 2;
  static constexpr size_t kMoments = 5;

  HistoryRows(const Tile& tile, int kept, const FilterKernels& kernels, const FluxConfig& config)
      : RowSource(tile, kept), kernels_(kernels), config_(config), lone_(width_, kept), estimate_(width_, 1),
        sums_(kMoments, RowRing<float>(width_, 8)), scratch_(kMoments, RowRing<float>(width_, 1)) {}

  /// Pixels [begin, end) of the tile's rows [first, last) write the estimated variance of their means to `output`, and,
  /// if they have no sample, their AO.
  void write(const FilterOutput& output, int begin, int end, int first, int last) {
    output_ = &output, begin_written_ = begin, end_written_ = end, first_written_ = first, last_written_ = last;
  }

  void begin(const FilterInput& input, int first) override {
    input_ = &input;
    terms_ = variance_terms(config_, input.moving, input.stratified, input.samples);
    next_ = std::max(first, 0);
    next_sum_ = next_ - kRadius;
  }

  /// FirstRow::lone of a row inside the tile.
  const uint16_t* lone(int y) { return lone_.row(y); }

private:
  void produce(int y) override {
    for (; next_sum_ <= y + kRadius; ++next_sum_) sum(next_sum_);
    MomentWindow window;
    for (int r = -kRadius; r <= kRadius; ++r) window[static_cast<size_t>(r + kRadius)] = moments(sums_, y + r);
    const History& h = input_->history;
    kernels_.variance(
        width_, {h.mean.row(y) + x_, h.samples.row(y) + x_, input_->guides.disparity.row(y) + x_, h.square.row(y) + x_},
        window, terms_, estimate_.row(0), {value_.row(y), precision_.row(y), lone_.row(y)});
    fill(y);
    if (y >= first_written_ && y < last_written_ && !output_->variance.empty())
      std::copy(estimate_.row(0) + begin_written_, estimate_.row(0) + end_written_,
                &output_->variance[output_index(begin_written_, y)]);
  }

  size_t output_index(int x, int y) const {
    return static_cast<size_t>(y) * input_->guides.size.width + static_cast<size_t>(x_ + x);
  }

  void fill(int y) {
    const float *disparity = input_->guides.disparity.row(y) + x_, *samples = input_->history.samples.row(y) + x_;
    if (!kernels_.any_to_fill(width_, disparity, samples)) return;
    int16_t* value = value_.row(y);
    const bool written = y >= first_written_ && y < last_written_;
    for (int x = 0; x < width_; ++x) {
      if (!(disparity[x] > 0.0f) || samples[x] > 0.0f) continue;
      const float filled = filled_value(*input_, x_ + x, y);
      value[x] = in_ao_units(filled);
      if (written && x >= begin_written_ && x < end_written_) output_->ao[output_index(x, y)] = filled;
    }
  }

  static MomentRows moments(std::vector<RowRing<float>>& rings, int y) {
    return {rings[0].row(y), rings[1].row(y), rings[2].row(y), rings[3].row(y), rings[4].row(y)};
  }

  void sum(int y) {
    const History& h = input_->history;
    if (!inside(y)) {
      for (auto& ring : sums_) std::fill_n(ring.row(y), width_, 0.0f);
      return;
    }
    kernels_.moments(width_, h.mean.row(y) + x_, h.square.row(y) + x_, h.samples.row(y) + x_,
                     input_->trends.row(y) + x_, moments(scratch_, 0));
    for (size_t i = 0; i < kMoments; ++i) kernels_.sum_along_row(width_, scratch_[i].row(0), sums_[i].row(y));
  }

  const FilterKernels& kernels_;
  const FluxConfig& config_;
  VarianceTerms terms_;
  const FilterInput* input_ = nullptr;
  const FilterOutput* output_ = nullptr;
  int begin_written_ = 0, end_written_ = 0, first_written_ = 0, last_written_ = 0;
  RowRing<uint16_t> lone_;
  RowRing<float> estimate_;
  std::vector<RowRing<float>> sums_, scratch_;
  int next_sum_ = 0;
};

/// One pass of the filter.
class PassRowsSource final : public RowSource {
public:
  /// @param step index of PairGuides::kSteps
  /// @param first of the first pass, in which lone samples give way: the source; else null
  /// @param last whether this is the last pass, whose precisions are never read
  PassRowsSource(const Tile& tile, int kept, RowSource& source, size_t step, HistoryRows* first, bool last,
                 const FilterKernels& kernels, const FluxConfig& config)
      : RowSource(tile, kept), kernels_(kernels),
        exchange_(first != nullptr ? last ? kernels.exchange_only : kernels.exchange_first
                  : last           ? kernels.exchange_last
                                   : kernels.exchange),
        terms_(patch_terms(config)), source_(source), first_(first), step_index_(step), step_(PairGuides::kSteps[step]),
        scale_(width_, 4 * step_), columns_(kPairOffsets.size(), RowRing<uint16_t>(width_, 1)),
        distance_(kPairOffsets.size(), RowRing<uint16_t>(width_, 4, terms_.no_distance)),
        weights_(kPairOffsets.size(), RowRing<uint16_t>(width_, 4 * step_)) {}

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
    const auto scale = [&](int row) { return inside(row) ? scale_.row(row) : scale_.outside(); };
    const PassRows rows{source_.value(y), source_.value(y - step_), source_.value(y + step_), source_.precision(y),
                        scale(y),         scale(y - step_),         scale(y + step_),         pairs(y),
                        pairs(y - step_)};
    exchange_(width_, step_, rows, value_.row(y), precision_.row(y));
  }

  void weigh(int y) {
    source_.require(y + 1 + step_);
    for (; next_distance_ <= std::min(y + 1, height_ - 1); ++next_distance_) compare(next_distance_);
    const PairRow guides = input_->pair_guides.row(step_index_, x_, y);
    const auto distance = [&](size_t d, int row) {
      return inside(row) ? distance_[d].row(row) : distance_[d].outside();
    };
    std::array<DistanceRows, 4> distances;
    std::array<uint16_t*, 4> columns, weights;
    for (size_t d = 0; d < distances.size(); ++d)
      distances[d] = {distance(d, y - 1), distance(d, y), distance(d, y + 1)}, columns[d] = columns_[d].row(0),
      weights[d] = weights_[d].row(y);
    kernels_.weigh(width_, distances, guides, input_->pair_guides.stride(), terms_, columns, weights);
    if (first_ != nullptr)
      kernels_.normalise_first(width_, step_, pairs(y), pairs(y - step_), first_->lone(y), scale_.row(y));
    else
      kernels_.normalise(width_, step_, pairs(y), pairs(y - step_), scale_.row(y));
  }

  void compare(int y) {
    kernels_.compare(width_, step_, {source_.value(y), source_.precision(y)},
                     {source_.value(y + step_), source_.precision(y + step_)}, terms_.no_distance,
                     {distance_[0].row(y), distance_[1].row(y), distance_[2].row(y), distance_[3].row(y)});
  }

  WeightRow pairs(int y) {
    WeightRow rows;
    for (size_t d = 0; d < rows.size(); ++d)
      rows[d] = y >= first_weights_ && inside(y) ? weights_[d].row(y) : weights_[d].outside();
    return rows;
  }

  const FilterKernels& kernels_;
  FilterKernels::Exchange* const exchange_;
  const PatchTerms terms_;
  RowSource& source_;
  HistoryRows* const first_;
  const size_t step_index_;
  const int step_;
  const FilterInput* input_ = nullptr;
  RowRing<uint16_t> scale_;
  std::vector<RowRing<uint16_t>> columns_, distance_, weights_;
  int next_weights_ = 0, next_distance_ = 0, first_weights_ = 0;
};

/// The passes, as indices of PairGuides::kSteps.
constexpr size_t kPasses[] = {0, 1, 2, 0};

/// Rows that a pass reads at the same time, from one step above to two steps and a row below; as a power of two.
constexpr int kept_for(size_t step) { return PairGuides::kSteps[step] == 4 ? 16 : 8; }

/// All passes over one tile, as one thread runs them.
class FilterChain {
public:
  FilterChain(const Tile& tile, const FilterKernels& kernels, const FluxConfig& config)
      : tile_(tile), kernels_(kernels), history_(tile, kept_for(kPasses[0]), kernels, config) {
    RowSource* source = &history_;
    for (uint32_t i = 0; i < config.passes; ++i) {
      const int kept = i + 1 < config.passes ? kept_for(kPasses[i + 1]) : 1;
      passes_.push_back(std::make_unique<PassRowsSource>(tile, kept, *source, kPasses[i], i == 0 ? &history_ : nullptr,
                                                         i + 1 == config.passes, kernels, config));
      source = passes_.back().get();
    }
    result_ = source;
  }

  /// Filters pixels [begin, end) of rows [first, last) of the image.
  void run(const FilterInput& input, const FilterOutput& output, int begin, int end, int first, int last) {
    result_->begin(input, first);
    history_.write(output, begin - tile_.x, end - tile_.x, first, last);
    for (int y = first; y < last; ++y) {
      result_->require(y);
      const size_t at = static_cast<size_t>(y) * input.guides.size.width + static_cast<size_t>(begin);
      kernels_.finish(end - begin, result_->value(y) + (begin - tile_.x), input.history.mean.row(y) + begin,
                      input.guides.disparity.row(y) + begin, input.history.samples.row(y) + begin, &output.ao[at],
                      &output.tspp[at]);
    }
  }

private:
  Tile tile_;
  const FilterKernels& kernels_;
  HistoryRows history_;
  std::vector<std::unique_ptr<PassRowsSource>> passes_;
  RowSource* result_;
};

/// How an image is divided into tiles, whatever the number of threads.
struct Tiling {
  explicit Tiling(ImageSize size) : width(static_cast<int>(size.width)), height(static_cast<int>(size.height)) {
    constexpr int kColumns = 1000, kRows = 256; // per tile, about
    columns = std::max(1, (width + kColumns / 2) / kColumns);
    rows = std::max(1, (height + kRows / 2) / kRows);
  }
  int begin_x(int column) const { return static_cast<int>(int64_t{width} * column / columns); }
  int begin_y(int row) const { return static_cast<int>(int64_t{height} * row / rows); }
  Tile tile(int column) const {
    // Farther than the passes reach: 2 steps and a pixel each, and 2 pixels for the variance.
    constexpr int kMargin = 32;
    const int begin = std::max(begin_x(column) - kMargin, 0);
    return {begin, std::min(begin_x(column + 1) + kMargin, width) - begin, height};
  }

  int width, height, columns, rows;
};

} // namespace

struct AoFilter::State {
  FluxConfig config;
  const FilterKernels& kernels;
  ImageSize size;
  tbb::enumerable_thread_specific<std::vector<std::unique_ptr<FilterChain>>> chains; ///< one per column of tiles
};

AoFilter::AoFilter(const FluxConfig& config, Isa isa) : state_(new State{config, filter_kernels(isa), {}, {}}) {}
AoFilter::~AoFilter() = default;
AoFilter::AoFilter(AoFilter&&) noexcept = default;
AoFilter& AoFilter::operator=(AoFilter&&) noexcept = default;

void AoFilter::run(const FilterInput& input, const FilterOutput& output) {
  State& s = *state_;
  const ImageSize size = input.guides.size;
  if (s.size != size) s.chains.clear(), s.size = size;
  const Tiling tiling(size);
  tbb::parallel_for(
      tbb::blocked_range<int>(0, tiling.columns * tiling.rows, 1),
      [&](const tbb::blocked_range<int>& range) {
        auto& chains = s.chains.local();
        chains.resize(static_cast<size_t>(tiling.columns));
        for (int i = range.begin(); i != range.end(); ++i) {
          const int column = i % tiling.columns, row = i / tiling.columns;
          std::unique_ptr<FilterChain>& chain = chains[static_cast<size_t>(column)];
          if (!chain) chain = std::make_unique<FilterChain>(tiling.tile(column), s.kernels, s.config);
          chain->run(input, output, tiling.begin_x(column), tiling.begin_x(column + 1), tiling.begin_y(row),
                     tiling.begin_y(row + 1));
        }
      },
      tbb::simple_partitioner());
}

} // namespace packtrace
