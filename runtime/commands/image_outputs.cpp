#include "runtime/commands/image_outputs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "pbrt_import/scene/error.h"
#include "runtime/image/false_color.h"
#include "runtime/image/png.h"

namespace packtrace {
namespace {

constexpr std::array kAlways{"ao", "ao_raw", "depth", "normal", "instance", "albedo", "shaded"};
/// Only with levels of detail.
constexpr std::array kOfDetail{"lod", "lod-error"};

std::vector<std::string> chosen(const std::vector<std::string>& aovs, const std::string& otherwise, bool detail) {
  std::vector<std::string> names = aovs.empty() ? std::vector{otherwise} : aovs;
  if (std::find(names.begin(), names.end(), "all") != names.end()) {
    if (detail) return aov_names();
    return {kAlways.begin(), kAlways.end()};
  }
  for (const std::string& name : names) {
    if (std::find(aov_names().begin(), aov_names().end(), name) != aov_names().end()) continue;
    std::string known = "all";
    for (const std::string& aov : aov_names()) known += ", " + aov;
    throw Error(ErrorKind::kUsage, "--aov " + name + ": no such layer; there are " + known);
  }
  std::vector<std::string> unique;
  for (const std::string& name : names)
    if (std::find(unique.begin(), unique.end(), name) == unique.end()) unique.push_back(name);
  return unique;
}

std::span<const float> floats_of(const std::vector<Vec3>& vectors) {
  static_assert(sizeof(Vec3) == 3 * sizeof(float));
  return {vectors.empty() ? nullptr : &vectors[0].x, vectors.size() * 3};
}

Layer exr_layer(const RenderedImage& image, const std::string& aov) {
  const std::vector<std::string> xyz{"X", "Y", "Z"}, rgb{"R", "G", "B"};
  if (aov == "ao") return {aov, {""}, std::span<const float>(image.ao)};
  if (aov == "ao_raw") return {aov, {""}, std::span<const float>(image.ao_raw)};
  if (aov == "depth") return {aov, {""}, std::span<const float>(image.depth)};
  if (aov == "normal") return {aov, xyz, floats_of(image.normal), true};
  if (aov == "instance") return {aov, {""}, std::span<const uint32_t>(image.instance)};
  if (aov == "lod") return {aov, {""}, std::span<const uint32_t>(image.lod)};
  if (aov == "lod-error") return {aov, {""}, std::span<const float>(image.lod_error)};
  if (aov == "albedo") return {aov, rgb, floats_of(image.albedo), true};
  return {aov, rgb, floats_of(image.shaded), true};
}

/// Linear colour behind everything: a soft sky, lighter towards the bottom of the picture.
Vec3 sky(uint32_t y, uint32_t height) {
  const float t = (static_cast<float>(y) + 0.5f) / static_cast<float>(height);
  return glm::mix(Vec3(0.30f, 0.50f, 0.78f), Vec3(0.86f, 0.90f, 0.93f), std::pow(t, 0.8f));
}

Image over_sky(const RenderedImage& image, const std::vector<Vec3>& color) {
  Image result(image.size, 3);
  for (uint32_t y = 0; y < image.size.height; ++y) {
    for (uint32_t x = 0; x < image.size.width; ++x) {
      const size_t i = size_t{y} * image.size.width + x;
      const Vec3 mixed = glm::mix(sky(y, image.size.height), color[i], image.coverage[i]);
      std::copy_n(&mixed.x, 3, result.pixel(x, y).begin());
    }
  }
  return result;
}

void write_png_of(const std::filesystem::path& path, const RenderedImage& image, const std::string& aov) {
  const auto raw = [&](const Image& preview) { write_png(path, preview, PngTransfer::kRaw); };
  if (aov == "ao") return raw(ao_preview(image.size, image.ao, Vec3(1)));
  if (aov == "ao_raw") return raw(ao_preview(image.size, image.ao_raw, Vec3(1)));
  if (aov == "depth") return raw(depth_preview(image.size, image.depth));
  if (aov == "normal") return raw(normal_preview(image.size, image.normal));
  if (aov == "instance") return raw(id_preview(image.size, image.instance));
  if (aov == "lod") return raw(level_preview(image.size, image.lod, image.cluster, image.ao));
  if (aov == "lod-error") return raw(heat_map(image.size, image.lod_error, static_cast<float>(image.lod_error_px)));
  write_png(path, over_sky(image, aov == "albedo" ? image.albedo : image.shaded), PngTransfer::kSrgb);
}

} // namespace

const std::vector<std::string>& aov_names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names(kAlways.begin(), kAlways.end());
    names.insert(names.end(), kOfDetail.begin(), kOfDetail.end());
    return names;
  }();
  return kNames;
}

void ImageOutputs::add(const std::filesystem::path& target, bool force, bool exr, std::vector<std::string> aovs) {
  entries_.push_back({std::make_unique<OutputFile>(target, force), exr, std::move(aovs)});
}

ImageOutputs::ImageOutputs(const std::vector<std::string>& files, const std::vector<std::string>& aovs, bool detail,
                           bool force) {
  for (const std::string& name : files) {
    const std::filesystem::path path(name);
    if (path.extension() == ".exr") {
      add(path, force, true, chosen(aovs, "all", detail));
    } else if (path.extension() == ".png") {
      const std::vector<std::string> layers = chosen(aovs, "ao", detail);
      for (const std::string& aov : layers) {
        std::filesystem::path target = path;
        if (layers.size() > 1) target.replace_extension("." + aov + ".png");
        add(target, force, false, {aov});
      }
    } else {
      throw Error(ErrorKind::kUsage, name + ": images end in .exr or .png");
    }
  }
}

void ImageOutputs::write(const RenderedImage& image, const ExrAttributes& attributes) {
  for (const Entry& entry : entries_) {
    if (!entry.exr) {
      write_png_of(entry.file->path(), image, entry.aovs.front());
      continue;
    }
    std::vector<Layer> layers;
    for (const std::string& aov : entry.aovs) layers.push_back(exr_layer(image, aov));
    write_exr(entry.file->path(), image.size, layers, attributes);
  }
  for (const Entry& entry : entries_) entry.file->commit();
}

bool ImageOutputs::show_detail() const {
  return std::ranges::any_of(entries_, [](const Entry& entry) {
    return std::ranges::any_of(entry.aovs, [](const std::string& aov) {
      return std::find(kOfDetail.begin(), kOfDetail.end(), aov) != kOfDetail.end();
    });
  });
}

std::vector<std::string> ImageOutputs::targets() const {
  std::vector<std::string> names;
  for (const Entry& entry : entries_) names.push_back(entry.file->target().string());
  return names;
}

} // namespace packtrace
