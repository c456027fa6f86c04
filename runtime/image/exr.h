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

/// A group of channels to write. It refers to the caller's samples. The layer "normal" with channels X, Y, Z is stored
/// as normal.X, normal.Y, normal.Z; with a single channel "" it is stored as "normal"; the layer "" with channels
/// R, G, B is stored as R, G, B.
struct Layer {
  std::string name;
  std::vector<std::string> channels;
  /// size.pixels() * channels.size() samples, interleaved. Integers are stored as 32-bit integers, ignoring `half`.
  std::variant<std::span<const float>, std::span<const uint32_t>> data;
  bool half = false; ///< store floats with 16 bits: 11 significant bits, magnitudes above 65504 become infinite
};

using ExrAttribute = std::variant<int, double, std::string>;
using ExrAttributes = std::map<std::string, ExrAttribute>;

/// Encodes a single-part scan-line EXR file with lossless ZIP compression. The bytes depend on the arguments only.
/// Throws Error(kUsage) if the image is empty or too large, a channel name is empty, too long or used twice, a layer
/// has the wrong sample count, or an attribute has the name of a standard attribute. Throws Error(kIo) if OpenEXR
/// fails.
std::vector<std::byte> encode_exr(ImageSize size, std::span<const Layer> layers, const ExrAttributes& attributes = {});

/// A channel of a file.
struct ExrChannel {
  std::string name; ///< full name, such as "normal.X"
  ExrType type = ExrType::kHalf;
};

/// A group of channels of a file.
struct ExrLayer {
  std::string name;                 ///< channel name up to its last dot; "" for the plain channels R, G, B, A, Y
  std::vector<ExrChannel> channels; ///< decoding order: R, G, B, A first, then the others by name
};

/// Contents of an EXR file's header.
struct ExrInfo {
  ImageSize size; ///< size of the data window
  std::vector<ExrLayer> layers;
  ExrAttributes attributes; ///< attributes of type int, float, double and string
};

/// Reads the header of a file in memory. Throws like decode_exr().
ExrInfo exr_info(std::span<const std::byte> bytes, std::string_view name);

/// Returns the layer with this name. If the name is empty, returns the layer "ao", else the plain colour channels, else
/// the only layer. Throws Error(kInput) listing the layers if there is no such layer or the choice is ambiguous.
/// @param name file name for messages
const ExrLayer& choose_layer(const ExrInfo& info, std::string_view layer, std::string_view name);

/// Decodes one layer of a file in memory. Channels are in the order of ExrLayer; integers become the nearest float.
/// @param name file name for messages, usually the path
/// @param layer layer name; if empty, choose_layer() decides
/// Throws Error(kInput) for damaged or truncated files, image sizes that are implausible for the file's length, and
/// missing layers; Error(kUnsupported) for multi-part, deep and subsampled images.
Image decode_exr(std::span<const std::byte> bytes, std::string_view name, std::string_view layer = {});

/// Decodes a layer with a single integer channel without rounding, such as instance ids. Throws like decode_exr(), and
/// Error(kInput) for layers of another kind.
std::vector<uint32_t> decode_exr_uint(std::span<const std::byte> bytes, std::string_view name, std::string_view layer);

/// Reads and decodes a file. Throws like decode_exr(), and Error(kInput) if the file cannot be read.
Image read_exr(const std::filesystem::path& path, std::string_view layer = {});

} // namespace packtrace
