#include "runtime/denoise/history_update.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <tbb/enumerable_thread_specific.h>

#include "runtime/denoise/flux_terms.h"
#include "runtime/denoise/kernels/trend.h"
#include "runtime/denoise/limit_frames.h"
#include "runtime/denoise/local_statistics.h"

namespace packtrace {
namespace {

/// Rows of samples with their borders, which stay 0.
class SampleRows {
public:
  SampleRows(ImageSize size, int rows)
      : stride_(static_cast<size_t>(size.width) + 2 * kPlaneBorder),
        data_(3 * static_cast<size_t>(rows) * stride_ + kRunPadding) {}
  SampleRow row(int y) {
    int32_t* first = data_.data() + 3 * static_cast<size_t>(y) * stride_ + kPlaneBorder;
    return {first, first + stride_, first + 2 * stride_};
  }

private:
  size_t stride_;
  std::vector<int32_t> data_;
};

/// What one thread needs to update strips of rows.
class HistoryStrip {
public:
  HistoryStrip(ImageSize size, const HistoryKernels& kernels, const FluxConfig& config)
      : kernels_(kernels), width_(static_cast<int>(size.width)), reprojection_(size, config, kernels),
        statistics_(size.width, config.window, kernels), samples_(size, 1), discarded_(2 * size_t{size.width}),
        discarded_moments_(2 * size_t{size.width}), past_moments_(2 * size_t{size.width}), limited_(size.width) {
    terms_ = correct_terms(config);
  }

  /// The samples of row y, without changing the history.
  void look(const HistoryInput& input, History& history, int y, const SampleRow& samples) {
    float* row = discarded_.data();
    uint16_t* moments = discarded_moments_.data();
    accumulate(input, history, y, {row, row + width_, moments, moments + width_}, samples);
  }

  /// Adds row y's samples to the history.
  void add(const HistoryInput& input, History& history, uint32_t* trends, int y) {
    accumulate(input, history, y, row_of(history, y), samples_.row(0));
    if (input.motion != nullptr)
      kernels_.keep_trends(width_, &input.motion->motion_px[static_cast<size_t>(y) * static_cast<size_t>(width_)].x,
                           history.samples.row(y), reprojection_.weights(), trends);
    update_trends(samples_.row(0).value, history.mean.row(y), history.samples.row(y), input.longest, trends);
  }

  /// Updates rows [first, last). @param neighbour returns the samples of rows of other strips
  template <typename Neighbour>
  void update(const HistoryInput& input, History& history, Plane<uint32_t>& trends, int first, int last,
              const Neighbour& neighbour) {
    const int radius = statistics_.radius(), height = static_cast<int>(input.guides.size.height);
    for (int y = first - radius; y < last + radius; ++y) {
      if (y < 0 || y >= height) {
        statistics_.add_nothing();
      } else if (y < first || y >= last) {
        statistics_.add(neighbour(y));
      } else {
        add(input, history, trends.row(y), y);
        statistics_.add(samples_.row(0));
      }
      if (y - radius >= first)
        kernels_.correct(width_, statistics_.finish(), terms_, row_of(history, y - radius), trends.row(y - radius));
    }
  }

private:
  static HistoryRow row_of(History& h, int y) {
    return {h.mean.row(y), h.samples.row(y), h.square.row(y), h.fast.row(y)};
  }

  /// Row y of the history, not resampled, with moments as floats.
  PastRow unmoved(History& h, int y) {
    float *square = past_moments_.data(), *fast = square + width_;
    kernels_.unpack(width_, h.square.row(y), square), kernels_.unpack(width_, h.fast.row(y), fast);
    return {h.mean.row(y), square, fast, h.samples.row(y)};
  }

