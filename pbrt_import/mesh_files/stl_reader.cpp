#include "pbrt_import/mesh_files/stl_reader.h"

#include <bit>
#include <cstring>
#include <limits>
#include <optional>
#include <string>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/weld_table.h"
#include "pbrt_import/mesh_files/text_lines.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

constexpr const char* kNoColours = "colours of triangles are left out";
constexpr size_t kBinaryHeaderBytes = 84,
                 kRecordBytes = 50; // 80 bytes of text, a count; a normal, three corners, 16 bits

/// Triangles claimed by the header of a binary file.
uint32_t claimed_triangles(std::string_view content) {
  uint32_t count;
  std::memcpy(&count, content.data() + kBinaryHeaderBytes - sizeof count, sizeof count);
  return count;
}

/// Binary files may begin with "solid" as well, so the size decides first.
bool is_binary(std::string_view content) {
  if (content.size() >= kBinaryHeaderBytes &&
      (content.size() - kBinaryHeaderBytes) / kRecordBytes == claimed_triangles(content) &&
      (content.size() - kBinaryHeaderBytes) % kRecordBytes == 0)
    return true;
  TextLines lines(content);
  if (!lines.next()) return true;
  return lines.word().text != "solid";
}

/// Whether a record's last 16 bits, which several programs fill with colours, are not 0.
bool has_colours(std::string_view content) {
  for (size_t at = kBinaryHeaderBytes; content.size() - at >= kRecordBytes; at += kRecordBytes)
    if (content[at + kRecordBytes - 1] != 0 || content[at + kRecordBytes - 2] != 0) return true;
  return false;
}

/// Three points per triangle.
std::vector<Vec3> read_binary(std::string_view content, MemoryReservation& memory) {
  if (content.size() < kBinaryHeaderBytes)
    throw Error(ErrorKind::kInput, "neither a text that begins with \"solid\" nor long enough for a binary STL file");
  const uint32_t count = claimed_triangles(content);
  if ((content.size() - kBinaryHeaderBytes) / kRecordBytes < count)
    throw Error(ErrorKind::kInput, "the file is truncated: it is too short for the " + std::to_string(count) +
                                       " triangles that it claims");
  memory.resize(uint64_t{count} * 3 * sizeof(Vec3), "the STL file's triangles");
  std::vector<Vec3> corners(size_t{count} * 3);
  for (size_t i = 0; i < count; ++i) {
    const char* const record = content.data() + kBinaryHeaderBytes + i * kRecordBytes + sizeof(Vec3);
    std::memcpy(&corners[3 * i], record, 3 * sizeof(Vec3));
  }
  return corners;
}

/// Reads the statements of a text file.
class StlText {
public:
  StlText(std::string_view text, uint32_t file, Reporter& reporter) : lines_(text), file_(file), reporter_(reporter) {}

  std::vector<Vec3> read(MemoryReservation& memory) {
    while (lines_.next()) {
      reporter_.next_directive();
      if (corners_.size() == corners_.capacity()) {
        const size_t larger = std::max<size_t>(3072, corners_.capacity() * 2);
        memory.resize(larger * sizeof(Vec3), "the STL file's triangles");
        corners_.reserve(larger);
      }
      read_statement();
    }
    if (in_loop_ > 0) end_loop();
    return std::move(corners_);
  }

private:
  Place place(uint32_t column) const { return {file_, lines_.number(), column}; }

  void read_statement() {
    const LineWord word = lines_.word();
    if (word.text == "vertex") return read_vertex(word);
    if (word.text == "endloop" || word.text == "endfacet") return end_loop();
    for (const std::string_view known : {"solid", "endsolid", "facet", "outer"})
      if (word.text == known) return;
    if (word.text == "color") return reporter_.warning(place(word.column), kNoColours);
    reporter_.error(place(word.column), "unknown statement " + in_quotes(word.text) + "; it is ignored");
  }

  void read_vertex(const LineWord& word) {
    Vec3 corner;
    for (int i = 0; i < 3; ++i) {
      const std::optional<float> value = lines_.number_word();
      if (!value) reporter_.error(place(word.column), "vertex takes three numbers; its triangle is left out");
      corner[i] = value.value_or(std::numeric_limits<float>::quiet_NaN());
      if (!value) break;
    }
    if (++in_loop_ <= 3)
      corners_.push_back(corner);
    else
      reporter_.error(place(word.column), "a loop with more than three corners; only the first three are used");
  }

  void end_loop() {
    if (in_loop_ > 0 && in_loop_ < 3) {
      reporter_.error(place(1), "a loop with fewer than three corners; it is left out");
      corners_.resize(corners_.size() - in_loop_);
    }
    in_loop_ = 0;
  }

  TextLines lines_;
  uint32_t file_;
  Reporter& reporter_;
  std::vector<Vec3> corners_;
  uint32_t in_loop_ = 0; ///< corners of the current loop
};

uint64_t hash_of(const Vec3& point) {
  const auto bits = [](float v) { return uint64_t{std::bit_cast<uint32_t>(v + 0.0f)}; }; // -0 becomes 0
  return mix_words(bits(point.x), bits(point.y), bits(point.z));
}

} // namespace

void read_stl(const std::filesystem::path& file, uint32_t file_number, const MeshFileContext& context) {
  DirectiveFeed& feed = context.feed;
  const PaddedText content = read_padded(file, context);
  context.progress.begin("reading the STL file", 0);
  MemoryReservation memory(context.options.memory);
  const bool binary = is_binary(content.text);
  const std::vector<Vec3> corners =
      binary ? read_binary(content.text, memory) : StlText(content.text, file_number, feed.reporter()).read(memory);
  if (binary && has_colours(content.text)) feed.reporter().warning({file_number, 0, 0}, kNoColours);
  if (corners.size() > static_cast<size_t>(std::numeric_limits<int32_t>::max()))
    throw Error(ErrorKind::kLimitExceeded, "the file has more than 2^31 - 1 corners");
  memory.resize(memory.bytes() + corners.size() * (5 * sizeof(uint32_t) + sizeof(Vec3)),
                "welding the STL file's corners");
  WeldTable table(corners.size());
  std::vector<Vec3> points;
  std::vector<int32_t> indices(corners.size());
  for (size_t i = 0; i < corners.size(); ++i) {
    const uint32_t number = table.find_or_add(hash_of(corners[i]), static_cast<uint32_t>(points.size()),
                                              [&](uint32_t n) { return points[n] == corners[i]; });
    if (number == points.size()) points.push_back(corners[i]);
    indices[i] = static_cast<int32_t>(number);
  }
  context.progress.check_cancelled();
  feed.begin("Shape", {file_number, 1, 1}, {"trianglemesh"});
  feed.floats(ParameterType::kPoint3, "P", {points.empty() ? nullptr : &points.data()->x, points.size() * 3});
  feed.integers("indices", indices);
  feed.send();
}

} // namespace packtrace
