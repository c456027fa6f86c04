#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/image/exr.h"

namespace packtrace {

/// Channels of an EXR file as stored, to be read by name and written back with changes.
class ExrPicture {
public:
  /// Decodes channels of a file in memory.
  /// @param name file name for messages, usually the path
  /// @param channels full names, such as "normal.X"; empty: all
  /// Throws like decode_exr(), and Error(kInput) for a channel that the file does not have.
  ExrPicture(std::span<const std::byte> bytes, std::string_view name, std::span<const std::string> channels = {});
  ~ExrPicture();
  ExrPicture(ExrPicture&&) noexcept;
  ExrPicture& operator=(ExrPicture&&) noexcept;

  ImageSize size() const { return size_; }

  /// How a channel is stored; none if it was not decoded.
  std::optional<ExrType> type(const std::string& channel) const;

  /// Samples of a channel, rows top to bottom. Integers become the nearest float.
  std::vector<float> floats(const std::string& channel) const;
  /// Samples of a channel of integers; the bits of 32-bit floats of other channels, which identify objects as well.
  std::vector<uint32_t> words(const std::string& channel) const;

  /// Encodes a scan-line file with lossless ZIP compression that has all decoded channels and all attributes of the
  /// file, windows included.
  /// @param layers replace channels of the same name, and are added otherwise; as in encode_exr()
  /// Throws like encode_exr().
  std::vector<std::byte> encode(std::span<const Layer> layers) const;

private:
  struct Header;
  struct Plane {
    ExrType type = ExrType::kHalf;
    std::vector<std::byte> samples;
  };
  const Plane& plane(const std::string& channel) const;

  ImageSize size_;
  std::unique_ptr<Header> header_;
  std::map<std::string, Plane> planes_;
};

} // namespace packtrace
