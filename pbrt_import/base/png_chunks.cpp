#include "pbrt_import/base/png_chunks.h"

#include <algorithm>
#include <cstring>
#include <string_view>
#include <vector>

#include <zlib.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
constexpr size_t kChunkBytes = 12; // length, type, checksum
constexpr uint32_t kPaletteColours = 3, kGreyColours = 0;
constexpr uint64_t kDeflateRatio = 1032;
/// Accepted excess of the decompressed data over the header's size: other readers ignore excess data too, but a small
/// file must not demand gigabytes.
constexpr uint64_t kSurplusBytes = uint64_t{64} << 20;
/// Larger than any image that is read; counting the decompressed bytes takes seconds at most below this limit.
constexpr uint64_t kMaxBytes = uint64_t{8} << 30;

uint32_t read_be32(std::span<const std::byte> bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = value << 8 | std::to_integer<uint32_t>(bytes[at + i]);
  return value;
}

/// Bytes of the filtered rows of an image of this size; at most 2^60, so that seven passes can be summed.
uint64_t row_bytes(const PngHeader& header, uint64_t width, uint64_t height) {
  const uint64_t bits_per_pixel = uint64_t{header.bits_per_sample} * header.channels;
  const uint64_t row = width == 0 ? 0 : 1 + (width * bits_per_pixel + 7) / 8;
  constexpr uint64_t kMax = uint64_t{1} << 60;
  return row > 0 && height > kMax / row ? kMax : height * row;
}

/// Expected size of the decompressed image data in bytes.
uint64_t unpacked_bytes(const PngHeader& header) {
  if (!header.interlaced) return row_bytes(header, header.width, header.height);
  struct Pass {
    uint32_t x, y, step_x, step_y;
  };
  constexpr Pass kPasses[] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                              {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};
  const auto count = [](uint64_t size, uint64_t first, uint64_t step) {
    return size > first ? (size - first + step - 1) / step : 0;
  };
  uint64_t bytes = 0;
  for (const Pass& pass : kPasses)
    bytes += row_bytes(header, count(header.width, pass.x, pass.step_x), count(header.height, pass.y, pass.step_y));
  return bytes;
}

class Checker {
public:
  Checker(std::span<const std::byte> bytes, const std::string& complaint) : bytes_(bytes), complaint_(complaint) {}

  PngHeader check(PngChecksums checksums) {
    const std::string_view text(reinterpret_cast<const char*>(bytes_.data()), bytes_.size());
    if (!text.starts_with(kSignature)) damaged("its first bytes are not those of a PNG file");
    PngHeader header;
    uint64_t wrong_checksums = 0;
    std::string_view type;
    for (size_t at = kSignature.size(); type != "IEND";) {
      if (bytes_.size() - at < kChunkBytes) damaged("the file is truncated");
      const size_t length = read_be32(bytes_, at);
      if (length > bytes_.size() - at - kChunkBytes) damaged("the file is truncated");
      type = text.substr(at + 4, 4);
      const std::span<const std::byte> data = bytes_.subspan(at + 8, length);
      if (checksum(at + 4, length + 4) != read_be32(bytes_, at + 8 + length)) {
        if (checksums == PngChecksums::kVerify) damaged("wrong checksum");
        ++wrong_checksums;
      }
      if ((at == kSignature.size()) != (type == "IHDR")) damaged("the header chunk is not where it belongs");
      if (type == "IHDR") header = read_header(data);
      if (type == "IDAT") add(data);
      at += kChunkBytes + length;
    }
    check_amount(unpacked_bytes(header));
    header.wrong_checksums = wrong_checksums;
    return header;
  }

private:
  [[noreturn]] void damaged(const char* what) const { throw Error(ErrorKind::kInput, complaint_ + what); }

