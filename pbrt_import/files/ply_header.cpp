#include "pbrt_import/files/ply_header.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "pbrt_import/base/error.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

std::optional<PlyType> type_named(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, PlyType>, 16> kNames{{
      {"char", PlyType::kInt8},
      {"int8", PlyType::kInt8},
      {"uchar", PlyType::kUint8},
      {"uint8", PlyType::kUint8},
      {"short", PlyType::kInt16},
      {"int16", PlyType::kInt16},
      {"ushort", PlyType::kUint16},
      {"uint16", PlyType::kUint16},
      {"int", PlyType::kInt32},
      {"int32", PlyType::kInt32},
      {"uint", PlyType::kUint32},
      {"uint32", PlyType::kUint32},
      {"float", PlyType::kFloat32},
      {"float32", PlyType::kFloat32},
      {"double", PlyType::kFloat64},
      {"float64", PlyType::kFloat64},
  }};
  for (const auto& [known, type] : kNames)
    if (known == name) return type;
  return std::nullopt;
}

/// Splits the header into lines, and lines into words.
class HeaderReader {
public:
  explicit HeaderReader(std::span<const std::byte> bytes)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()) {}

  /// Moves to the next line and splits it into words.
  void next_line() {
    ++line_;
    const size_t length = std::min(text_.find_first_of("\r\n", offset_), text_.size()) - offset_;
    if (offset_ + length == text_.size()) fail("the file ends inside the header");
    split(text_.substr(offset_, length));
    offset_ += length;
    const bool cr = text_[offset_++] == '\r';
    const bool lf_follows = offset_ < text_.size() && text_[offset_] == '\n';
    if (line_ == 1) bare_cr_ = cr && !lf_follows;
    // If lines end in a bare CR, an LF after the one of end_header is the first byte of the data.
    if (cr && lf_follows && !bare_cr_) ++offset_;
  }

  const std::vector<std::string_view>& words() const { return words_; }
  std::string_view word(size_t i) const { return i < words_.size() ? words_[i] : std::string_view(); }
  size_t offset() const { return offset_; }

  [[noreturn]] void fail(std::string_view problem) const {
    throw Error(ErrorKind::kInput, "line " + std::to_string(line_) + ": " + std::string(problem));
  }
  PlyType type(size_t i) const {
    const auto type = type_named(word(i));
    if (!type) fail("unknown type " + in_quotes(word(i)));
    return *type;
  }

private:
  void split(std::string_view line) {
    words_.clear();
    constexpr std::string_view kBlanks = " \t";
    for (size_t begin = line.find_first_not_of(kBlanks); begin != line.npos;) {
      const size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
      words_.push_back(line.substr(begin, end - begin));
      begin = line.find_first_not_of(kBlanks, end);
    }
  }

  std::string_view text_;
  size_t offset_ = 0;
  uint32_t line_ = 0;
  bool bare_cr_ = false;
  std::vector<std::string_view> words_;
};

PlyFormat read_format(const HeaderReader& reader) {
  if (reader.words().size() != 3 || reader.word(2) != "1.0") reader.fail("expected 'format NAME 1.0'");
  const std::string_view name = reader.word(1);
  if (name == "ascii") return PlyFormat::kAscii;
  if (name == "binary_little_endian") return PlyFormat::kLittleEndian;
  if (name == "binary_big_endian") return PlyFormat::kBigEndian;
  reader.fail("unknown format " + in_quotes(name));
}

PlyElement read_element(const HeaderReader& reader) {
  PlyElement element;
  const std::string_view digits = reader.word(2);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), element.count);
  if (reader.words().size() != 3 || error != std::errc() || end != digits.data() + digits.size())
    reader.fail("expected 'element NAME COUNT'");
  element.name = reader.word(1);
  return element;
}

PlyProperty read_property(const HeaderReader& reader) {
  PlyProperty property;
  if (reader.word(1) == "list") {
    if (reader.words().size() != 5) reader.fail("expected 'property list TYPE TYPE NAME'");
    property.length_type = reader.type(2);
    if (*property.length_type == PlyType::kFloat32 || *property.length_type == PlyType::kFloat64)
      reader.fail("the length of a list must have an integer type");
    property.type = reader.type(3);
    property.name = reader.word(4);
  } else {
    if (reader.words().size() != 3) reader.fail("expected 'property TYPE NAME'");
    property.type = reader.type(1);
    property.name = reader.word(2);
  }
  return property;
}

} // namespace

uint64_t PlyElement::fixed_row_bytes() const {
  uint64_t sum = 0;
  for (const PlyProperty& property : properties) sum += byte_size(property.length_type.value_or(property.type));
  return sum;
}

bool PlyElement::has_lists() const {
  return std::any_of(properties.begin(), properties.end(), [](const PlyProperty& p) { return !!p.length_type; });
}

std::optional<size_t> PlyElement::find(std::string_view property_name, bool is_list) const {
  for (size_t i = 0; i < properties.size(); ++i)
    if (properties[i].name == property_name && properties[i].length_type.has_value() == is_list) return i;
  return std::nullopt;
}

const PlyElement* PlyHeader::find(std::string_view element_name) const {
  const auto found =
      std::find_if(elements.begin(), elements.end(), [&](const PlyElement& e) { return e.name == element_name; });
  return found == elements.end() ? nullptr : &*found;
}

PlyHeader parse_ply_header(std::span<const std::byte> bytes) {
  if (bytes.size() < 4 || bytes[0] != std::byte{'p'} || bytes[1] != std::byte{'l'} || bytes[2] != std::byte{'y'})
    throw Error(ErrorKind::kInput, "not a PLY file: it does not begin with 'ply'");
  HeaderReader reader(bytes);
  reader.next_line();
  if (reader.words().size() != 1 || reader.word(0) != "ply") reader.fail("not a PLY file: expected 'ply' alone");
  PlyHeader header;
  bool has_format = false;
  while (true) {
    reader.next_line();
    const std::string_view keyword = reader.word(0);
    if (keyword.empty() || keyword == "comment" || keyword == "obj_info") continue;
    if (keyword == "end_header") break;
    if (keyword == "format") {
      if (std::exchange(has_format, true)) reader.fail("second 'format'");
      header.format = read_format(reader);
    } else if (keyword == "element") {
      header.elements.push_back(read_element(reader));
    } else if (keyword == "property") {
      if (header.elements.empty()) reader.fail("'property' before any 'element'");
      header.elements.back().properties.push_back(read_property(reader));
    } else {
      reader.fail("unknown keyword " + in_quotes(keyword));
    }
  }
  if (!has_format) reader.fail("the header has no 'format'");
  header.body_offset = reader.offset();
  return header;
}

} // namespace packtrace
