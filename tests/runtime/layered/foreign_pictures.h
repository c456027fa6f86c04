#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>

#include "pbrt_import/scene/image_size.h"
#include "tests/runtime/denoise/synthetic.h"

namespace packtrace::foreign {

/// Channels of a picture, by full name.
using Channels = std::map<std::string, std::vector<float>>;

/// Writes an EXR file as another renderer does.
/// @param halves names of channels that are stored with 16 bits
inline void write(const std::filesystem::path& file, ImageSize size, Channels channels,
                  const std::vector<std::string>& halves = {}, Imf::Compression compression = Imf::ZIPS_COMPRESSION) {
  Imf::Header header(static_cast<int>(size.width), static_cast<int>(size.height));
  header.compression() = compression;
  Imf::FrameBuffer frame;
  std::map<std::string, std::vector<half>> converted;
  for (auto& [name, values] : channels) {
    const bool is_half = std::find(halves.begin(), halves.end(), name) != halves.end();
    const Imf::PixelType type = is_half ? Imf::HALF : Imf::FLOAT;
    const size_t bytes = is_half ? 2 : 4;
    if (is_half) converted[name].assign(values.begin(), values.end());
    const void* const samples = is_half ? static_cast<const void*>(converted[name].data()) : values.data();
    header.channels().insert(name, Imf::Channel(type));
    frame.insert(name, Imf::Slice::Make(type, samples, header.dataWindow(), bytes, bytes * size.width));
  }
  Imf::OutputFile output(file.c_str(), header);
  output.setFrameBuffer(frame);
  output.writePixels(static_cast<int>(size.height));
}

/// A noisy wall that faces the camera at depth 10, in packtrace's own channels.
/// @param frame number of the noise
inline Channels wall(ImageSize size, uint32_t frame) {
  const size_t n = size.pixels();
  return {{"ao", synthetic::noise(size, 0.5f, frame).ao},
          {"depth", std::vector<float>(n, 10.0f)},
          {"normal.X", std::vector<float>(n, 0.0f)},
          {"normal.Y", std::vector<float>(n, 0.0f)},
          {"normal.Z", std::vector<float>(n, -1.0f)}};
}

} // namespace packtrace::foreign
