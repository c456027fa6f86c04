#include "pbrt_import/base/exr_header.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <set>
#include <utility>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr uint32_t kMagic = 20000630;
constexpr uint32_t kVersion = 2, kTiledFlag = 0x200, kLongNamesFlag = 0x400, kDeepFlag = 0x800, kMultiPartFlag = 0x1000;
constexpr size_t kMaxNameBytes = 255;
constexpr const char* kTruncated = "the file is truncated";

/// Attribute types of fixed size. OpenEXR reads as many bytes as the type implies, regardless of the size in the file.
constexpr std::pair<std::string_view, uint32_t> kFixedSizes[] = {{"box2f", 16},
                                                                 {"box2i", 16},
                                                                 {"chromaticities", 32},
                                                                 {"compression", 1},
                                                                 {"deepImageState", 1},
                                                                 {"double", 8},
                                                                 {"envmap", 1},
                                                                 {"float", 4},
                                                                 {"int", 4},
                                                                 {"keycode", 28},
                                                                 {"lineOrder", 1},
                                                                 {"m33d", 72},
                                                                 {"m33f", 36},
                                                                 {"m44d", 128},
                                                                 {"m44f", 64},
                                                                 {"rational", 8},
                                                                 {"tiledesc", 9},
                                                                 {"timecode", 8},
                                                                 {"v2d", 16},
                                                                 {"v2f", 8},
                                                                 {"v2i", 8},
                                                                 {"v3d", 24},
                                                                 {"v3f", 12},
                                                                 {"v3i", 12}};

/// Lines per block, by compression: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB.
constexpr std::array<uint32_t, 10> kBlockLines{1, 1, 1, 16, 32, 16, 32, 32, 32, 256};

/// Sequential reader of bytes, with bounds checks.
class Cursor {
public:
  Cursor(std::span<const std::byte> bytes, const std::string& complaint) : bytes_(bytes), complaint_(complaint) {}

  [[noreturn]] void damaged(const std::string& what) const { throw Error(ErrorKind::kInput, complaint_ + what); }
  size_t left() const { return bytes_.size(); }

  Cursor take(size_t count) {
    if (count > bytes_.size()) damaged(kTruncated);
    const Cursor taken(bytes_.first(count), complaint_);
    bytes_ = bytes_.subspan(count);
    return taken;
  }
  uint32_t u8() { return std::to_integer<uint32_t>(take(1).bytes_[0]); }
  uint32_t u32() {
    const Cursor four = take(4);
    uint32_t value = 0;
    for (size_t i = 0; i < 4; ++i) value |= std::to_integer<uint32_t>(four.bytes_[i]) << (8 * i);
    return value;
  }
  std::string_view name() {
    const size_t longest = std::min(bytes_.size(), kMaxNameBytes + 1);
    const std::string_view text(reinterpret_cast<const char*>(bytes_.data()), longest);
    const size_t length = text.find('\0');
    if (length == text.npos) damaged(longest > kMaxNameBytes ? "a name in its header does not end" : kTruncated);
    take(length + 1);
    return text.substr(0, length);
  }

private:
  std::span<const std::byte> bytes_;
  const std::string& complaint_;
};

std::vector<ExrChannelHeader> read_channels(Cursor value) {
  std::vector<ExrChannelHeader> channels;
  for (std::string_view name = value.name(); !name.empty(); name = value.name()) {
    const uint32_t type = value.u32();
    value.take(4); // perceptual linearity, padding
    ExrChannelHeader channel{std::string(name), type == 1 ? 2u : 4u, value.u32(), value.u32()};
    constexpr uint32_t kTypes = 3; // uint, half, float
    if (type >= kTypes || channel.x_sampling - 1 >= INT32_MAX || channel.y_sampling - 1 >= INT32_MAX)
      value.damaged("impossible channel \"" + channel.name + "\"");
    channels.push_back(std::move(channel));
  }
  if (value.left() > 0) value.damaged("its list of channels ends early");
  return channels;
}

/// Checks attributes whose size depends on their content.
void check_variable_size(std::string_view type, Cursor value) {
  if (type == "stringvector") {
    while (value.left() > 0) {
      const uint32_t length = value.u32();
      if (length > value.left()) value.damaged("a string is larger than its attribute");
      value.take(length);
    }
  } else if (type == "floatvector") {
    if (value.left() % 4 != 0) value.damaged("a list of numbers has a wrong size");
  } else if (type == "preview") {
    const uint64_t width = value.u32(), height = value.u32();
    if (width > INT32_MAX || height > INT32_MAX || width * height != value.left() / 4 || value.left() % 4 != 0)
      value.damaged("its preview image has a wrong size");
  } else if (type == "chlist") { // OpenEXR reads channels of any attribute up to an empty name, not up to the size
    read_channels(value);
  } else if (type == "idmanifest") {
    value.u32();
  }
}

