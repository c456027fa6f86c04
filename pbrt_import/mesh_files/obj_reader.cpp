#include "pbrt_import/mesh_files/obj_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <tuple>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/weld_table.h"
#include "pbrt_import/mesh_files/obj_materials.h"
#include "pbrt_import/mesh_files/polygon.h"
#include "pbrt_import/mesh_files/text_lines.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

constexpr int32_t kNoIndex = -1;

/// A corner of a face: indices from 0 into the file's positions, texture coordinates and normals.
struct Corner {
  int32_t position = kNoIndex, uv = kNoIndex, normal = kNoIndex;
  bool operator==(const Corner&) const = default;
};

/// Faces of one object and material with the same attributes.
struct FaceGroup {
  uint32_t material = ObjMaterials::kDefault;
  bool has_uvs = false, has_normals = false;
  Place place;                 ///< of the first face
  std::vector<Corner> corners; ///< three per triangle
};

/// Numbers of statements, counted before reading so that memory is reserved once.
struct ObjCounts {
  uint64_t positions = 0, uvs = 0, normals = 0;
};

/// Counts lines that begin with v, vt and vn.
ObjCounts count_statements(std::string_view text) {
  ObjCounts counts;
  bool line_start = true;
  for (size_t i = 0; i + 2 < text.size(); ++i) {
    const char c = text[i];
    if (line_start && c == 'v') {
      const char next = text[i + 1], after = text[i + 2];
      const auto blank = [](char b) { return b == ' ' || b == '\t'; };
      counts.positions += blank(next);
      counts.uvs += next == 't' && blank(after);
      counts.normals += next == 'n' && blank(after);
    }
    if (c != ' ' && c != '\t') line_start = c == '\n' || c == '\r';
    if (line_start || c == ' ' || c == '\t') continue;
    const size_t end = text.find_first_of("\n\r", i); // the rest of the line does not matter
    if (end == std::string_view::npos) break;
    i = end - 1;
  }
  return counts;
}

class ObjReader {
public:
  ObjReader(const std::filesystem::path& file, uint32_t number, const MeshFileContext& context)
      : context_(context), reporter_(context.feed.reporter()), folder_(std::filesystem::absolute(file).parent_path()),
        number_(number), content_(read_padded(file, context)), lines_(content_.text), memory_(context.options.memory) {}

  void read() {
    reserve();
    context_.progress.begin("reading the OBJ file", content_.text.size());
    uint64_t reported = 0;
    for (uint32_t count = 0; lines_.next(); ++count) {
      reporter_.next_directive();
      read_statement();
      if (count % 4096 != 0) continue;
      context_.progress.check_cancelled();
      context_.progress.advance(lines_.position() - reported);
      reported = lines_.position();
    }
    materials_.define(context_);
    for (FaceGroup& group : groups_) {
      context_.progress.check_cancelled();
      add_shape(group);
      group.corners = {};
    }
  }

private:
  Place place(uint32_t column = 1) const { return {number_, lines_.number(), column}; }
  void error(const std::string& problem) { reporter_.error(place(), problem); }

  void reserve() {
    const ObjCounts counts = count_statements(content_.text);
    constexpr auto kMaxCount = static_cast<uint64_t>(std::numeric_limits<int32_t>::max());
    if (counts.positions > kMaxCount || counts.uvs > kMaxCount || counts.normals > kMaxCount)
      throw Error(ErrorKind::kLimitExceeded, "the file has more than 2^31 - 1 vertices");
    count_memory((counts.positions + counts.normals) * sizeof(Vec3) + counts.uvs * sizeof(Vec2));
    positions_.reserve(counts.positions);
    uvs_.reserve(counts.uvs);
    normals_.reserve(counts.normals);
  }

  void count_memory(uint64_t bytes) {
    counted_ += bytes;
    constexpr uint64_t kStep = 4u << 20;
    if (counted_ > memory_.bytes()) memory_.resize(counted_ + kStep, "the OBJ file's faces");
  }

  void read_statement() {
    const LineWord keyword = lines_.word();
    const std::string_view word = keyword.text;
    if (word == "v") {
      read_vector(positions_, "v", 3);
      if (const LineWord more = lines_.peek(); !more.text.empty()) report_colour(more);
      return;
    }
    if (word == "vt") return read_vector(uvs_, "vt", 1);
    if (word == "vn") return read_vector(normals_, "vn", 3);
    if (word == "f" || word == "fo") return read_face();
    if (word == "o") {
      ++object_, last_group_ = nullptr;
      return;
    }
    if (word == "usemtl") {
      const std::string_view name = lines_.rest();
      material_ = materials_.find(name, place(), reporter_);
      last_group_ = nullptr;
      return;
    }
    if (word == "mtllib") return materials_.read_library(lines_.rest(), place(), folder_, context_);
    read_other(keyword);
  }

