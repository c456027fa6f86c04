#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "pbrt_import/base/output_file.h"
#include "runtime/commands/layer_previews.h"
#include "runtime/image/exr.h"
#include "runtime/render/renderer.h"

namespace packtrace {

/// The layers a render can write, in the order `--help` lists them.
const std::vector<std::string>& aov_names();

/// The image files of one render. Made before the work starts, so that a target that cannot be written is known at
/// once; nothing appears under its name before write() has written all of them.
class ImageOutputs {
public:
  /// @param files ending in .exr (one file of all chosen layers) or .png (one file a layer: NAME.png for a single
  ///   layer, NAME.LAYER.png for several), in any case; several may stand in one string, separated by commas. "-" is a
  ///   PNG of a single layer on standard output, which must not be a terminal
  /// @param aovs layers from aov_names(), or "all"; empty: all for .exr and "ao" for .png
  /// @param detail whether levels of detail are seen: "all" holds the layers about them
  /// Throws Error(kUsage) for other endings and layer names, and for two outputs to one file; otherwise like
  /// OutputFile.
  ImageOutputs(const std::vector<std::string>& files, const std::vector<std::string>& aovs, bool detail, bool force,
               const PreviewStyle& style);

  /// Throws Error(kIo).
  void write(const RenderedImage& image, const ExrAttributes& attributes);

  /// Whether a layer is about levels of detail.
  bool has_lod_layers() const;

  /// Standard output carries a picture: text for people does not belong there.
  bool to_stdout() const { return to_stdout_; }

  /// The files, in the order of writing; "-" for standard output.
  std::vector<std::string> targets() const;

private:
  struct Entry {
    std::unique_ptr<OutputFile> file; ///< null: standard output
    bool exr = false;
    std::vector<std::string> aovs;
  };
  void add(const std::filesystem::path& target, bool force, bool exr, std::vector<std::string> aovs);
  void add_standard_output(std::vector<std::string> aovs);

  std::vector<Entry> entries_;
  PreviewStyle style_;
  bool to_stdout_ = false;
};

} // namespace packtrace
