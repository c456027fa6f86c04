#include "tests/benchmarks/denoiser_scores.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/denoise/guides.h"
#include "runtime/frame/raw_mean.h"
#include "runtime/image/metrics.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

/// Compares the pixels that have a truth. A pixel without value there is open.
ImageScore compare(ImageSize size, const std::vector<float>& ao, const std::vector<float>& truth) {
  Image test(size, 1), reference(size, 1);
  std::vector<uint8_t> valid(size.pixels());
  ImageScore score;
  double count = 0;
  for (size_t i = 0; i < size.pixels(); ++i) {
    valid[i] = truth[i] >= 0.0f ? 1 : 0;
    if (valid[i] == 0) continue;
    test.data[i] = ao[i] >= 0.0f ? ao[i] : 1.0f, reference.data[i] = truth[i];
    score.bias += double{test.data[i]} - double{truth[i]}, count += 1.0;
  }
  const MetricOptions options{valid};
  score.psnr = psnr(test, reference, options).value, score.ssim = ssim(test, reference, options).value;
  score.flip = flip(test, reference, options).value, score.bias /= std::max(count, 1.0);
  return score;
}

/// A denoiser, or the mean of the samples without one.
class Candidate {
public:
  Candidate(const std::string& name, const DenoiserConfig& config) {
    if (const auto preset = preset_of(name, config)) denoiser_.emplace(*preset);
  }

  void add(const GBuffer& g, const AoFrame& ao, HistorySource source, bool moved) {
    if (denoiser_) {
      denoiser_->add_frame(g, ao, source);
    } else {
      if (moved) mean_.clear();
      mean_.add(ao);
      instances_ = g.instance;
    }
  }
  std::vector<float> result(ImageSize size) {
    return denoiser_ ? denoiser_->denoise().ao : mean_.result(size, instances_);
  }

private:
  std::optional<AoDenoiser> denoiser_;
  RawMean mean_;
  std::vector<uint32_t> instances_;
};

/// Frames in which something moves; 0 if nothing does.
uint32_t moving_frames(const DenoiserSequence& s) {
  return s.kind == SequenceKind::kOccluder ? s.occluded_frames() : (s.moves() ? static_cast<uint32_t>(s.ao.size()) : 0);
}

class Flicker {
public:
  explicit Flicker(const DenoiserSequence& sequence) : frames_(moving_frames(sequence)) {
    if (frames_ == 0) frames_ = static_cast<uint32_t>(sequence.ao.size());
    if (sequence.kind != SequenceKind::kOccluder) return;
    const std::vector<float>& first = sequence.truth.begin()->second;
    changes_.resize(first.size());
    for (const auto& [frame, truth] : sequence.truth)
      for (size_t i = 0; i < truth.size() && frame <= frames_; ++i)
        if (std::abs(truth[i] - first[i]) > kSameTruth) changes_[i] = 1;
  }

  void add(const GBuffer& g, const std::vector<float>& ao, uint32_t frame) {
    if (frame > frames_ / 2 && frame < frames_) compare(g, ao);
    keep(g, ao);
  }
  void keep(const GBuffer& g, const std::vector<float>& ao) {
    before_ = ao, before_z_ = g.view_z, before_instance_ = g.instance;
  }
  /// Adds the changes of AO since the frame that keep() got.
  void compare(const GBuffer& g, const std::vector<float>& ao) {
    for (uint32_t y = 0; y < g.size.height; ++y)
      for (uint32_t x = 0; x < g.size.width; ++x) compare(g, ao, x, y);
  }
  double result() const { return count_ > 0.0 ? sum_ / count_ : 0.0; }

private:
  static constexpr float kSameTruth = 0.005f, kSameDepth = 0.02f;

  void compare(const GBuffer& g, const std::vector<float>& ao, uint32_t x, uint32_t y) {
    const size_t i = size_t{y} * g.size.width + x;
    if (ao[i] < 0.0f || (!changes_.empty() && changes_[i] != 0)) return;
    const float from_x = static_cast<float>(x) - g.motion_px[i].x, from_y = static_cast<float>(y) - g.motion_px[i].y;
    if (!(from_x >= 0.0f && from_y >= 0.0f && from_x <= static_cast<float>(g.size.width - 1) &&
          from_y <= static_cast<float>(g.size.height - 1)))
      return;
    const float z = g.previous_z.empty() ? g.view_z[i] : g.previous_z[i];
    const auto x0 = static_cast<uint32_t>(from_x), y0 = static_cast<uint32_t>(from_y);
    const float fx = from_x - static_cast<float>(x0), fy = from_y - static_cast<float>(y0);
    float value = 0.0f;
    for (uint32_t corner = 0; corner < 4; ++corner) {
      const uint32_t dx = corner & 1, dy = corner >> 1;
      const float weight = (dx != 0 ? fx : 1.0f - fx) * (dy != 0 ? fy : 1.0f - fy);
      if (weight == 0.0f) continue;
      const size_t j = size_t{y0 + dy} * g.size.width + x0 + dx;
      if (before_[j] < 0.0f || before_instance_[j] != g.instance[i] || std::abs(before_z_[j] - z) > kSameDepth * z)
        return;
      value += weight * before_[j];
    }
    sum_ += std::abs(double{ao[i]} - double{value}), count_ += 1.0;
  }

  uint32_t frames_;
  std::vector<uint8_t> changes_;
  std::vector<float> before_, before_z_;
  std::vector<uint32_t> before_instance_;
  double sum_ = 0, count_ = 0;
};

