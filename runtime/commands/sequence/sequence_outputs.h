#pragma once

#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pbrt_import/base/output_file.h"
#include "runtime/commands/render/image_outputs.h"
#include "runtime/commands/sequence/sequence_names.h"
#include "runtime/commands/sequence/sequence_options.h"

namespace packtrace {

/// Where the pictures of a sequence go: numbered .png and .exr files, .y4m files, and standard output. Construct it
/// before the work starts, so that wrong names are reported at once.
class SequenceOutputs {
public:
  /// @param files as in ImageOutputs, but .png and .exr names are NumberedNames, and names may end in .y4m
  /// @param aovs, available, style as in ImageOutputs; a .y4m file holds one layer
  /// Throws Error(kUsage) for names without a number, other extensions, unknown layers, two outputs to standard output,
  /// and with --resume for anything but numbered files; otherwise like OutputFile.
  SequenceOutputs(const std::vector<std::string>& files, const std::vector<std::string>& aovs,
                  AvailableLayers available, bool force, const PreviewStyle& style, const SequenceOptions& options);

  /// Throws Error(kUsage) if a name has too few digits for the number of pictures, Error(kIo) if a numbered file exists
  /// and neither `force` nor --resume was given.
  void check(uint64_t pictures) const;

  /// Writes a picture. Numbered files appear under their final names; .y4m files do so in commit().
  void write(uint64_t picture, double fps, const RenderedImage& image, const ExrAttributes& attributes);

  /// Completes the .y4m files.
  void commit();

  /// Names of all layers that are written.
  std::vector<std::string> layers() const;
  bool to_stdout() const { return to_stdout_; }
  /// Patterns of the numbered files and names of the others.
  std::vector<std::string> targets() const;
  /// Name of the file that keeps the state of an interrupted sequence; none without numbered files.
  std::optional<std::string> checkpoint_name() const;

private:
  struct CloseStream {
    void operator()(std::FILE* stream) const { std::fclose(stream); }
  };
  void add_video(const std::string& name, bool force);
  void write_video(const std::vector<std::byte>& bytes);
  std::vector<std::string> numbered(uint64_t picture) const;

  std::vector<NumberedName> names_;
  std::vector<std::unique_ptr<OutputFile>> video_files_;
  std::vector<std::unique_ptr<std::FILE, CloseStream>> video_streams_; ///< of video_files_
  std::vector<std::string> aovs_;
  std::string video_layer_;
  AvailableLayers available_;
  bool force_ = false, resume_ = false;
  bool to_stdout_ = false, png_stream_ = false, video_to_stdout_ = false;
  bool video_began_ = false;
  PreviewStyle style_;
};

} // namespace packtrace