  /// A fourth number is a weight, which only curves have; colours have three more.
  void report_colour(const LineWord& fourth) {
    lines_.number_word();
    if (lines_.number_word()) reporter_.warning(place(fourth.column), "colours of vertices are left out");
  }

  void read_other(const LineWord& keyword) {
    using namespace std::string_view_literals;
    const auto is_any_of = [&](auto... names) { return ((keyword.text == names) || ...); };
    if (is_any_of("g"sv, "lod"sv, "mg"sv, "bevel"sv, "c_interp"sv, "d_interp"sv, "shadow_obj"sv, "trace_obj"sv))
      return; // neither geometry nor material
    if (is_any_of("maplib"sv, "usemap"sv)) return reporter_.warning(place(), in_quotes(keyword.text) + " is left out");
    if (keyword.text == "s") {
      const std::string_view group = lines_.rest();
      smooth_ = group == "off" || group == "0" || group.empty() ? Place{} : place();
      return;
    }
    if (is_any_of("p"sv, "l"sv))
      return reporter_.warning(place(), "points and lines have no surface; they are left out");
    if (is_any_of("vp"sv, "cstype"sv, "deg"sv, "bmat"sv, "step"sv, "curv"sv, "curv2"sv, "surf"sv, "parm"sv, "trim"sv,
                  "hole"sv, "scrv"sv, "sp"sv, "end"sv, "con"sv, "ctech"sv, "stech"sv))
      return error("free-form curves and surfaces are not supported; they are left out");
    reporter_.error(place(keyword.column), "unknown statement " + in_quotes(keyword.text) + "; it is ignored");
  }

  /// Reads a position, texture coordinate or normal. A malformed one keeps its number, because faces count them, and
  /// has no finite place, so that its triangles are left out.
  template <class Vector>
  void read_vector(std::vector<Vector>& vectors, std::string_view keyword, int required) {
    constexpr int kSize = static_cast<int>(sizeof(Vector) / sizeof(float));
    if (vectors.size() == vectors.capacity()) // a continued or indented line was not counted
      count_memory((vectors.size() + 1) * sizeof(Vector));
    Vector& vector = vectors.emplace_back(0.0f);
    for (int i = 0; i < kSize; ++i) {
      const std::optional<float> value = lines_.number_word();
      if (value) {
        vector[i] = *value;
        continue;
      }
      if (i >= required && lines_.peek().text.empty()) return; // vt u
      const LineWord found = lines_.peek();
      reporter_.error(place(std::max(found.column, 1u)),
                      std::string(keyword) + " takes " + std::to_string(kSize) + " numbers" +
                          (found.text.empty() ? "" : ", found " + in_quotes(found.text)) +
                          "; the faces that use it are left out");
      vector = Vector(std::numeric_limits<float>::quiet_NaN());
      return;
    }
  }

  /// Reads an index at the start of a word, which may be negative: from the end of what was read so far.
  /// @return false if it is not an index of one of `count` elements
  static bool read_index(std::string_view& text, size_t count, int32_t& index) {
    int64_t value = 0;
    const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (problem != std::errc() || value == 0) return false;
    text.remove_prefix(static_cast<size_t>(end - text.data()));
    const auto size = static_cast<int64_t>(count);
    const int64_t from_zero = value > 0 ? value - 1 : size + value;
    if (from_zero < 0 || from_zero >= size) return false;
    index = static_cast<int32_t>(from_zero);
    return true;
  }

  /// Reads "position", "position/uv", "position//normal" or "position/uv/normal".
  bool read_corner(std::string_view text, Corner& corner) const {
    if (!read_index(text, positions_.size(), corner.position)) return false;
    if (text.empty()) return true;
    if (text[0] != '/') return false;
    text.remove_prefix(1);
    if (!text.empty() && text[0] != '/' && !read_index(text, uvs_.size(), corner.uv)) return false;
    if (text.empty()) return true;
    if (text[0] != '/') return false;
    text.remove_prefix(1);
    return text.empty() || (read_index(text, normals_.size(), corner.normal) && text.empty());
  }

