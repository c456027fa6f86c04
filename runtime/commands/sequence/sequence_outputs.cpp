#include "runtime/commands/sequence/sequence_outputs.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/binary_output.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/image/y4m.h"

namespace packtrace {
namespace {

/// Frames per second as a fraction: the exact one for whole numbers and for multiples of 1/1001, else in thousandths.
std::pair<uint32_t, uint32_t> fraction_of(double fps) {
  for (const uint32_t denominator : {1u, 1001u}) {
    const double numerator = std::round(fps * denominator);
    if (std::abs(numerator / denominator - fps) < 1e-9 * fps) return {static_cast<uint32_t>(numerator), denominator};
  }
  return {std::max(1u, static_cast<uint32_t>(std::lround(fps * 1000.0))), 1000u};
}

} // namespace

SequenceOutputs::SequenceOutputs(const std::vector<std::string>& files, const std::vector<std::string>& aovs,
                                 AvailableLayers available, bool force, const PreviewStyle& style,
                                 const SequenceOptions& options)
    : aovs_(aovs), available_(available), force_(force), resume_(options.resume), style_(style) {
  chosen_layers(aovs, available); // reports unknown layers
  for (const std::string& name : separate_image_files(files)) {
    if (name == "-" || ending_of(name) == ".y4m") {
      if (resume_)
        throw Error(ErrorKind::kUsage,
                    fmt::format("{}: --resume needs numbered files; a stream cannot be continued", name));
      if (aovs.size() > 1 || (aovs.size() == 1 && aovs[0] == "all"))
        throw Error(ErrorKind::kUsage, fmt::format("{} holds one layer; choose it with --aov", name));
      video_layer_ = chosen_layers(aovs, available).front();
    }
    if (name == "-") {
      if (std::exchange(to_stdout_, true)) throw Error(ErrorKind::kUsage, "-o - was given twice");
      refuse_terminal("video");
      png_stream_ = options.stream == "png";
      video_to_stdout_ = !png_stream_;
    } else if (ending_of(name) == ".y4m") {
      add_video(name, force);
    } else if (ending_of(name) == ".png" || ending_of(name) == ".exr") {
      names_.emplace_back(name);
    } else {
      throw Error(ErrorKind::kUsage, name + ": names of sequences must end in .png, .exr or .y4m");
    }
  }
  if (options.stream && !to_stdout_) throw Error(ErrorKind::kUsage, "--stream requires -o -");
}

void SequenceOutputs::add_video(const std::string& name, bool force) {
  video_files_.push_back(std::make_unique<OutputFile>(name, force));
  video_streams_.emplace_back(std::fopen(video_files_.back()->path().c_str(), "wb"));
  if (!video_streams_.back())
    throw Error(ErrorKind::kIo, fmt::format("{}: cannot be written: {}", name, std::strerror(errno)));
}

std::vector<std::string> SequenceOutputs::numbered(uint64_t picture) const {
  std::vector<std::string> names;
  for (const NumberedName& name : names_) names.push_back(name.at(picture));
  return names;
}

void SequenceOutputs::check(uint64_t pictures) const {
  for (const NumberedName& name : names_)
    if (name.largest() && pictures - 1 > *name.largest())
      throw Error(ErrorKind::kUsage, fmt::format("{}: has room for the numbers 0 to {}, but there are {} pictures",
                                                 name.pattern(), *name.largest(), pictures));
  if (force_ || resume_) return;
  for (uint64_t picture = 0; picture < pictures; ++picture)
    for (const std::string& name : numbered(picture))
      if (std::error_code error; std::filesystem::exists(name, error))
        throw Error(ErrorKind::kIo, name + ": exists already; --force replaces it, --resume continues a sequence");
}

void SequenceOutputs::write_video(const std::vector<std::byte>& bytes) {
  for (size_t i = 0; i < video_streams_.size(); ++i)
    if (std::fwrite(bytes.data(), 1, bytes.size(), video_streams_[i].get()) != bytes.size())
      throw Error(ErrorKind::kIo,
                  fmt::format("{}: cannot be written: {}", video_files_[i]->target().string(), std::strerror(errno)));
  if (video_to_stdout_) write_standard_output(bytes);
}

void SequenceOutputs::write(uint64_t picture, double fps, const RenderedImage& image, const ExrAttributes& attributes) {
  std::vector<std::string> names = numbered(picture);
  if (png_stream_) names.push_back("-");
  if (!names.empty()) ImageOutputs(names, aovs_, available_, force_ || resume_, style_).write(image, attributes);
  if (video_streams_.empty() && !video_to_stdout_) return;
  PreviewStyle style = style_;
  style.legend = false; // its scale would change from picture to picture
  if (style.background && style.background->kind == Background::Kind::kTransparent) style.background.reset();
  const Image preview = layer_preview(image, video_layer_, style);
  if (!std::exchange(video_began_, true)) {
    const auto [numerator, denominator] = fraction_of(fps);
    write_video(y4m_header(preview.size, numerator, denominator));
  }
  write_video(y4m_frame(preview));
}

void SequenceOutputs::commit() {
  for (size_t i = 0; i < video_files_.size(); ++i) {
    if (std::fclose(video_streams_[i].release()) != 0)
      throw Error(ErrorKind::kIo, video_files_[i]->target().string() + ": cannot be written");
    video_files_[i]->commit();
  }
}

std::vector<std::string> SequenceOutputs::layers() const {
  const bool exr = std::ranges::any_of(names_, [](const NumberedName& n) { return ending_of(n.pattern()) == ".exr"; });
  return exr ? chosen_exr_layers(aovs_, available_) : chosen_layers(aovs_, available_);
}

std::vector<std::string> SequenceOutputs::targets() const {
  std::vector<std::string> all;
  for (const NumberedName& name : names_) all.push_back(name.pattern());
  for (const auto& file : video_files_) all.push_back(file->target().string());
  if (to_stdout_) all.push_back("-");
  return all;
}

std::optional<std::string> SequenceOutputs::checkpoint_name() const {
  if (names_.empty()) return std::nullopt;
  return std::string(names_.front().pattern()).append(".resume");
}

} // namespace packtrace
