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

/// Which layers an image has besides the usual ones.
struct AvailableLayers {
  bool levels = false;   ///< camera rays use LOD levels
  bool denoiser = false; ///< it is denoised, by a frame loop
  bool views = true;     ///< it is rendered, not read from a file
};

/// Names of the layers that a render can write.
const std::vector<std::string>& aov_names();

/// Returns the layers to write, without repetitions. Throws Error(kUsage) for unknown layers.
/// @param aovs layers from aov_names(), or "all"; empty: "ao"
std::vector<std::string> chosen_layers(const std::vector<std::string>& aovs, AvailableLayers available);

/// Same for an .exr file: without `aovs` the layers of the result, without views of intermediate ones.
std::vector<std::string> chosen_exr_layers(const std::vector<std::string>& aovs, AvailableLayers available);

/// Whether one of the layers is a view of intermediate results (runtime/frame/view_layers.h), and whether one needs the
/// denoiser.
bool has_view_layer(const std::vector<std::string>& layers);
bool has_denoiser_layer(const std::vector<std::string>& layers);

/// A layer of an .exr file, which refers to the image.
/// @param aov one of aov_names()
Layer exr_layer(const RenderedImage& image, const std::string& aov);

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
