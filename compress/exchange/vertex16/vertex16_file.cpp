#include "compress/exchange/vertex16/vertex16_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <xxhash.h>

#include "compress/format/layout/section_file.h"
#include "compress/format/textures/texture_codec.h"
#include "pbrt_import/base/file_error.h"
#include "pbrt_import/scene/alpha_mask.h"

namespace packtrace::vertex16 {
namespace {

class Validator {
public:
  Validator(std::span<const std::byte> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  Sections run() {
    check_header();
    check_section_table();
    check_geometries();
    check_instances();
    check_materials();
    return s_;
  }

private:
  [[noreturn]] void fail(const std::string& what) const {
    throw FileError(ErrorKind::kInput, name_, "damaged vertex16 file: " + what);
  }
  void require(bool ok, const char* what, uint64_t record) const {
    if (!ok) fail(what + (" " + std::to_string(record)));
  }

  void check_header() {
    if (bytes_.size() < kMagic.size() || std::memcmp(bytes_.data(), kMagic.data(), kMagic.size()) != 0)
      throw FileError(ErrorKind::kInput, name_, "not a vertex16 file");
    if (bytes_.size() < sizeof header_) fail("truncated header");
    std::memcpy(&header_, bytes_.data(), sizeof header_);
    if (header_.version != kVersion)
      throw FileError(ErrorKind::kUnsupported, name_,
                      "vertex16 file version " + std::to_string(header_.version) + ", this program reads version " +
                          std::to_string(kVersion));
    if (header_.header_hash != XXH3_64bits(bytes_.data(), offsetof(Header, header_hash)))
      fail("header hash does not match");
    if (header_.header_bytes != sizeof header_ || header_.file_bytes != bytes_.size() ||
        header_.section_count != kSectionCount || header_.reserved != 0 ||
        header_.padding != decltype(header_.padding){})
      fail("sizes in the header");
    const XXH128_hash_t hash = XXH3_128bits(bytes_.data() + sizeof header_, bytes_.size() - sizeof header_);
    if (hash.low64 != header_.content_hash[0] || hash.high64 != header_.content_hash[1])
      fail("content hash does not match");
  }

  template <typename T>
  std::span<const T> section(Section number) const {
    const baked::SectionRecord& record = header_.sections[number];
    return {reinterpret_cast<const T*>(bytes_.data() + record.offset), static_cast<size_t>(record.bytes / sizeof(T))};
  }

  void check_section_table() {
    uint64_t end = sizeof header_;
    for (uint32_t i = 0; i < kSectionCount; ++i) {
      const baked::SectionRecord& record = header_.sections[i];
      require(record.record_bytes == kRecordBytes[i] && record.reserved == 0 && record.offset == align_section(end) &&
                  record.offset <= bytes_.size() && record.bytes <= bytes_.size() - record.offset &&
                  record.bytes % record.record_bytes == 0 && record.bytes / record.record_bytes < baked::kNone,
              "section", i);
      end = record.offset + record.bytes;
    }
    if (align_section(end) != bytes_.size()) fail("size of the file");
    s_ = {section<glm::uvec4>(kVertices),
          section<uint16_t>(kIndices16),
          section<uint32_t>(kIndices32),
          section<GeometryRecord>(kGeometries),
          section<DrawRecord>(kDraws),
          section<InstanceRecord>(kInstances),
          section<uint32_t>(kMaterialSlots),
          section<baked::MaterialRecord>(kMaterials),
          section<baked::MaskRecord>(kMasks),
          section<uint32_t>(kMaskWords),
          section<baked::TextureRecord>(kTextures),
          section<uint8_t>(kTextureBytes),
          section<char>(kStrings)};
  }

  void check_geometries() const {
    uint64_t vertices = 0, draws = 0;
    for (size_t i = 0; i < s_.geometries.size(); ++i) {
      const GeometryRecord& g = s_.geometries[i];
      require(g.first_vertex == vertices && g.first_draw == draws && g.vertex_count <= s_.vertices.size() - vertices &&
                  g.draw_count <= s_.draws.size() - draws,
              "ranges of geometry", i);
      require(g.index_bits == 16 || g.index_bits == 32, "index bits of geometry", i);
      // With this limit the sum of an origin and a field stays within int32_t.
      constexpr int64_t kLargest = (int64_t{1} << 31) - (int64_t{1} << 21);
      bool frame = std::isfinite(g.frame.step) && g.frame.step > 0.0f;
      for (int axis = 0; axis < 3; ++axis) frame = frame && std::abs(int64_t{g.frame.origin[axis]}) <= kLargest;
      for (int axis = 0; axis < 2; ++axis)
        frame = frame && std::abs(int64_t{g.frame.uv_origin[axis]}) <= kLargest &&
                std::isfinite(g.frame.uv_step[axis]) && g.frame.uv_step[axis] > 0.0f;
      require(frame, "frame of geometry", i);
      for (const float error :
           {g.max_position_error, g.max_uv_error, g.max_normal_error_degrees, g.max_tangent_error_degrees})
        require(error >= 0.0f && std::isfinite(error), "errors of geometry", i);
      for (uint32_t d = g.first_draw; d < g.first_draw + g.draw_count; ++d) check_draw(static_cast<uint32_t>(i), g, d);
      vertices += g.vertex_count, draws += g.draw_count;
    }
    if (vertices != s_.vertices.size() || draws != s_.draws.size())
      fail("vertices or draws that belong to no geometry");
  }

  void check_draw(uint32_t geometry, const GeometryRecord& g, uint32_t number) const {
    const DrawRecord& draw = s_.draws[number];
    const size_t indices = g.index_bits == 16 ? s_.indices16.size() : s_.indices32.size();
    require(draw.first_index <= indices && draw.index_count <= indices - draw.first_index && draw.index_count % 3 == 0,
            "indices of draw", number);
    require(draw.geometry == geometry && draw.vertex_offset == g.first_vertex && draw.material_slot < g.slot_count &&
                (draw.flags & ~kDrawFlags) == 0 && draw.reserved == decltype(draw.reserved){},
            "draw", number);
    for (uint32_t corner = 0; corner < draw.index_count; ++corner)
      require(s_.vertex(draw, corner) - draw.vertex_offset < g.vertex_count, "index of draw", number);
  }

  void check_instances() const {
    for (size_t i = 0; i < s_.instances.size(); ++i) {
      const InstanceRecord& instance = s_.instances[i];
      bool ok = instance.geometry < s_.geometries.size() && instance.reserved == decltype(instance.reserved){};
      for (const float f : instance.world_from_object) ok = ok && std::isfinite(f);
      require(ok, "instance", i);
      const uint32_t slots = s_.geometries[instance.geometry].slot_count;
      require(slots <= s_.material_slots.size() && instance.first_slot <= s_.material_slots.size() - slots,
              "material slots of instance", i);
    }
  }

  void check_materials() const {
    for (size_t i = 0; i < s_.material_slots.size(); ++i)
      require(s_.material_slots[i] < s_.materials.size(), "material slot", i);
    const auto mask_ok = [&](uint32_t mask) { return mask == baked::kNone || mask < s_.masks.size(); };
    for (size_t i = 0; i < s_.materials.size(); ++i) {
      const baked::MaterialRecord& m = s_.materials[i];
      require(mask_ok(m.alpha_mask) && mask_ok(m.shadow_alpha_mask) &&
                  (m.albedo_texture == baked::kNone || m.albedo_texture < s_.textures.size()) &&
                  m.name.offset <= s_.strings.size() && m.name.bytes <= s_.strings.size() - m.name.offset,
              "material", i);
    }
    for (size_t i = 0; i < s_.textures.size(); ++i)
      require(!find_texture_fault(s_.textures[i], s_.texture_bytes.size()), "texture", i);
    for (size_t i = 0; i < s_.masks.size(); ++i) {
      const baked::MaskRecord& m = s_.masks[i];
      const uint64_t words = uint64_t{AlphaMask::row_words(m.width)} * m.height;
      require(m.width > 0 && m.height > 0 && m.first_word <= s_.mask_words.size() &&
                  words <= s_.mask_words.size() - m.first_word,
              "mask", i);
    }
  }

  std::span<const std::byte> bytes_;
  const std::string& name_;
  Header header_{};
  Sections s_;
};

} // namespace

std::vector<std::byte> assemble(const Sections& s) {
  const std::array<std::span<const std::byte>, kSectionCount> parts = {
      std::as_bytes(s.vertices),       std::as_bytes(s.indices16), std::as_bytes(s.indices32),
      std::as_bytes(s.geometries),     std::as_bytes(s.draws),     std::as_bytes(s.instances),
      std::as_bytes(s.material_slots), std::as_bytes(s.materials), std::as_bytes(s.masks),
      std::as_bytes(s.mask_words),     std::as_bytes(s.textures),  std::as_bytes(s.texture_bytes),
      std::as_bytes(s.strings)};
  Header header{};
  header.magic = kMagic;
  header.version = kVersion;
  return assemble_section_file(header, parts, kRecordBytes);
}

Sections validate(std::span<const std::byte> bytes, const std::string& name) { return Validator(bytes, name).run(); }

} // namespace packtrace::vertex16
