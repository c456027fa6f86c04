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
#include <OpenEXR/ImfTileDescription.h>

#include "pbrt_import/scene/error.h"
#include "pbrt_import/scene/file_bytes.h"
#include "runtime/image/exr.h"

namespace packtrace {

namespace {

constexpr uint32_t kMagic = 20000630;
constexpr uint32_t kVersion = 2, kTiledFlag = 0x200, kLongNamesFlag = 0x400, kDeepFlag = 0x800, kMultiPartFlag = 0x1000;
constexpr size_t kMaxChannels = 1024;
constexpr uint32_t kMaxTileSide = 8192, kMinTileSide = 8;
/// More than any of the format's lossless codecs can shrink; a file may claim that many times its own length, so that
/// a few hundred bytes cannot demand gigabytes. Small images are allowed in any case.
constexpr uint64_t kMaxRatio = 2048;
constexpr uint64_t kFreeBytes = uint64_t{64} << 20;

[[noreturn]] void fail(std::string_view name, const std::string& what, ErrorKind kind = ErrorKind::kInput) {
  throw Error(kind, std::string(name) + ": " + what);
}

class MemoryReader : public Imf::IStream {
public:
  MemoryReader(std::span<const std::byte> bytes, const std::string& name) : IStream(name.c_str()), bytes_(bytes) {}
  bool read(char target[], int count) override {
    const size_t n = static_cast<size_t>(count);
    if (count < 0 || position_ > bytes_.size() || n > bytes_.size() - position_)
      throw std::runtime_error("the file ends too early");
    std::memcpy(target, bytes_.data() + position_, n);
    position_ += n;
    return position_ < bytes_.size();
  }
  uint64_t tellg() override { return position_; }
  void seekg(uint64_t position) override { position_ = position; }

private:
  std::span<const std::byte> bytes_;
  uint64_t position_ = 0;
};

/// Steps through the header without believing it.
struct HeaderScan {
  std::span<const std::byte> bytes;
  std::string_view name;
  size_t at = 0;

