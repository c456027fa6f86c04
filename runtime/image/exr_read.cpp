#include <algorithm>
#include <cstring>
#include <limits>
#include <new>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfXdr.h>

#include "pbrt_import/base/exr_header.h"
#include "pbrt_import/base/file_bytes.h"
#include "runtime/image/exr.h"
#include "runtime/image/exr_streams.h"

namespace packtrace {

namespace {

constexpr size_t kMaxChannels = 1024;
constexpr uint32_t kMaxTileSide = 8192, kMinTileSide = 8;
/// Maximum accepted ratio of decoded size to file size, above the compression ratio of EXR's lossless codecs. It keeps
/// a file of a few hundred bytes from requesting gigabytes of memory. Images of at most kAlwaysAcceptedBytes are always
/// accepted.
constexpr uint64_t kMaxRatio = 2048;
constexpr uint64_t kAlwaysAcceptedBytes = uint64_t{64} << 20;

/// Returns the data window's size. Throws unless the size is plausible for the file's length.
ImageSize checked_size(const ExrHeader& header, uint64_t file_bytes, std::string_view name) {
  const uint64_t width = header.width(), height = header.height(), pixel_bytes = header.pixel_bytes();
  if (width < 1 || height < 1) fail_exr(name, "damaged EXR file: it has no pixels");
  if (header.channels.empty() || header.channels.size() > kMaxChannels)
    fail_exr(name, "EXR file without channels or with too many");
  if (header.tile_width > 0) {
    const auto [narrow, wide] = std::minmax(header.tile_width, header.tile_height);
    if (wide > kMaxTileSide || narrow < kMinTileSide)
      fail_exr(name, "EXR tile size is not supported", ErrorKind::kUnsupported);
  }
  if (width > kMaxImageSide || height > kMaxImageSide ||
      std::max(width * height * pixel_bytes, header.block_bytes()) >
          std::max(kAlwaysAcceptedBytes, kMaxRatio * file_bytes))
    fail_exr(name, "image of " + std::to_string(width) + " x " + std::to_string(height) + " pixels and " +
                       std::to_string(header.channels.size()) + " channels is too large for a file of " +
                       std::to_string(file_bytes) + " bytes");
  return {static_cast<uint32_t>(width), static_cast<uint32_t>(height)};
}

/// Sort key of channels: R, G, B, A first, all others by name.
std::pair<size_t, std::string> reading_order(const std::string& full_name) {
  const std::string last = full_name.substr(full_name.rfind('.') + 1);
  const size_t colour = std::string_view("RGBA").find(last);
  return {last.size() == 1 ? std::min<size_t>(colour, 4) : 4, full_name};
}

std::string layer_of(const std::string& full_name) {
  if (const size_t dot = full_name.rfind('.'); dot != std::string::npos) return full_name.substr(0, dot);
  return full_name.size() == 1 && std::string_view("RGBAY").find(full_name[0]) != std::string_view::npos ? ""
                                                                                                         : full_name;
}

ExrInfo info_of(const Imf::Header& header, ImageSize size) {
  ExrInfo info;
  info.size = size;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    const std::string layer_name = layer_of(it.name());
    auto layer = std::find_if(info.layers.begin(), info.layers.end(), [&](auto& l) { return l.name == layer_name; });
    if (layer == info.layers.end()) layer = info.layers.insert(layer, {layer_name, {}});
    const Imf::PixelType type = it.channel().type;
    layer->channels.push_back({it.name(), type == Imf::HALF    ? ExrType::kHalf
                                          : type == Imf::FLOAT ? ExrType::kFloat
                                                               : ExrType::kUint});
  }
  for (ExrLayer& layer : info.layers)
    std::sort(layer.channels.begin(), layer.channels.end(),
              [](const ExrChannel& a, const ExrChannel& b) { return reading_order(a.name) < reading_order(b.name); });
  for (auto it = header.begin(); it != header.end(); ++it) {
    const Imf::Attribute* attribute = &it.attribute();
    if (const auto* i = dynamic_cast<const Imf::IntAttribute*>(attribute)) info.attributes[it.name()] = i->value();
    if (const auto* f = dynamic_cast<const Imf::FloatAttribute*>(attribute))
      info.attributes[it.name()] = double{f->value()};
    if (const auto* d = dynamic_cast<const Imf::DoubleAttribute*>(attribute)) info.attributes[it.name()] = d->value();
    if (const auto* s = dynamic_cast<const Imf::StringAttribute*>(attribute)) info.attributes[it.name()] = s->value();
  }
  return info;
}

/// Reads the channels of a layer, interleaved.
/// @tparam Sample float, or uint32_t for integer channels
template <class Sample>
std::vector<Sample> read_pixels(std::span<const std::byte> bytes, std::string_view name, const Imf::Header& header,
                                ImageSize size, const ExrLayer& layer) {
  const uint64_t channels = layer.channels.size();
  if (uint64_t{size.width} * size.height * channels > kMaxImageSamples) fail_exr(name, "EXR layer is too large");
  for (const ExrChannel& channel : layer.channels) require_full_sampling(header, channel.name, name);
  ExrMemoryReader reader(bytes, std::string(name));
  Imf::InputFile file(reader, 0);
  if (!file.isComplete()) fail_exr(name, "damaged EXR file: pixels are missing");

  std::vector<Sample> samples(size.pixels() * channels);
  Imf::FrameBuffer frame;
  const Imf::PixelType type = std::is_same_v<Sample, float> ? Imf::FLOAT : Imf::UINT;
  const auto& window = header.dataWindow();
  for (size_t c = 0; c < channels; ++c)
    frame.insert(layer.channels[c].name, Imf::Slice::Make(type, samples.data() + c, window, sizeof(Sample) * channels,
                                                          sizeof(Sample) * channels * size.width));
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  return samples;
}

} // namespace

