#include "runtime/commands/export/image_export.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "compress/exchange/shader/image_shader.h"
#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/with_file.h"
#include "pbrt_import/files/image_file.h"
#include "pbrt_import/text/input_file.h"
#include "runtime/commands/cli/loaded_scene.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/cli/whole_number.h"
#include "runtime/commands/reports/file_report.h"

namespace packtrace {
namespace {

/// The texels of an image and their memory.
struct SourceImage {
  AlbedoTexture texels;
  std::string texture; ///< name of the texture; empty for an image file
  MemoryReservation memory;
  std::vector<std::string> warnings;
  uint64_t transparent = 0; ///< texels whose alpha is below 1
};

std::string texture_name(const BakedFile& file, uint32_t texture) {
  return std::string(file.text(file.sections().textures[texture].name));
}

/// Number of the texture that the options name.
uint32_t find_texture(const BakedFile& file, const std::string& input, const std::string& wanted) {
  const auto count = static_cast<uint32_t>(file.sections().textures.size());
  if (count == 0)
    throw FileError(ErrorKind::kUsage, input, "it has no textures; bake the scene with --for shading to keep them");
  std::vector<uint32_t> named;
  for (uint32_t t = 0; t < count; ++t)
    if (texture_name(file, t) == wanted) named.push_back(t);
  if (named.size() > 1)
    throw FileError(ErrorKind::kUsage, input,
                    fmt::format("{} textures are named {}; choose one by its number, such as --texture {}",
                                named.size(), wanted, named.front()));
  if (!named.empty()) return named.front();
  if (const auto number = whole_number(wanted); number && *number < count) return *number;
  std::string names;
  for (uint32_t t = 0; t < std::min(count, 8u); ++t)
    names += fmt::format("{}{} ({})", t > 0 ? ", " : "", t, texture_name(file, t));
  throw FileError(ErrorKind::kUsage, input,
                  fmt::format("it has no texture {}; it has {}{}", wanted, names, count > 8 ? ", ..." : ""));
}

SourceImage read_texture(const std::string& input, const std::string& wanted, const MemoryBudget& budget) {
  SourceImage image;
  image.memory = reserve_decoded(input, budget);
  const BakedFile file = BakedFile::open(input);
  const uint32_t number = find_texture(file, input, wanted);
  const TextureView view = file.texture(number);
  MemoryReservation texels(budget);
  with_file(input, [&] { texels.resize(uint64_t{3} * view.width * view.height, "the texture"); });
  image.texture = texture_name(file, number);
  image.texels.width = view.width, image.texels.height = view.height;
  image.texels.rgb.reserve(size_t{3} * view.width * view.height);
  for (uint32_t y = 0; y < view.height; ++y)
    for (uint32_t x = 0; x < view.width; ++x) {
      const Rgb8 color = view.texel(x, y);
      image.texels.rgb.insert(image.texels.rgb.end(), color.begin(), color.end());
    }
  image.memory = std::move(texels); // the file is closed
  return image;
}

SourceImage read_image_file(const std::string& input, const MemoryBudget& budget) {
  SourceImage image;
  image.memory = MemoryReservation(budget);
  MemoryReservation content(budget);
  ImageSummary summary;
  with_file(input, [&] {
    const std::vector<std::byte> bytes = read_whole_file(input, ~uint64_t{0}, &content);
    try {
      summary = read_image(bytes, true, {.colours = true, .alpha = true}, image.memory);
    } catch (const MemoryError&) {
      throw;
    } catch (const Error& error) {
      throw FileError(error.kind(), input, std::string(error.what()) + "; shaders are made of .ptk files and images");
    }
  });
  if (summary.rgb.empty())
    throw FileError(
        ErrorKind::kLimitExceeded, input,
        fmt::format("{} x {} texels are more than the limit of {}", summary.width, summary.height, kMaxTextureTexels));
  image.texels.width = summary.width, image.texels.height = summary.height;
  image.texels.rgb = std::move(summary.rgb);
  image.warnings = std::move(summary.problems);
  image.transparent = summary.transparent;
  if (image.transparent > 0)
    image.warnings.push_back(fmt::format(grouped(),
                                         "alpha is ignored: {:L} of {:L} texels are not opaque, and the "
                                         "shader shows their colours as stored",
                                         image.transparent, uint64_t{summary.width} * summary.height));
  return image;
}

/// Throws Error(kLimitExceeded) with the largest size of the same shape that fits.
void check_elements(const std::string& input, const AlbedoTexture& source, const std::array<uint32_t, 2>& size,
                    TexelFormat format, uint32_t limit) {
  const uint64_t elements = shader_image_elements(format, size[0], size[1]);
  if (elements <= limit) return;
  const uint32_t largest = largest_image_side(format, source.width, source.height, limit);
  throw FileError(ErrorKind::kLimitExceeded, input,
                  fmt::format("{} x {} texels take {} array elements, of {} (--max-elements); {}", size[0], size[1],
                              elements, limit,
                              largest > 0 ? fmt::format("the largest that fits is --image-size {}", largest)
                                          : std::string("not even one texel fits")));
}

TexelFormat format_of(const ShaderOptions& options) {
  if (!options.image_format) return TexelFormat::kR2G4B2;
  const auto found = std::ranges::find(kTexelFormatNames, *options.image_format);
  return static_cast<TexelFormat>(found - kTexelFormatNames.begin());
}

} // namespace

void add_image_options(CLI::App& verb, ShaderOptions& options, const std::string& group) {
  verb.add_option("--texture", options.texture,
                  "Make a shader of this texture of the .ptk file: its name or number, as info -v lists them")
      ->type_name("NAME|I")
      ->group(group);
  verb.add_option("--image-format", options.image_format,
                  "Texels of an image. bit: 1 bit, filtered by 3 x 3, between two colours; grey: 8 bits along a curve "
                  "of colours; r2g4b2: 2, 4 and 2 bits between two colours (default r2g4b2)")
      ->check(one_of(
          {std::string(kTexelFormatNames[0]), std::string(kTexelFormatNames[1]), std::string(kTexelFormatNames[2])}))
      ->group(group);
  verb.add_option("--image-size", options.image_size,
                  "Texels along the longest side; a larger image is averaged (default: the image's own)")
      ->type_name("N")
      ->group(group);
}

ShaderExport export_image(const std::string& input, const std::string& output, const ShaderOptions& options,
                          const MemoryBudget& budget, Progress& progress) {
  const ShaderConfig config = options.config();
  const TexelFormat format = format_of(options);
  const bool baked = is_baked_file(input);
  if (options.texture && !baked) refuse_without_effect({"--texture"}, "an image file");
  SourceImage source = baked ? read_texture(input, *options.texture, budget) : read_image_file(input, budget);
  refuse_without_effect(options.voxel_names(), baked ? "--texture" : "an image");
  const std::array<uint32_t, 2> own{source.texels.width, source.texels.height};
  const uint32_t longest = options.image_size.value_or(std::max(own[0], own[1]));
  if (longest < 1 || longest > std::max(own[0], own[1]))
    throw FileError(ErrorKind::kUsage, input,
                    fmt::format("--image-size must be 1 to {}, the image's longest side", std::max(own[0], own[1])));
  const std::array<uint32_t, 2> size = scaled_size(own[0], own[1], longest);
  check_elements(input, source.texels, size, format, config.max_elements);
  progress.check_cancelled();
  const MemoryReservation memory(budget, encode_memory_bytes(size[0], size[1]), "the image");
  const AlbedoTexture texels = scaled_down(source.texels, longest);
  const ShaderImage image = encode_shader_image(texels, format);
  const ImageDifference difference = difference_of(image, texels);
  const std::string text = image_shader(image, config);
  const uint64_t elements = shader_image_elements(format, size[0], size[1]);
  const auto* const first = reinterpret_cast<const std::byte*>(text.data());
  const std::string error = std::isfinite(difference.psnr_db) ? fmt::format("PSNR {:.1f} dB, largest error {} of 255",
                                                                            difference.psnr_db, difference.max_error)
                                                              : std::string("exact");
  return {std::vector<std::byte>(first, first + text.size()),
          {{"verb", "export"},
           {"input", input},
           {"output", output},
           {"layout", "glsl"},
           {"shader", options.form.value_or("shadertoy")},
           {"texture", baked ? nlohmann::json(source.texture) : nlohmann::json()},
           {"format", kTexelFormatNames[static_cast<size_t>(format)]},
           {"source_size", own},
           {"size", size},
           {"elements", elements},
           {"max_elements", config.max_elements},
           {"bits", 32 * elements},
           {"psnr_db", difference.psnr_db},
           {"max_error", difference.max_error},
           {"transparent_texels", source.transparent},
           {"bytes", text.size()},
           {"peak_rss_bytes", peak_rss_bytes()}},
          fmt::format(grouped(), "{}: {} x {} texels in {:L} of {:L} array elements, {:L} bytes of text; {}\n", output,
                      size[0], size[1], elements, config.max_elements, text.size(), error),
          std::move(source.warnings)};
}

} // namespace packtrace
