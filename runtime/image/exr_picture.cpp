#include "runtime/image/exr_picture.h"

#include <bit>
#include <cassert>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>

#include "runtime/image/exr_streams.h"

namespace packtrace {

struct ExrPicture::Header {
  Imf::Header imf;
};

namespace {

Imf::PixelType imf_type(ExrType type) {
  return type == ExrType::kHalf ? Imf::HALF : type == ExrType::kFloat ? Imf::FLOAT : Imf::UINT;
}

ExrType type_of(Imf::PixelType type) {
  return type == Imf::HALF ? ExrType::kHalf : type == Imf::FLOAT ? ExrType::kFloat : ExrType::kUint;
}

size_t sample_bytes(ExrType type) { return type == ExrType::kHalf ? 2 : 4; }

/// @param samples are not changed by writing
Imf::Slice slice_of(ExrType type, const std::byte* samples, const Imf::Header& header, ImageSize size) {
  return Imf::Slice::Make(imf_type(type), samples, header.dataWindow(), sample_bytes(type),
                          sample_bytes(type) * size.width);
}

template <typename T>
std::vector<T> values_of(std::span<const std::byte> bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

/// Makes the header of a scan-line file with lossless compression and without channels.
Imf::Header header_like(const Imf::Header& source) {
  Imf::Header header; // Header::erase() of OpenEXR 3.1 leaks the attribute, so the others are copied
  for (auto i = source.begin(); i != source.end(); ++i) {
    const std::string_view name = i.name();
    if (name != "tiles" && name != "type" && name != "chunkCount") header.insert(i.name(), i.attribute());
  }
  header.compression() = Imf::ZIP_COMPRESSION;
  header.lineOrder() = Imf::INCREASING_Y;
  header.channels() = Imf::ChannelList();
  return header;
}

} // namespace

ExrPicture::ExrPicture(std::span<const std::byte> bytes, std::string_view name, std::span<const std::string> channels) {
  guarded_exr(name, [&] {
    auto [header, size] = read_exr_header(bytes, name);
    size_ = size;
    const Imf::ChannelList& list = header.channels();
    for (auto it = list.begin(); channels.empty() && it != list.end(); ++it)
      planes_[it.name()].type = type_of(it.channel().type);
    for (const std::string& channel : channels) {
      const Imf::Channel* const found = list.findChannel(channel);
      if (found == nullptr) fail_exr(name, "it has no channel " + channel);
      planes_[channel].type = type_of(found->type);
    }
    if (uint64_t{size.width} * size.height * planes_.size() > kMaxImageSamples) fail_exr(name, "EXR file is too large");
    ExrMemoryReader reader(bytes, std::string(name));
    Imf::InputFile file(reader, 0);
    if (!file.isComplete()) fail_exr(name, "damaged EXR file: pixels are missing");
    Imf::FrameBuffer frame;
    for (auto& [channel, plane] : planes_) {
      require_full_sampling(header, channel, name);
      plane.samples.resize(size.pixels() * sample_bytes(plane.type));
      frame.insert(channel, slice_of(plane.type, plane.samples.data(), header, size));
    }
    file.setFrameBuffer(frame);
    file.readPixels(header.dataWindow().min.y, header.dataWindow().max.y);
    header_ = std::make_unique<Header>(Header{std::move(header)});
  });
}

ExrPicture::~ExrPicture() = default;
ExrPicture::ExrPicture(ExrPicture&&) noexcept = default;
ExrPicture& ExrPicture::operator=(ExrPicture&&) noexcept = default;

const ExrPicture::Plane& ExrPicture::plane(const std::string& channel) const {
  const auto found = planes_.find(channel);
  assert(found != planes_.end());
  return found->second;
}

std::optional<ExrType> ExrPicture::type(const std::string& channel) const {
  const auto found = planes_.find(channel);
  if (found == planes_.end()) return std::nullopt;
  return found->second.type;
}

std::vector<float> ExrPicture::floats(const std::string& channel) const {
  const Plane& stored = plane(channel);
  if (stored.type == ExrType::kFloat) return values_of<float>(stored.samples);
  if (stored.type == ExrType::kHalf) {
    const std::vector<half> halves = values_of<half>(stored.samples);
    return {halves.begin(), halves.end()};
  }
  std::vector<float> values;
  values.reserve(size_.pixels());
  for (const uint32_t value : values_of<uint32_t>(stored.samples)) values.push_back(static_cast<float>(value));
  return values;
}

std::vector<uint32_t> ExrPicture::words(const std::string& channel) const {
  const Plane& stored = plane(channel);
  if (stored.type != ExrType::kHalf) return values_of<uint32_t>(stored.samples);
  std::vector<uint32_t> values;
  values.reserve(size_.pixels());
  for (const float value : floats(channel)) values.push_back(std::bit_cast<uint32_t>(value));
  return values;
}

std::vector<std::byte> ExrPicture::encode(std::span<const Layer> layers) const {
  Imf::Header header = header_like(header_->imf);
  Imf::FrameBuffer frame;
  for (const auto& [channel, plane] : planes_) {
    header.channels().insert(channel, Imf::Channel(imf_type(plane.type)));
    frame.insert(channel, slice_of(plane.type, plane.samples.data(), header, size_));
  }
  const ExrSlices added(size_, layers, header, frame);
  return write_exr(header, frame, size_);
}

} // namespace packtrace
