#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "pbrt_import/base/output_file.h"
#include "runtime/frame/frame_config.h"
#include "runtime/frame/rendered_image.h"
#include "runtime/image/exr.h"
#include "runtime/view/layer_previews.h"
#include "runtime/view/layers.h"

namespace packtrace {

/// The attributes of .exr files of a render.
/// @param config with a positive AO radius
/// @param frames of the picture
ExrAttributes render_attributes(const FrameConfig& config, uint32_t frames);

/// Splits words such as "x.png,x.exr" at commas. A word is split only if every part ends in .png or .exr, so that file
/// names may contain commas.
std::vector<std::string> separate_image_files(const std::vector<std::string>& words);

/// The image files of one render. Construct it before the work starts, so that unwritable targets are reported at once.
/// No file appears under its final name before write() has written all of them.
class ImageOutputs {
public:
  /// @param files names ending in .exr (one file with all chosen layers) or .png (one file per layer: NAME.png for a
  ///   single layer, NAME.LAYER.png for several); case is ignored. A string may hold several names separated by commas.
  ///   "-" writes a PNG with a single layer to standard output, which must not be a terminal.
  /// @param aovs layers from aov_names(), or "all"; empty: chosen_exr_layers() for .exr and "ao" for .png
  /// @param available the layers that "all" means
  /// Throws Error(kUsage) for other extensions, for unknown layers, and if two outputs have the same name; otherwise
  /// throws like OutputFile.
  ImageOutputs(const std::vector<std::string>& files, const std::vector<std::string>& aovs, AvailableLayers available,
               bool force, const PreviewStyle& style);

  /// Writes all files. Throws Error(kIo).
  void write(const RenderedImage& image, const ExrAttributes& attributes);

  /// Names of all layers that are written.
  std::vector<std::string> layers() const;

  /// Whether an image goes to standard output, so that human-readable text must go elsewhere.
  bool to_stdout() const { return to_stdout_; }

  /// File names in the order of writing; "-" for standard output.
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