  uint32_t u32() {
    if (bytes.size() - at < 4) fail(name, "damaged EXR file: its header is cut off");
    uint32_t value = 0;
    for (size_t i = 0; i < 4; ++i) value |= std::to_integer<uint32_t>(bytes[at + i]) << (8 * i);
    at += 4;
    return value;
  }
  std::string_view text() {
    const size_t longest = std::min<size_t>(bytes.size() - at, 256);
    const auto* begin = reinterpret_cast<const char*>(bytes.data() + at);
    const void* end = std::memchr(begin, 0, longest);
    if (!end) fail(name, "damaged EXR file: a name in its header does not end");
    const std::string_view result(begin, static_cast<size_t>(static_cast<const char*>(end) - begin));
    at += result.size() + 1;
    return result;
  }
};

/// Makes sure that no length inside the header exceeds the file: OpenEXR allocates before it reads.
/// Returns the version field.
uint32_t scan_header(std::span<const std::byte> bytes, std::string_view name) {
  HeaderScan scan{bytes, name};
  if (bytes.size() < 8 || scan.u32() != kMagic) fail(name, "not an EXR file");
  const uint32_t version = scan.u32();
  if ((version & 0xff) != kVersion || (version & ~(0xffu | kTiledFlag | kLongNamesFlag)) != 0) {
    const char* what = (version & kMultiPartFlag) != 0 ? "multi-part EXR files are not supported"
                       : (version & kDeepFlag) != 0    ? "deep EXR files are not supported"
                                                       : "unknown version of the EXR format";
    fail(name, what, ErrorKind::kUnsupported);
  }
  while (!scan.text().empty()) {
    const std::string_view type = scan.text();
    const uint64_t length = scan.u32();
    if (length > bytes.size() - scan.at) fail(name, "damaged EXR file: an attribute is larger than the file");
    const size_t end = scan.at + length;
    if (type == "stringvector") {
      HeaderScan strings{bytes.first(end), name, scan.at};
      while (strings.at < end) {
        const uint64_t string_length = strings.u32();
        if (string_length > end - strings.at) fail(name, "damaged EXR file: a string is larger than its attribute");
        strings.at += string_length;
      }
    }
    scan.at = end;
  }
  return version;
}

Imf::Header read_header(std::span<const std::byte> bytes, std::string_view name) {
  int version = static_cast<int>(scan_header(bytes, name));
  MemoryReader reader(bytes, std::string(name));
  reader.seekg(8);
  Imf::Header header;
  header.readFrom(reader, version);
  header.sanityCheck((static_cast<uint32_t>(version) & kTiledFlag) != 0);
  return header;
}

size_t bytes_of(Imf::PixelType type) { return type == Imf::HALF ? 2 : 4; }

/// The data window's size, once the file is known to be long enough to fill it.
ImageSize checked_size(const Imf::Header& header, uint64_t file_bytes, std::string_view name) {
  const auto& window = header.dataWindow();
  const int64_t width = int64_t{window.max.x} - window.min.x + 1, height = int64_t{window.max.y} - window.min.y + 1;
  if (width < 1 || height < 1) fail(name, "damaged EXR file: it has no pixels");
  uint64_t channel_count = 0, pixel_bytes = 0;
  for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
    ++channel_count;
    pixel_bytes += bytes_of(channel.channel().type);
  }
  if (channel_count < 1 || channel_count > kMaxChannels) fail(name, "EXR file without channels or with too many");
  uint64_t rows = 256; // the most scan lines that one compressed block holds
  if (header.hasTileDescription()) {
    const Imf::TileDescription& tiles = header.tileDescription();
    if (std::max(tiles.xSize, tiles.ySize) > kMaxTileSide || std::min(tiles.xSize, tiles.ySize) < kMinTileSide)
      fail(name, "EXR tile size is not supported", ErrorKind::kUnsupported);
    rows = std::max<uint64_t>(rows, tiles.ySize);
  }
  rows = std::max(rows, static_cast<uint64_t>(height));
  if (width > kMaxImageSide || height > kMaxImageSide ||
      static_cast<uint64_t>(width) * rows * pixel_bytes > std::max(kFreeBytes, kMaxRatio * file_bytes))
    fail(name, "image of " + std::to_string(width) + " x " + std::to_string(height) + " pixels and " +
                   std::to_string(channel_count) + " channels is too large for a file of " +
                   std::to_string(file_bytes) + " bytes");
  return {static_cast<uint32_t>(width), static_cast<uint32_t>(height)};
}

/// Runs OpenEXR's code; whatever it throws becomes an Error about this file.
template <class Function>
auto guarded(std::string_view name, Function function) -> decltype(function()) {
  try {
    return function();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    fail(name, "EXR file needs more memory than there is");
  } catch (const std::exception& error) {
    fail(name, std::string("damaged EXR file: ") + error.what());
  }
}

/// R, G, B, A first; X, Y, Z and everything else by name.
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

/// Reads the channels of one layer, interleaved, as Sample (float, or uint32_t for integer channels).
template <class Sample>
std::vector<Sample> read_pixels(std::span<const std::byte> bytes, std::string_view name, const Imf::Header& header,
                                ImageSize size, const ExrLayer& layer) {
  const uint64_t channels = layer.channels.size();
  if (uint64_t{size.width} * size.height * channels > kMaxImageSamples) fail(name, "EXR layer is too large");
  for (const ExrChannel& channel : layer.channels) {
    const Imf::Channel* stored = header.channels().findChannel(channel.name);
    if (!stored || stored->xSampling != 1 || stored->ySampling != 1)
      fail(name, "subsampled EXR channel " + channel.name + " is not supported", ErrorKind::kUnsupported);
  }
  MemoryReader reader(bytes, std::string(name));
  Imf::InputFile file(reader, 0);
  if (!file.isComplete()) fail(name, "damaged EXR file: pixels are missing");

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

ExrInfo exr_info(std::span<const std::byte> bytes, std::string_view name) {
  return guarded(name, [&] {
    const Imf::Header header = read_header(bytes, name);
    return info_of(header, checked_size(header, bytes.size(), name));
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
  if (layer.empty()) fail(name, "it has several layers, name one: " + list);
  fail(name, "it has no layer \"" + std::string(layer) + "\", but " + list);
}

Image decode_exr(std::span<const std::byte> bytes, std::string_view name, std::string_view layer) {
  return guarded(name, [&] {
    const Imf::Header header = read_header(bytes, name);
    const ExrInfo info = info_of(header, checked_size(header, bytes.size(), name));
    const ExrLayer& chosen = choose_layer(info, layer, name);
    Image image;
    image.size = info.size;
    image.channels = static_cast<uint32_t>(chosen.channels.size());
    image.data = read_pixels<float>(bytes, name, header, info.size, chosen);
    return image;
  });
}

std::vector<uint32_t> decode_exr_uint(std::span<const std::byte> bytes, std::string_view name, std::string_view layer) {
  return guarded(name, [&] {
    const Imf::Header header = read_header(bytes, name);
    const ExrInfo info = info_of(header, checked_size(header, bytes.size(), name));
    const ExrLayer& chosen = choose_layer(info, layer, name);
    if (chosen.channels.size() != 1 || chosen.channels[0].type != ExrType::kUint)
      fail(name, "EXR layer \"" + std::string(layer) + "\" is not one integer channel");
    return read_pixels<uint32_t>(bytes, name, header, info.size, chosen);
  });
}

Image read_exr(const std::filesystem::path& path, std::string_view layer) {
  return decode_exr(read_file_bytes(path), path.string(), layer);
}

} // namespace packtrace
