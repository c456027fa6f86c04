#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "pbrt_import/base/output_file.h"
#include "runtime/commands/layer_previews.h"
#include "runtime/frame/rendered_image.h"
#include "runtime/image/exr.h"

namespace packtrace {

/// Names of the layers that a render can write.
const std::vector<std::string>& aov_names();

/// Returns the layers to write, without repetitions. Throws Error(kUsage) for unknown layers.
/// @param aovs layers from aov_names(), or "all"
/// @param otherwise what is written if `aovs` is empty
/// @param detail as in ImageOutputs
std::vector<std::string> chosen_layers(const std::vector<std::string>& aovs, const std::string& otherwise, bool detail);

/// Whether one of the layers needs LOD levels.
bool has_lod_layer(const std::vector<std::string>& layers);

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
  /// @param aovs layers from aov_names(), or "all"; empty: all for .exr and "ao" for .png
  /// @param detail whether camera rays use LOD levels; if so, "all" includes the LOD layers
  /// Throws Error(kUsage) for other extensions, for unknown layers, and if two outputs have the same name; otherwise
  /// throws like OutputFile.
  ImageOutputs(const std::vector<std::string>& files, const std::vector<std::string>& aovs, bool detail, bool force,
               const PreviewStyle& style);

  /// Writes all files. Throws Error(kIo).
  void write(const RenderedImage& image, const ExrAttributes& attributes);

  /// Whether a LOD layer was requested.
  bool has_lod_layers() const;

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