CheckedExrHeader read_exr_header(std::span<const std::byte> bytes, std::string_view name) {
  if (const std::string_view why = unsupported_exr_kind(bytes); !why.empty())
    fail_exr(name, std::string(why), ErrorKind::kUnsupported);
  const ExrHeader found = scan_exr_header(bytes, std::string(name) + ": damaged EXR file: ");
  CheckedExrHeader checked{{}, checked_size(found, bytes.size(), name)};
  ExrMemoryReader reader(bytes, std::string(name));
  reader.seekg(4);
  int version = 0;
  Imf::Xdr::read<Imf::StreamIO>(reader, version);
  checked.header.readFrom(reader, version);
  checked.header.sanityCheck(found.tile_width > 0);
  return checked;
}

void require_full_sampling(const Imf::Header& header, const std::string& channel, std::string_view name) {
  const Imf::Channel* stored = header.channels().findChannel(channel);
  if (!stored || stored->xSampling != 1 || stored->ySampling != 1)
    fail_exr(name, "subsampled EXR channel " + channel + " is not supported", ErrorKind::kUnsupported);
}

ExrInfo exr_info(std::span<const std::byte> bytes, std::string_view name) {
  return guarded_exr(name, [&] {
    const auto [header, size] = read_exr_header(bytes, name);
    return info_of(header, size);
  });
}

const ExrLayer& choose_layer(const ExrInfo& info, std::string_view layer, std::string_view name) {
  const auto find = [&](std::string_view wanted) {
    return std::find_if(info.layers.begin(), info.layers.end(), [&](const ExrLayer& l) { return l.name == wanted; });
  };
  auto found = find(layer);
  if (layer.empty()) {
    if (const auto ao = find("ao"); ao != info.layers.end()) found = ao;
    if (found == info.layers.end() && info.layers.size() == 1) found = info.layers.begin();
  }
  if (found != info.layers.end()) return *found;
  std::string list;
  for (const ExrLayer& candidate : info.layers)
    list.append(list.empty() ? "" : ", ").append(candidate.name.empty() ? "(colours)" : candidate.name);
  if (layer.empty()) fail_exr(name, "it has several layers, name one: " + list);
  fail_exr(name, "it has no layer \"" + std::string(layer) + "\", but " + list);
}

Image decode_exr(std::span<const std::byte> bytes, std::string_view name, std::string_view layer) {
  return guarded_exr(name, [&] {
    const auto [header, size] = read_exr_header(bytes, name);
    const ExrInfo info = info_of(header, size);
    const ExrLayer& chosen = choose_layer(info, layer, name);
    Image image;
    image.size = info.size;
    image.channels = static_cast<uint32_t>(chosen.channels.size());
    image.data = read_pixels<float>(bytes, name, header, info.size, chosen);
    return image;
  });
}

std::vector<uint32_t> decode_exr_uint(std::span<const std::byte> bytes, std::string_view name, std::string_view layer) {
  return guarded_exr(name, [&] {
    const auto [header, size] = read_exr_header(bytes, name);
    const ExrInfo info = info_of(header, size);
    const ExrLayer& chosen = choose_layer(info, layer, name);
    if (chosen.channels.size() != 1 || chosen.channels[0].type != ExrType::kUint)
      fail_exr(name, "EXR layer \"" + std::string(layer) + "\" is not one integer channel");
    return read_pixels<uint32_t>(bytes, name, header, info.size, chosen);
  });
}

Image read_exr(const std::filesystem::path& path, std::string_view layer) {
  return decode_exr(read_file_bytes(path), path.string(), layer);
}

} // namespace packtrace
