#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "runtime/image/image.h"

namespace packtrace {

/// How one channel is stored in an EXR file.
enum class ExrType : uint8_t { kHalf, kFloat, kUint };

/// One group of channels to write, looking at the caller's samples. A layer "normal" with channels X, Y, Z becomes
/// normal.X, normal.Y, normal.Z; with the one channel "" it becomes just "normal"; a layer "" with channels R, G, B
/// becomes plain R, G, B.
struct Layer {
  std::string name;
  std::vector<std::string> channels;
  /// size.pixels() * channels.size() samples, interleaved; integers are stored as such whatever `half` says.
  std::variant<std::span<const float>, std::span<const uint32_t>> data;
  bool half = false; ///< store as 16-bit floats: 11 significant bits, magnitudes above 65504 become infinite
};

using ExrAttribute = std::variant<int, double, std::string>;
using ExrAttributes = std::map<std::string, ExrAttribute>;

/// One single-part scan-line EXR file with lossless ZIP compression. The bytes depend on nothing but the arguments.
/// Throws Error(kUsage) where the image is empty or too large, layers name a channel twice or have the wrong sample
/// count, or an attribute has the name of one of the format's own.
std::vector<std::byte> encode_exr(ImageSize size, std::span<const Layer> layers, const ExrAttributes& attributes = {});

/// encode_exr() to a file. Throws Error(kIo) where writing fails.
void write_exr(const std::filesystem::path& path, ImageSize size, std::span<const Layer> layers,
               const ExrAttributes& attributes = {});

/// One channel as the file has it.
struct ExrChannel {
  std::string name; ///< full: "normal.X"
  ExrType type = ExrType::kHalf;
};

/// One group of channels of a file.
struct ExrLayer {
  std::string name;                 ///< "" for plain channels that have no group of their own (R, G, B, A, Y)
  std::vector<ExrChannel> channels; ///< in reading order: R, G, B, A first, the others by name
};

/// What an EXR file holds, from its header alone.
struct ExrInfo {
  ImageSize size; ///< of the data window
  std::vector<ExrLayer> layers;
  ExrAttributes attributes; ///< those of type int, float, double and string
};

/// Throws like decode_exr().
ExrInfo exr_info(std::span<const std::byte> bytes, std::string_view name);

/// The layer of that name; where it is empty "ao", else the plain colours, else the only layer.
/// Throws Error(kInput), listing the layers, where there is no such layer or the choice is not clear.
const ExrLayer& choose_layer(const ExrInfo& info, std::string_view layer, std::string_view name);

/// Decodes one layer of a file in memory, channels in the order of ExrLayer, integers as the nearest float.
/// @param name for messages, usually the path
/// @param layer which one; empty: see choose_layer()
/// Throws Error(kInput) for damaged or truncated files, for claims about sizes that the file's length cannot back,
/// and for missing layers; Error(kUnsupported) for multi-part, deep and subsampled images.
Image decode_exr(std::span<const std::byte> bytes, std::string_view name, std::string_view layer = {});

/// Decodes a layer of one integer channel without rounding, such as instance ids. Throws like decode_exr().
std::vector<uint32_t> decode_exr_uint(std::span<const std::byte> bytes, std::string_view name, std::string_view layer);

/// decode_exr() of a file. Throws Error(kInput) also where it cannot be read.
Image read_exr(const std::filesystem::path& path, std::string_view layer = {});

} // namespace packtrace
