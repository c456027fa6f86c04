#include <algorithm>
#include <cstring>
#include <limits>
#include <new>
#include <set>
#include <type_traits>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include "pbrt_import/base/error.h"
#include "runtime/image/exr.h"
#include "runtime/image/exr_streams.h"

namespace packtrace {

namespace {

std::string full_name(const std::string& layer, const std::string& channel) {
  if (layer.empty()) return channel;
  return channel.empty() ? layer : layer + "." + channel;
}

void require_image_size(ImageSize size) {
  if (size.width < 1 || size.height < 1 || size.width > kMaxImageSide || size.height > kMaxImageSide)
    throw Error(ErrorKind::kUsage, "an image of " + std::to_string(size.width) + " x " + std::to_string(size.height) +
                                       " pixels cannot be written as EXR");
}

void check_layers(ImageSize size, std::span<const Layer> layers) {
  std::set<std::string> names;
  for (const Layer& layer : layers) {
    const size_t samples = std::visit([](auto span) { return span.size(); }, layer.data);
    if (layer.channels.empty() || samples != size.pixels() * layer.channels.size())
      throw Error(ErrorKind::kUsage, "EXR layer \"" + layer.name + "\": " + std::to_string(samples) +
                                         " samples do not fit its channels and the image's size");
    for (const std::string& channel : layer.channels) {
      const std::string name = full_name(layer.name, channel);
      if (name.empty() || name.size() > 255 || name.find('\0') != std::string::npos || !names.insert(name).second)
        throw Error(ErrorKind::kUsage, "EXR channel name \"" + name + "\" is empty, too long or used twice");
    }
  }
}

void add_attributes(Imf::Header& header, const ExrAttributes& attributes) {
  for (const auto& [name, value] : attributes) {
    // Attributes that the header already has are standard attributes of the format.
    if (name.empty() || name.size() > 255 || header.find(name) != header.end() || name == "tiles" ||
        name == "chunkCount")
      throw Error(ErrorKind::kUsage, "EXR attribute name \"" + name + "\" cannot be used");
    if (const int* integer = std::get_if<int>(&value)) header.insert(name, Imf::IntAttribute(*integer));
    if (const double* real = std::get_if<double>(&value)) header.insert(name, Imf::DoubleAttribute(*real));
    if (const auto* text = std::get_if<std::string>(&value)) header.insert(name, Imf::StringAttribute(*text));
  }
}

/// Converts a layer's samples to 16 bits, because OpenEXR converts types only when reading.
std::vector<half> to_half(std::span<const float> samples) {
  std::vector<half> result(samples.size());
  std::transform(samples.begin(), samples.end(), result.begin(), [](float value) { return half(value); });
  return result;
}

template <class Sample>
void add_slices(Imf::Header& header, Imf::FrameBuffer& frame, Imf::PixelType type, const Layer& layer, ImageSize size,
                const Sample* samples) {
  const size_t stride = sizeof(Sample) * layer.channels.size();
  for (size_t c = 0; c < layer.channels.size(); ++c) {
    const std::string name = full_name(layer.name, layer.channels[c]);
    header.channels().insert(name, Imf::Channel(type));
    frame.insert(name, Imf::Slice::Make(type, samples + c, header.dataWindow(), stride, stride * size.width));
  }
}

} // namespace

ExrSlices::ExrSlices(ImageSize size, std::span<const Layer> layers, Imf::Header& header, Imf::FrameBuffer& frame) {
  check_layers(size, layers);
  halves_.reserve(layers.size());
  for (const Layer& layer : layers) {
    if (const auto* integers = std::get_if<std::span<const uint32_t>>(&layer.data))
      add_slices(header, frame, Imf::UINT, layer, size, integers->data());
    else if (const auto floats = std::get<std::span<const float>>(layer.data); layer.half)
      add_slices(header, frame, Imf::HALF, layer, size, halves_.emplace_back(to_half(floats)).data());
    else
      add_slices(header, frame, Imf::FLOAT, layer, size, floats.data());
  }
}

std::vector<std::byte> write_exr(const Imf::Header& header, const Imf::FrameBuffer& frame, ImageSize size) {
  ExrMemoryWriter writer;
  try {
    Imf::OutputFile file(writer, header);
    file.setFrameBuffer(frame);
    file.writePixels(static_cast<int>(size.height));
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(ErrorKind::kIo, std::string("cannot encode EXR: ") + error.what());
  }
  return writer.take();
}

std::vector<std::byte> encode_exr(ImageSize size, std::span<const Layer> layers, const ExrAttributes& attributes) {
  if (layers.empty()) throw Error(ErrorKind::kUsage, "an EXR file needs at least one layer");
  require_image_size(size);
  Imf::Header header(static_cast<int>(size.width), static_cast<int>(size.height));
  header.compression() = Imf::ZIP_COMPRESSION;
  add_attributes(header, attributes);
  Imf::FrameBuffer frame;
  const ExrSlices slices(size, layers, header, frame);
  return write_exr(header, frame, size);
}

} // namespace packtrace