  void read_face() {
    face_.clear();
    bool uvs = true, normals = true;
    for (LineWord word = lines_.word(); !word.text.empty(); word = lines_.word()) {
      Corner corner;
      if (!read_corner(word.text, corner))
        return reporter_.error(place(word.column), "a face with a corner that is not defined before it, or not a "
                                                   "number; the face is left out");
      uvs = uvs && corner.uv != kNoIndex;
      normals = normals && corner.normal != kNoIndex;
      face_.push_back(corner);
    }
    if (face_.size() < 3) return error("a face with fewer than three corners; it is left out");
    FaceGroup& group = find_group(uvs, normals);
    points_.clear();
    for (Corner& corner : face_) {
      if (!uvs) corner.uv = kNoIndex;
      if (!normals) corner.normal = kNoIndex;
      points_.push_back(positions_[static_cast<size_t>(corner.position)]);
    }
    triangles_.clear();
    triangulate_polygon(points_, triangles_);
    const size_t needed = group.corners.size() + 3 * triangles_.size();
    if (needed > group.corners.capacity()) {
      const size_t larger = std::max(needed, group.corners.capacity() * 2);
      count_memory(larger * sizeof(Corner));
      group.corners.reserve(larger);
    }
    for (const auto& triangle : triangles_)
      for (const uint32_t i : triangle) group.corners.push_back(face_[i]);
  }

  FaceGroup& find_group(bool uvs, bool normals) {
    if (last_group_ && last_group_->has_uvs == uvs && last_group_->has_normals == normals) return *last_group_;
    const auto [found, added] =
        group_numbers_.try_emplace({object_, material_, uvs, normals}, static_cast<uint32_t>(groups_.size()));
    if (added) groups_.push_back({material_, uvs, normals, place(), {}});
    if (added && !normals && smooth_.line > 0)
      reporter_.warning(smooth_, "smoothing groups are left out: faces without normals are flat");
    last_group_ = &groups_[found->second];
    return *last_group_;
  }

  void add_shape(FaceGroup& group) {
    DirectiveFeed& feed = context_.feed;
    const size_t count = group.corners.size();
    MemoryReservation memory(context_.options.memory);
    memory.resize(count * (4 * sizeof(uint32_t) + sizeof(Corner) + 8 * sizeof(float)), "welding the OBJ file's faces");
    std::vector<int32_t> indices(count);
    std::vector<Corner> distinct;
    WeldTable table(count);
    for (size_t i = 0; i < count; ++i) {
      const Corner& corner = group.corners[i];
      const auto word = [](int32_t index) { return static_cast<uint64_t>(static_cast<uint32_t>(index)); };
      const uint32_t number =
          table.find_or_add(mix_words(word(corner.position), word(corner.uv), word(corner.normal)),
                            static_cast<uint32_t>(distinct.size()), [&](uint32_t n) { return distinct[n] == corner; });
      if (number == distinct.size()) distinct.push_back(corner);
      indices[i] = static_cast<int32_t>(number);
    }
    feed.with_attributes(group.place, [&] {
      materials_.use(group.material, group.place, feed);
      feed.begin("Shape", group.place, {"trianglemesh"});
      add_attribute(distinct, positions_, &Corner::position, ParameterType::kPoint3, "P");
      if (group.has_normals) add_attribute(distinct, normals_, &Corner::normal, ParameterType::kNormal, "N");
      if (group.has_uvs) add_attribute(distinct, uvs_, &Corner::uv, ParameterType::kFloat, "uv");
      feed.integers("indices", indices);
      materials_.add_opacity(group.material, feed);
      feed.send();
    });
  }

  template <class Vector>
  void add_attribute(const std::vector<Corner>& corners, const std::vector<Vector>& values, int32_t Corner::* index,
                     ParameterType type, std::string_view name) {
    std::vector<Vector> picked(corners.size());
    for (size_t i = 0; i < corners.size(); ++i) picked[i] = values[static_cast<size_t>(corners[i].*index)];
    context_.feed.floats(type, name, {&picked.data()->x, picked.size() * (sizeof(Vector) / sizeof(float))});
  }

  const MeshFileContext& context_;
  Reporter& reporter_;
  std::filesystem::path folder_;
  uint32_t number_;
  PaddedText content_;
  TextLines lines_;
  MemoryReservation memory_;
  uint64_t counted_ = 0; ///< bytes
  std::vector<Vec3> positions_, normals_;
  std::vector<Vec2> uvs_;
  ObjMaterials materials_;
  std::deque<FaceGroup> groups_;
  std::map<std::tuple<uint32_t, uint32_t, bool, bool>, uint32_t> group_numbers_; ///< by object, material, attributes
  FaceGroup* last_group_ = nullptr;
  Place smooth_; ///< of the current smoothing group; line 0: none
  uint32_t object_ = 0, material_ = ObjMaterials::kDefault;
  std::vector<Corner> face_; ///< scratch buffers
  std::vector<Vec3> points_;
  std::vector<std::array<uint32_t, 3>> triangles_;
};

} // namespace

void read_obj(const std::filesystem::path& file, uint32_t file_number, const MeshFileContext& context) {
  ObjReader(file, file_number, context).read();
}

} // namespace packtrace