  uint32_t checksum(size_t at, size_t count) const {
    return static_cast<uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes_.data() + at), count));
  }

  PngHeader read_header(std::span<const std::byte> data) const {
    if (data.size() != 13) damaged("wrong header size");
    PngHeader header;
    header.width = read_be32(data, 0);
    header.height = read_be32(data, 4);
    header.bits_per_sample = std::to_integer<uint32_t>(data[8]);
    const auto color_type = std::to_integer<uint32_t>(data[9]), interlace = std::to_integer<uint32_t>(data[12]);
    if (header.width == 0 || header.height == 0) damaged("it has no pixels");
    if (header.width > INT32_MAX || header.height > INT32_MAX) damaged("impossible size");
    // By colour type: grey, -, RGB, palette, grey with alpha, -, RGBA.
    constexpr uint32_t kChannels[7] = {1, 0, 3, 1, 2, 0, 4};
    header.channels = color_type < 7 ? kChannels[color_type] : 0;
    header.palette = color_type == kPaletteColours;
    if (header.channels == 0) damaged("unknown kind of colours");
    const uint32_t bits = header.bits_per_sample;
    const bool fits = color_type == 0 ? bits <= 16 : color_type == 3 ? bits <= 8 : bits == 8 || bits == 16;
    if (!fits || bits == 0 || (bits & (bits - 1)) != 0) damaged("impossible number of bits per sample");
    if (interlace > 1) damaged("unknown kind of interlacing");
    header.interlaced = interlace == 1;
    return header;
  }

  void add(std::span<const std::byte> data) {
    // Legal before other data, but never written in practice, and decoders copy from a null pointer for it.
    if (data.empty() && data_.empty()) damaged("an image data chunk is empty");
    if (!data.empty()) data_.push_back(data);
    packed_bytes_ += data.size();
  }

  void check_amount(uint64_t wanted) const {
    if (data_.empty()) damaged("it has no image data");
    if (wanted / kDeflateRatio > packed_bytes_) damaged("too little data for its size");
    if (wanted > kMaxBytes) damaged("it has more pixels than are read");
    const uint64_t most = wanted + kSurplusBytes;
    if (packed_bytes_ > most / kDeflateRatio && unpacks_beyond(most)) damaged("too much data for its size");
  }

  /// Whether the data decompress to more than `most` bytes, counted up to the first damage.
  bool unpacks_beyond(uint64_t most) const {
    z_stream stream{};
    if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
    std::vector<Bytef> scratch(64 << 10);
    uint64_t total = 0;
    int status = Z_OK;
    for (size_t i = 0; i < data_.size() && status == Z_OK && total <= most; ++i) {
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(data_[i].data()));
      stream.avail_in = static_cast<uInt>(data_[i].size());
      do {
        stream.next_out = scratch.data();
        stream.avail_out = static_cast<uInt>(scratch.size());
        status = inflate(&stream, Z_NO_FLUSH);
        total += scratch.size() - stream.avail_out;
      } while (status == Z_OK && total <= most && (stream.avail_in > 0 || stream.avail_out == 0));
      if (status == Z_BUF_ERROR) status = Z_OK; // the chunk's input is used up
    }
    inflateEnd(&stream);
    return total > most;
  }

  std::span<const std::byte> bytes_;
  const std::string& complaint_;
  std::vector<std::span<const std::byte>> data_;
  uint64_t packed_bytes_ = 0;
};

} // namespace

PngPalette png_palette(std::span<const std::byte> bytes, const std::string& complaint) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  PngPalette result;
  result.indices_as_grey.assign(bytes.begin(), bytes.end());
  std::string_view type;
  for (size_t at = kSignature.size(); type != "IEND";) {
    const size_t length = read_be32(bytes, at), data = at + 8;
    type = text.substr(at + 4, 4);
    if (type == "IHDR") {
      result.indices_as_grey[data + 9] = std::byte{kGreyColours};
      constexpr uint32_t kHighest = 255;
      result.grey_step = kHighest / ((1u << std::to_integer<uint32_t>(bytes[data + 8])) - 1);
    } else if (type == "PLTE") {
      result.colours.resize(length / 3);
      if (length % 3 != 0 || length == 0 || length > 256 * 3)
        throw Error(ErrorKind::kInput, complaint + "wrong palette size");
      std::memcpy(result.colours.data(), bytes.data() + data, length);
    } else if (type == "tRNS") { // hidden as an unknown chunk: it has another size in grey images
      std::memcpy(result.indices_as_grey.data() + at + 4, "tRNs", 4);
      result.alphas.resize(std::min<size_t>(length, 256));
      std::memcpy(result.alphas.data(), bytes.data() + data, result.alphas.size());
    } else if (type == "IDAT" && result.colours.empty()) {
      throw Error(ErrorKind::kInput, complaint + "no palette before the image data");
    }
    at += kChunkBytes + length;
  }
  return result;
}

PngHeader check_png_chunks(std::span<const std::byte> bytes, PngChecksums checksums, const std::string& complaint) {
  return Checker(bytes, complaint).check(checksums);
}

} // namespace packtrace