void check_size(std::string_view type, const Cursor& value) {
  for (const auto& [name, bytes] : kFixedSizes)
    if (type == name && value.left() != bytes)
      value.damaged("an attribute of type " + std::string(type) + " has " + std::to_string(value.left()) + " bytes");
  check_variable_size(type, value);
}

/// Reads all attributes and extracts the relevant ones.
class Attributes {
public:
  ExrHeader read(Cursor& file, bool tiled) {
    for (std::string_view name = file.name(); !name.empty(); name = file.name()) {
      const std::string_view type = file.name();
      const uint32_t bytes = file.u32();
      if (bytes > file.left()) file.damaged(kTruncated);
      const Cursor value = file.take(bytes);
      check_size(type, value);
      read_value(name, type, value);
    }
    for (const char* const name : {"channels", "compression", "dataWindow"})
      if (!seen_.contains(name)) file.damaged("its header has no attribute " + std::string(name));
    if (tiled && !seen_.contains("tiles")) file.damaged("its header has no attribute tiles");
    if (!tiled) header_.tile_width = header_.tile_height = 0;
    if (tiled) header_.block_lines = 0;
    return std::move(header_);
  }

private:
  void read_value(std::string_view name, std::string_view type, Cursor value) {
    if (name != "channels" && name != "compression" && name != "dataWindow" && name != "tiles") return;
    const std::string_view wanted = name == "channels"     ? "chlist"
                                    : name == "dataWindow" ? "box2i"
                                    : name == "tiles"      ? "tiledesc"
                                                           : "compression";
    if (type != wanted) value.damaged("attribute " + std::string(name) + " has type " + std::string(type));
    if (!seen_.insert(std::string(name)).second)
      value.damaged("its header has attribute " + std::string(name) + " twice");
    if (name == "channels") {
      header_.channels = read_channels(value);
    } else if (name == "compression") {
      const uint32_t compression = value.u8();
      if (compression >= kBlockLines.size()) value.damaged("unknown compression");
      header_.block_lines = kBlockLines[compression];
    } else if (name == "dataWindow") {
      for (int32_t* const side : {&header_.min_x, &header_.min_y, &header_.max_x, &header_.max_y})
        *side = std::bit_cast<int32_t>(value.u32());
    } else {
      header_.tile_width = value.u32();
      header_.tile_height = value.u32();
      if (header_.tile_width - 1 >= INT32_MAX || header_.tile_height - 1 >= INT32_MAX)
        value.damaged("impossible size of tiles");
    }
  }

  ExrHeader header_;
  std::set<std::string> seen_;
};

constexpr uint64_t blocks(uint64_t size, uint64_t block) { return (size + block - 1) / block; }

} // namespace

uint64_t ExrHeader::pixel_bytes() const {
  uint64_t bytes = 0;
  for (const ExrChannelHeader& channel : channels) bytes += channel.sample_bytes;
  return bytes;
}

uint64_t ExrHeader::block_bytes() const {
  const uint64_t columns = tile_width > 0 ? blocks(width(), tile_width) * tile_width : width();
  const uint64_t lines = tile_width > 0 ? tile_height : block_lines;
  const uint64_t pixels = columns * lines; // no overflow: 33 and 31 bits
  const uint64_t each = std::max<uint64_t>(pixel_bytes(), 1);
  return pixels > std::numeric_limits<uint64_t>::max() / each ? std::numeric_limits<uint64_t>::max() : pixels * each;
}

std::string_view unsupported_exr_kind(std::span<const std::byte> bytes) {
  uint32_t words[2];
  if (bytes.size() < sizeof words) return {};
  std::memcpy(words, bytes.data(), sizeof words);
  const auto [magic, version] = words;
  if (magic != kMagic) return {};
  if ((version & kMultiPartFlag) != 0) return "multi-part EXR files are not supported";
  if ((version & kDeepFlag) != 0) return "deep EXR files are not supported";
  if ((version & 0xff) != kVersion || (version & ~(0xffu | kTiledFlag | kLongNamesFlag)) != 0)
    return "unknown version of the EXR format";
  return {};
}

ExrHeader scan_exr_header(std::span<const std::byte> bytes, const std::string& complaint) {
  Cursor file(bytes, complaint);
  if (file.u32() != kMagic) file.damaged("its first bytes are not those of an EXR file");
  const uint32_t version = file.u32();
  ExrHeader header = Attributes().read(file, (version & kTiledFlag) != 0);
  // The offset table follows, with one entry per block, even in files with missing blocks.
  const bool tiled = header.tile_width > 0;
  const uint64_t columns = tiled ? blocks(header.width(), header.tile_width) : 1;
  const uint64_t rows = blocks(header.height(), tiled ? header.tile_height : header.block_lines);
  if (columns > 0 && rows > file.left() / 8 / columns) file.damaged(kTruncated);
  return header;
}

} // namespace packtrace
