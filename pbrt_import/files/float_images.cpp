#include "pbrt_import/files/float_images.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfRgbaFile.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/exr_header.h"
#include "pbrt_import/files/image_summarizer.h"
#include "pbrt_import/text/number.h"

namespace packtrace {
namespace {

constexpr const char* kTruncated = "damaged image: the file is truncated";

/// Input stream of OpenEXR over bytes in memory.
class MemoryStream : public Imf::IStream {
public:
  explicit MemoryStream(std::span<const std::byte> bytes) : Imf::IStream("image"), bytes_(bytes) {}

  bool read(char c[], int n) override {
    const auto count = static_cast<size_t>(std::max(n, 0));
    if (count > bytes_.size() - position_) fail_image(kTruncated);
    if (count > 0) std::memcpy(c, bytes_.data() + position_, count);
    position_ += count;
    return position_ < bytes_.size();
  }
  uint64_t tellg() override { return position_; }
  void seekg(uint64_t position) override {
    if (position > bytes_.size()) fail_image(kTruncated);
    position_ = static_cast<size_t>(position);
  }

private:
  std::span<const std::byte> bytes_;
  size_t position_ = 0;
};

/// Checks the header before OpenEXR reads the file, because OpenEXR allocates before it checks.
void check_exr(std::span<const std::byte> bytes, ImageWants wants, MemoryReservation& memory) {
  if (const std::string_view why = unsupported_exr_kind(bytes); !why.empty()) fail_image(std::string(why));
  const ExrHeader header = scan_exr_header(bytes, "damaged image: ");
  // OpenEXR keeps a few blocks, compressed and decompressed.
  constexpr uint64_t kBlockCopies = 4, kAlwaysAcceptedBytes = 64u << 20, kRows = 64;
  const uint64_t block = header.block_bytes();
  if (block > kAlwaysAcceptedBytes && block / kMaxPixelsPerByte > bytes.size())
    fail_image("damaged image: its " + std::to_string(bytes.size()) + " bytes cannot hold the blocks it claims");
  const uint64_t blocks = block > UINT64_MAX / (2 * kBlockCopies) ? UINT64_MAX / 2 : block * kBlockCopies;
  const ClaimedImageSize size{header.width(), header.height()};
  size.check(bytes.size(), blocks + size.width * kRows * sizeof(Imf::Rgba), wants, memory);
}

} // namespace

ImageSummary read_exr_image(std::span<const std::byte> bytes, ImageWants wants, MemoryReservation& memory) {
  check_exr(bytes, wants, memory);
  try {
    MemoryStream stream(bytes);
    Imf::RgbaInputFile file(stream, 1);
    const Imath::Box2i box = file.dataWindow();
    const int64_t width = int64_t{box.max.x} - box.min.x + 1, height = int64_t{box.max.y} - box.min.y + 1;
    if ((file.channels() & (Imf::WRITE_RGB | Imf::WRITE_YC)) == 0)
      fail_image("the EXR image has none of the channels R, G, B and Y");
    const auto w = static_cast<uint32_t>(width);
    ImageSummarizer summarizer(w, static_cast<uint32_t>(height), wants);
    uint64_t transparent = 0;
    constexpr int64_t kBlock = 64; // a multiple of the block height of every compression except DWAB (256 rows)
    const auto block = static_cast<int>(std::min(height, kBlock));
    std::vector<Imf::Rgba> rows(static_cast<size_t>(w) * static_cast<size_t>(block));
    for (int first = box.min.y; first <= box.max.y; first += block) {
      const int last = std::min(first + block - 1, box.max.y);
      // OpenEXR addresses pixel (x, y) as base + x + y * stride. The data window may have any origin, so base can lie
      // outside the array and is computed as an integer.
      const auto before = static_cast<uint64_t>(box.min.x + int64_t{first} * width) * sizeof(Imf::Rgba);
      const uint64_t base = reinterpret_cast<uintptr_t>(rows.data()) - before;
      file.setFrameBuffer(reinterpret_cast<Imf::Rgba*>(base), 1, w);
      file.readPixels(first, last);
      const Imf::Rgba* pixel = rows.data();
      for (int y = first; y <= last; ++y) {
        for (uint32_t x = 0; x < w; ++x, ++pixel) {
          summarizer.add(x, static_cast<uint32_t>(y - box.min.y), {pixel->r, pixel->g, pixel->b});
          transparent += static_cast<float>(pixel->a) < 1.0f; // 1 without the channel
        }
        summarizer.end_row();
      }
    }
    ImageSummary summary = summarizer.finish();
    if (wants.alpha) summary.transparent = transparent;
    return summary;
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    fail_image(std::string("damaged EXR image: ") + error.what());
  }
}

ImageSummary read_pfm_image(std::span<const std::byte> bytes, ImageWants wants, MemoryReservation& memory) {
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const size_t channels = text[1] == 'F' ? 3 : 1;
  text.remove_prefix(2);
  double header[3];
  for (double& value : header) {
    while (!text.empty() && is_space(text[0])) text.remove_prefix(1);
    const NumberText<double> number = parse_number<double>(text.substr(0, 32));
    if (number.used == 0 || number.used >= text.size())
      fail_image("damaged PFM header: expected width, height and scale");
    value = number.value;
    text.remove_prefix(number.used);
  }
  text.remove_prefix(1); // the one white-space character before the pixels
  const auto is_side = [](double v) { return v >= 1 && v <= 1 << 24 && v == std::floor(v); };
  if (!is_side(header[0]) || !is_side(header[1]))
    fail_image("damaged PFM header: width and height must be whole numbers from 1 to 16777216");
  if (!std::isfinite(header[2]) || header[2] == 0.0)
    fail_image("damaged PFM header: the scale must be finite and not 0");
  const auto width = static_cast<uint32_t>(header[0]), height = static_cast<uint32_t>(header[1]);
  ClaimedImageSize{width, height, 1}.check(bytes.size(), 0, wants, memory);
  const size_t row_bytes = static_cast<size_t>(width) * channels * 4;
  if (text.size() / row_bytes < height) fail_image(kTruncated);
  const bool swap = header[2] > 0.0;
  ImageSummarizer summarizer(width, height, wants);
  for (uint32_t y = 0; y < height; ++y) {
    const char* row = text.data() + (height - 1 - y) * row_bytes;
    for (uint32_t x = 0; x < width; ++x) {
      Vec3 pixel;
      for (size_t c = 0; c < 3; ++c) {
        uint32_t word;
        std::memcpy(&word, row + (x * channels + (channels == 3 ? c : 0)) * 4, 4);
        pixel[static_cast<int>(c)] = std::bit_cast<float>(swap ? __builtin_bswap32(word) : word);
      }
      summarizer.add(x, y, pixel);
    }
    summarizer.end_row();
  }
  return summarizer.finish();
}

} // namespace packtrace
