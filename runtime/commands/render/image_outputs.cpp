#include "runtime/commands/render/image_outputs.h"

#include <algorithm>
#include <utility>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/binary_output.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/image/png.h"
#include "runtime/layered/layered_picture.h"

namespace packtrace {

ExrAttributes render_attributes(const FrameConfig& config, uint32_t frames) {
  return {{"comments", std::string("packtrace render")},
          {"aoRadius", static_cast<double>(config.ao.radius)},
          {"aoSpp", static_cast<int>(config.ao.spp)},
          {"frames", static_cast<int>(frames)},
          {kDenoisedAttribute, config.denoise ? 1 : 0}};
}

std::vector<std::string> separate_image_files(const std::vector<std::string>& words) {
  std::vector<std::string> files;
  for (const std::string& word : words) {
    std::vector<std::string> parts;
    for (size_t start = 0; start <= word.size();) {
      const size_t comma = std::min(word.find(',', start), word.size());
      parts.push_back(word.substr(start, comma - start));
      start = comma + 1;
    }
    const bool all_images = std::ranges::all_of(
        parts, [](const std::string& part) { return ending_of(part) == ".png" || ending_of(part) == ".exr"; });
    if (all_images)
      files.insert(files.end(), parts.begin(), parts.end());
    else
      files.push_back(word);
  }
  return files;
}

void ImageOutputs::add(const std::filesystem::path& target, bool force, bool exr, std::vector<std::string> aovs) {
  entries_.push_back({target == "-" ? nullptr : std::make_unique<OutputFile>(target, force), exr, std::move(aovs)});
}

ImageOutputs::ImageOutputs(const std::vector<std::string>& files, const std::vector<std::string>& aovs,
                           AvailableLayers available, bool force, const PreviewStyle& style)
    : style_(style) {
  for (const std::string& name : separate_image_files(files)) {
    const std::filesystem::path path(name);
    if (name == "-") {
      add_standard_output(chosen_layers(aovs, available));
    } else if (ending_of(path) == ".exr") {
      add(path, force, true, chosen_exr_layers(aovs, available));
    } else if (ending_of(path) == ".png") {
      const std::vector<std::string> layers = chosen_layers(aovs, available);
      for (const std::string& aov : layers) {
        std::filesystem::path target = path;
        if (layers.size() > 1) target.replace_extension("." + aov + path.extension().string());
        add(target, force, false, {aov});
      }
    } else {
      throw Error(ErrorKind::kUsage, name + ": image file names must end in .png or .exr");
    }
  }
}

void ImageOutputs::add_standard_output(std::vector<std::string> aovs) {
  if (std::exchange(to_stdout_, true)) throw Error(ErrorKind::kUsage, "-o - was given twice");
  if (aovs.size() > 1)
    throw Error(ErrorKind::kUsage, "-o - writes a single PNG to standard output, so --aov can select only one layer");
  refuse_terminal("a PNG");
  add("-", false, false, std::move(aovs));
}

void ImageOutputs::write(const RenderedImage& image, const ExrAttributes& attributes) {
  for (const Entry& entry : entries_) {
    if (!entry.exr) {
      const std::vector<std::byte> png =
          encode_png(layer_preview(image, entry.aovs.front(), style_), PngTransfer::kRaw);
      if (entry.file)
        entry.file->write(png);
      else
        write_standard_output(png);
      continue;
    }
    std::vector<Layer> layers;
    for (const std::string& aov : entry.aovs) layers.push_back(exr_layer(image, aov));
    entry.file->write(encode_exr(image.size, layers, attributes));
  }
  for (const Entry& entry : entries_)
    if (entry.file) entry.file->commit();
}

std::vector<std::string> ImageOutputs::layers() const {
  std::vector<std::string> names;
  for (const Entry& entry : entries_) names.insert(names.end(), entry.aovs.begin(), entry.aovs.end());
  return names;
}

std::vector<std::string> ImageOutputs::targets() const {
  std::vector<std::string> names;
  for (const Entry& entry : entries_) names.push_back(entry.file ? entry.file->target().string() : "-");
  return names;
}

} // namespace packtrace