  void accumulate(const HistoryInput& input, History& history, int y, const HistoryRow& out, const SampleRow& samples) {
    PastRow past = input.motion != nullptr ? reprojection_.at(*input.motion, y) : unmoved(history, y);
    if (!input.max_history.empty()) {
      limit_row(limited_.size(), &input.max_history[static_cast<size_t>(y) * limited_.size()], past.samples,
                limited_.data());
      past.samples = limited_.data();
    }
    kernels_.accumulate(width_, &input.ao[static_cast<size_t>(y) * static_cast<size_t>(width_)],
                        input.guides.disparity.row(y), {input.longest, terms_.fast_frames}, past, out, samples);
  }

  void update_trends(const int32_t* values, const float* mean, const float* samples, float longest,
                     uint32_t* trend) const {
    const auto next = [&](int x) { return kernels_.next_crossing(x, width_, values, samples, longest); };
    for (int x = next(0); x < width_; x = next(x + 1)) trend[x] = next_trend(trend[x], mean[x], samples[x]);
  }

  const HistoryKernels& kernels_;
  int width_;
  ReprojectionRows reprojection_;
  LocalStatisticsRows statistics_;
  CorrectTerms terms_;
  SampleRows samples_;
  std::vector<float> discarded_;
  std::vector<uint16_t> discarded_moments_;
  std::vector<float> past_moments_, limited_;
};

/// Rows of strip i begin here.
int begin_of_strip(int height, int strips, int i) { return static_cast<int>(int64_t{height} * i / strips); }

} // namespace

struct HistoryUpdate::State {
  FluxConfig config;
  const HistoryKernels& kernels;
  ImageSize size;
  tbb::enumerable_thread_specific<std::unique_ptr<HistoryStrip>> strips;
  std::vector<SampleRows> seams; ///< samples of the rows on both sides of the strips' ends, from before the update

  HistoryStrip& strip() {
    std::unique_ptr<HistoryStrip>& local = strips.local();
    if (!local) local = std::make_unique<HistoryStrip>(size, kernels, config);
    return *local;
  }
};

HistoryUpdate::HistoryUpdate(const FluxConfig& config, Isa isa)
    : state_(new State{config, history_kernels(isa), {}, {}, {}}) {}
HistoryUpdate::~HistoryUpdate() = default;

void HistoryUpdate::run(const HistoryInput& input, History& history, Plane<uint32_t>& trends) {
  State& s = *state_;
  constexpr int kRowsPerStrip = 96;
  const int height = static_cast<int>(input.guides.size.height), strips = std::max(1, height / kRowsPerStrip);
  const int radius = static_cast<int>(s.config.window / 2);
  if (s.size != input.guides.size) {
    s.strips.clear(), s.seams.clear(), s.size = input.guides.size;
    for (int i = 1; i < strips; ++i) s.seams.emplace_back(s.size, 2 * radius);
  }
  const auto begin_of = [&](int strip) { return begin_of_strip(height, strips, strip); };
  const auto seam_row = [&](int seam, int y) {
    return s.seams[static_cast<size_t>(seam - 1)].row(y - begin_of(seam) + radius);
  };
  const auto for_each = [](int first, int last, const auto& work) {
    tbb::parallel_for(
        tbb::blocked_range<int>(first, last, 1),
        [&](const tbb::blocked_range<int>& range) {
          for (int i = range.begin(); i != range.end(); ++i) work(i);
        },
        tbb::simple_partitioner());
  };
  if (!input.correct) {
    for_each(0, strips, [&](int i) {
      for (int y = begin_of(i); y < begin_of(i + 1); ++y) s.strip().add(input, history, trends.row(y), y);
    });
    return;
  }
  for_each(1, strips, [&](int i) {
    for (int y = begin_of(i) - radius; y < begin_of(i) + radius; ++y) s.strip().look(input, history, y, seam_row(i, y));
  });
  for_each(0, strips, [&](int i) {
    s.strip().update(input, history, trends, begin_of(i), begin_of(i + 1),
                     [&](int y) { return seam_row(y < begin_of(i) ? i : i + 1, y); });
  });
}

} // namespace packtrace
