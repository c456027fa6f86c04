#include "pbrt_import/files/radiance.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>

#include "pbrt_import/base/error.h"
#include "pbrt_import/text/number.h"

namespace packtrace {
namespace {

[[noreturn]] void damaged(const std::string& what) { throw Error(ErrorKind::kInput, "damaged image: " + what); }

/// Only rows with widths in this range can be run-length encoded per component.
constexpr uint32_t kMinPlaneWidth = 8, kMaxPlaneWidth = 0x7fff;

std::string_view take_line(std::string_view& text) {
  const size_t end = text.find('\n');
  if (end == text.npos) damaged("the file is truncated");
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end + 1);
  return line.ends_with('\r') ? line.substr(0, end - 1) : line;
}

std::string_view take_word(std::string_view& line) {
  while (!line.empty() && is_space(line[0])) line.remove_prefix(1);
  size_t length = 0;
  while (length < line.size() && !is_space(line[length])) ++length;
  const std::string_view word = line.substr(0, length);
  line.remove_prefix(length);
  return word;
}

uint32_t side_of(std::string_view word) {
  const NumberText<double> number = parse_number<double>(word);
  if (number.used == 0 || number.used != word.size() || !(number.value >= 1 && number.value <= 1 << 24) ||
      number.value != std::floor(number.value))
    damaged("width and height must be whole numbers from 1 to 16777216");
  return static_cast<uint32_t>(number.value);
}

Vec3 linear_from_rgbe(const uint8_t* rgbe) {
  if (rgbe[3] == 0) return Vec3(0.0f);
  const float scale = std::ldexp(1.0f, int{rgbe[3]} - (128 + 8));
  return Vec3(rgbe[0], rgbe[1], rgbe[2]) * scale;
}

} // namespace

RadianceReader::RadianceReader(std::span<const std::byte> bytes) {
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (std::string_view line = take_line(text); !line.empty(); line = take_line(text))
    if (line.starts_with("FORMAT=") && line != "FORMAT=32-bit_rle_rgbe")
      throw Error(ErrorKind::kInput, "HDR images other than FORMAT=32-bit_rle_rgbe are not read");
  std::string_view line = take_line(text);
  const std::string_view y = take_word(line), height = take_word(line), x = take_word(line), width = take_word(line);
  if (y != "-Y" || x != "+X")
    throw Error(ErrorKind::kInput, "HDR images that are not stored from the top left (-Y, +X) are not read");
  width_ = side_of(width);
  height_ = side_of(height);
  left_ = bytes.last(text.size());
}

std::span<const std::byte> RadianceReader::take(size_t count) {
  if (count > left_.size()) damaged("the file is truncated");
  const std::span<const std::byte> taken = left_.first(count);
  left_ = left_.subspan(count);
  return taken;
}

/// Decodes the newer encoding: red, green, blue and exponent of the whole row one after the other, each in runs.
void RadianceReader::read_planes() {
  for (size_t plane = 0; plane < 4; ++plane)
    for (uint32_t x = 0; x < width_;) {
      const auto code = std::to_integer<uint32_t>(take(1)[0]);
      const bool repeated = code > 128;
      const uint32_t count = repeated ? code - 128 : code;
      if (count == 0 || count > width_ - x) damaged("a run does not fit its row");
      const std::span<const std::byte> values = take(repeated ? 1 : count);
      for (uint32_t i = 0; i < count; ++i)
        rgbe_[4 * size_t{x++} + plane] = std::to_integer<uint8_t>(values[repeated ? 0 : i]);
    }
}

/// Decodes the older encoding: whole pixels, where (1, 1, 1, n) repeats the last pixel n times. Each such code directly
/// after another counts 256 times more.
void RadianceReader::read_pixels() {
  uint32_t shift = 0;
  for (uint32_t x = 0; x < width_;) {
    uint8_t* const pixel = rgbe_.data() + 4 * size_t{x};
    std::memcpy(pixel, take(4).data(), 4);
    if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
      shift = 0;
      ++x;
      continue;
    }
    if (x == 0 || shift > 16) damaged("a run does not fit its row");
    const uint32_t count = uint32_t{pixel[3]} << shift;
    if (count > width_ - x) damaged("a run does not fit its row");
    for (uint32_t i = 0; i < count; ++i, ++x) std::memcpy(&rgbe_[4 * size_t{x}], &rgbe_[4 * size_t{x} - 4], 4);
    shift += 8;
  }
}

std::span<const Vec3> RadianceReader::read_row() {
  rgbe_.resize(4 * size_t{width_});
  row_.resize(width_);
  const auto at = [&](size_t i) { return i < left_.size() ? std::to_integer<uint32_t>(left_[i]) : 0u; };
  if (width_ >= kMinPlaneWidth && width_ <= kMaxPlaneWidth && at(0) == 2 && at(1) == 2 && at(2) < 128) {
    if ((at(2) << 8 | at(3)) != width_) damaged("a row has a different width");
    take(4);
    read_planes();
  } else {
    read_pixels();
  }
  for (size_t x = 0; x < width_; ++x) row_[x] = linear_from_rgbe(&rgbe_[4 * x]);
  return row_;
}

} // namespace packtrace