/// Flicker of exact pictures: that of the truth of the first two frames; 0 if it is not known.
double flicker_of_truth(const DenoiserSequence& s) {
  if (s.kind == SequenceKind::kOccluder || !s.truth.contains(1) || !s.truth.contains(2)) return 0.0;
  Flicker flicker(s);
  flicker.keep(s.gbuffers[0], s.truth.at(1)), flicker.compare(s.gbuffers[1], s.truth.at(2));
  return flicker.result();
}

/// The ghost of an occluder that is gone.
class Ghost {
public:
  explicit Ghost(const DenoiserSequence& s)
      : before_(s.truth_after(s.occluded_frames())), after_(s.truth_after(static_cast<uint32_t>(s.ao.size()))),
        weight_(before_.size()) {
    const GBuffer &g = s.gbuffers[s.occluded_frames()], &seen = s.gbuffers[s.occluded_frames() - 1];
    for (size_t i = 0; i < weight_.size(); ++i)
      if (after_[i] >= 0.0f && before_[i] >= 0.0f && g.instance[i] == seen.instance[i] && g.view_z[i] == seen.view_z[i])
        weight_[i] = before_[i] - after_[i];
  }
  double left(const std::vector<float>& ao) const {
    double sum = 0, norm = 0;
    for (size_t i = 0; i < weight_.size(); ++i)
      sum += double{weight_[i]} * double{ao[i] - after_[i]}, norm += double{weight_[i]} * double{weight_[i]};
    return norm > 0.0 ? sum / norm : 0.0;
  }

private:
  const std::vector<float>&before_, &after_;
  std::vector<float> weight_; ///< 0 where the surface was not seen
};

} // namespace

std::optional<DenoiserConfig> preset_of(const std::string& name, DenoiserConfig config) {
  if (name == "off") return {};
  if (name != "ours" && name != "history" && name != "reference")
    throw Error(ErrorKind::kUsage, "--denoiser " + name + ": must be ours, history, reference or off");
  config.kind = name == "reference" ? DenoiserKind::kReference : DenoiserKind::kOurs;
  if (name == "history") config.ours.passes = 0;
  return config;
}

SequenceScore score(const DenoiserSequence& sequence, const std::string& name, const DenoiserConfig& config) {
  SequenceScore result{sequence.scene, sequence.motion, name, {}, {}};
  Candidate candidate(name, config);
  Flicker flicker(sequence);
  std::optional<Ghost> ghost;
  if (sequence.kind == SequenceKind::kOccluder) ghost.emplace(sequence);
  double add_s = 0, denoise_s = 0;
  play(sequence, [&](const GBuffer& g, const AoFrame& ao, uint32_t frame) {
    const bool moved = sequence.moves() && sequence.gbuffers[frame].size.pixels() > 0;
    const Stopwatch adding;
    candidate.add(g, ao, sequence.source, moved);
    add_s += adding.seconds();
    const Stopwatch denoising;
    const std::vector<float> image = candidate.result(g.size);
    denoise_s += denoising.seconds();
    flicker.add(g, image, frame);
    const uint32_t frames = frame + 1;
    if (std::ranges::count(kComparedFrames, frames) > 0)
      result.images[frames] = compare(g.size, image, sequence.truth_after(frames));
    if (ghost && frames > sequence.occluded_frames())
      if (const uint32_t since = frames - sequence.occluded_frames(); std::ranges::count(kGhostFrames, since) > 0)
        result.ghosts[since] = ghost->left(image);
  });
  const double to_ms = 1e3 / static_cast<double>(sequence.ao.size());
  result.flicker = flicker.result(), result.truth_flicker = flicker_of_truth(sequence);
  result.add_frame_ms = add_s * to_ms, result.denoise_ms = denoise_s * to_ms;
  return result;
}

std::string csv_of(const std::vector<SequenceScore>& scores) {
  std::string csv = "scene,motion,denoiser,quantity,frames,value\n";
  for (const SequenceScore& s : scores) {
    const auto line = [&](const char* quantity, uint32_t frames, double value) {
      csv += fmt::format("{},{},{},{},{},{:.6g}\n", s.scene, s.motion, s.denoiser, quantity, frames, value);
    };
    for (const auto& [frames, image] : s.images)
      line("psnr", frames, image.psnr), line("ssim", frames, image.ssim), line("flip", frames, image.flip),
          line("bias", frames, image.bias);
    for (const auto& [frames, left] : s.ghosts) line("ghost", frames, left);
    line("flicker", 0, s.flicker);
  }
  return csv;
}

std::string markdown_of(const std::vector<SequenceScore>& scores) {
  constexpr uint32_t kShown[] = {1, 8, 32, 64};
  std::string table = "| scene, motion | denoiser | PSNR, dB, after 1 / 8 / 32 / 64 | SSIM | FLIP | ghost after "
                      "4 / 8 / 16 / 32, % | flicker |\n|---|---|---|---|---|---|---|\n";
  for (const SequenceScore& s : scores) {
    std::string psnr, ssim, flip, ghosts;
    const auto append = [](std::string& list, const std::string& text) { list += (list.empty() ? "" : " / ") + text; };
    for (const uint32_t frames : kShown) {
      const auto image = s.images.find(frames);
      if (image == s.images.end()) continue;
      append(psnr, fmt::format("{:.1f}", image->second.psnr)), append(ssim, fmt::format("{:.3f}", image->second.ssim));
      append(flip, fmt::format("{:.4f}", image->second.flip));
    }
    for (const auto& [frames, left] : s.ghosts) append(ghosts, fmt::format("{:.1f}", 100.0 * left));
    table += fmt::format("| {}, {} | {} | {} | {} | {} | {} | {:.4f} |\n", s.scene, s.motion, s.denoiser, psnr, ssim,
                         flip, ghosts, s.flicker);
  }
  return table;
}

} // namespace packtrace
