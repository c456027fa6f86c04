#include "runtime/commands/image_outputs.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "pbrt_import/base/error.h"
#include "runtime/commands/binary_output.h"
#include "runtime/commands/option_checks.h"
#include "runtime/frame/view_layers.h"
#include "runtime/image/png.h"

namespace packtrace {
namespace {

constexpr std::array kBaseLayers{"ao", "ao_raw", "depth", "normal", "instance", "albedo", "shaded"};
/// Layers that need LOD levels.
constexpr std::array kLodLayers{"lod", "lod-error"};

bool contains(const auto& names, const std::string& name) { return std::ranges::find(names, name) != names.end(); }

/// The layers of the result itself.
std::vector<std::string> result_layers(AvailableLayers available) {
  std::vector<std::string> names(kBaseLayers.begin(), kBaseLayers.end());
  if (available.levels) names.insert(names.end(), kLodLayers.begin(), kLodLayers.end());
  return names;
}

std::span<const float> motion_floats(const std::vector<Vec2>& vectors) {
  static_assert(sizeof(Vec2) == 2 * sizeof(float));
  return {vectors.empty() ? nullptr : &vectors[0].x, vectors.size() * 2};
}

std::span<const float> floats_of(const std::vector<Vec3>& vectors) {
  static_assert(sizeof(Vec3) == 3 * sizeof(float));
  return {vectors.empty() ? nullptr : &vectors[0].x, vectors.size() * 3};
}

} // namespace

Layer exr_layer(const RenderedImage& image, const std::string& aov) {
  const std::vector<std::string> xyz{"X", "Y", "Z"}, rgb{"R", "G", "B"};
  if (aov == "ao") return {aov, {""}, std::span<const float>(image.ao)};
  if (aov == "ao_raw") return {aov, {""}, std::span<const float>(image.ao_raw)};
  if (aov == "depth") return {aov, {""}, std::span<const float>(image.depth)};
  if (aov == "normal") return {aov, xyz, floats_of(image.normal), true};
  if (aov == "instance") return {aov, {""}, std::span<const uint32_t>(image.instance)};
  if (aov == "lod") return {aov, {""}, std::span<const uint32_t>(image.lod)};
  if (aov == "lod-error") return {aov, {""}, std::span<const float>(image.lod_error)};
  if (aov == "motion") return {aov, {"X", "Y"}, motion_floats(image.motion)};
  if (const std::vector<float>* view = view_of(image, aov)) return {aov, {""}, std::span<const float>(*view)};
  if (aov == "albedo") return {aov, rgb, floats_of(image.albedo), true};
  return {aov, rgb, floats_of(image.shaded), true};
}

std::vector<std::string> chosen_layers(const std::vector<std::string>& aovs, AvailableLayers available) {
  if (aovs.empty()) return {"ao"};
  if (contains(aovs, "all")) {
    std::vector<std::string> names = result_layers(available);
    if (available.views) names.insert(names.end(), kTracedViews.begin(), kTracedViews.end());
    if (available.denoiser) names.insert(names.end(), kDenoiserViews.begin(), kDenoiserViews.end());
    return names;
  }
  std::vector<std::string> unique;
  for (const std::string& name : aovs) {
    if (!contains(aov_names(), name)) {
      std::string known = "all";
      for (const std::string& aov : aov_names()) known += ", " + aov;
      throw Error(ErrorKind::kUsage, "--aov " + name + ": no such layer; layers are " + known);
    }
    if (!contains(unique, name)) unique.push_back(name);
  }
  return unique;
}

std::vector<std::string> chosen_exr_layers(const std::vector<std::string>& aovs, AvailableLayers available) {
  return aovs.empty() ? result_layers(available) : chosen_layers(aovs, available);
}

bool has_denoiser_layer(const std::vector<std::string>& layers) {
  return std::ranges::any_of(layers, [](const std::string& layer) { return contains(kDenoiserViews, layer); });
}

bool has_view_layer(const std::vector<std::string>& layers) {
  return has_denoiser_layer(layers) ||
         std::ranges::any_of(layers, [](const std::string& layer) { return contains(kTracedViews, layer); });
}

bool has_lod_layer(const std::vector<std::string>& layers) {
  return std::ranges::any_of(layers, [](const std::string& layer) { return contains(kLodLayers, layer); });
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

const std::vector<std::string>& aov_names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names(kBaseLayers.begin(), kBaseLayers.end());
    names.insert(names.end(), kTracedViews.begin(), kTracedViews.end());
    names.insert(names.end(), kDenoiserViews.begin(), kDenoiserViews.end());
    names.insert(names.end(), kLodLayers.begin(), kLodLayers.end());
    return names;
  }();
  return kNames;
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
