#include "compress/format/file/section_table.h"

#include <cstring>

#include <xxhash.h>

#include "compress/format/layout/bit_stream.h"
#include "pbrt_import/base/file_error.h"

namespace packtrace {
namespace {

class SectionTable {
public:
  SectionTable(std::span<const std::byte> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  BakedSections read() {
    check_header();
    check_table();
    const BakedSections found = sections();
    check_counts(found);
    if (!zero_between_sections()) fail("nonzero bytes between sections");
    return found;
  }

private:
  [[noreturn]] void fail(const std::string& what) const { fail_damaged(name_, what); }

  void check_header() {
    if (bytes_.size() < sizeof(baked::FileHeader)) {
      if (bytes_.size() < baked::kMagic.size() ||
          std::memcmp(bytes_.data(), baked::kMagic.data(), baked::kMagic.size()) != 0)
        throw FileError(ErrorKind::kInput, name_, "not a packtrace baked file");
      fail("truncated header");
    }
    std::memcpy(&header_, bytes_.data(), sizeof header_);
    if (header_.magic != baked::kMagic) throw FileError(ErrorKind::kInput, name_, "not a packtrace baked file");
    if (header_.version != baked::kVersion)
      throw FileError(ErrorKind::kUnsupported, name_,
                      "baked file version " + std::to_string(header_.version) + ", this program reads version " +
                          std::to_string(baked::kVersion));
    if (header_.header_hash != XXH3_64bits(bytes_.data(), offsetof(baked::FileHeader, header_hash)))
      fail("header hash does not match");
    if (header_.header_bytes != sizeof header_) fail("header size");
    if (header_.file_bytes != bytes_.size())
      fail("it has " + std::to_string(bytes_.size()) + " bytes, its header says " + std::to_string(header_.file_bytes));
    if (header_.section_count != baked::kSectionCount) fail("section count");
    if (header_.reserved != 0 || header_.padding != decltype(header_.padding){}) fail("reserved header fields");
    const XXH128_hash_t hash = XXH3_128bits(bytes_.data() + sizeof header_, bytes_.size() - sizeof header_);
    if (hash.low64 != header_.content_hash[0] || hash.high64 != header_.content_hash[1])
      fail("content hash does not match");
  }

  template <typename T>
  std::span<const T> section(baked::Section number) const {
    const baked::SectionRecord& record = header_.sections[number];
    return {reinterpret_cast<const T*>(bytes_.data() + record.offset), static_cast<size_t>(record.bytes / sizeof(T))};
  }

  void check_table() const {
    uint64_t end = sizeof header_;
    for (uint32_t i = 0; i < baked::kSectionCount; ++i) {
      const baked::SectionRecord& record = header_.sections[i];
      if (record.record_bytes != baked::kRecordBytes[i] || record.reserved != 0) fail_section(i, "record size");
      if (record.offset % baked::kSectionAlignment != 0) fail_section(i, "alignment");
      if (record.offset < end || record.offset > bytes_.size() || record.bytes > bytes_.size() - record.offset)
        fail_section(i, "extent");
      if (record.bytes % record.record_bytes != 0) fail_section(i, "partial record");
      end = record.offset + record.bytes;
    }
  }
  [[noreturn]] void fail_section(uint32_t section, const char* what) const {
    fail("section " + std::to_string(section) + ": " + what);
  }

  BakedSections sections() const {
    return {section<baked::GeometryRecord>(baked::kGeometries),
            section<baked::ClusterRecord>(baked::kClusters),
            section<uint8_t>(baked::kPayload),
            section<baked::MaterialRecord>(baked::kMaterials),
            section<baked::InstanceRecord>(baked::kInstances),
            section<baked::MaskRecord>(baked::kMasks),
            section<uint32_t>(baked::kMaskWords),
            section<baked::TextureRecord>(baked::kTextures),
            section<uint8_t>(baked::kTextureBytes),
            {},
            section<baked::CameraRecord>(baked::kCameras),
            section<char>(baked::kStrings),
            section<baked::SummaryRecord>(baked::kSummary),
            section<uint32_t>(baked::kMaterialSlots),
            section<baked::RequirementRecord>(baked::kRequirements),
            section<baked::LodLevelRecord>(baked::kLodLevels),
            section<baked::LodGroupRecord>(baked::kLodGroups),
            section<baked::LodLinkRecord>(baked::kLodLinks),
            section<baked::TreeRecord>(baked::kTrees),
            section<uint8_t>(baked::kRigidMotion),
            section<uint8_t>(baked::kDeformation),
            section<baked::PackedNode>(baked::kNodes)};
  }

  void check_counts(const BakedSections& found) const {
    if (found.payload.size() < kReadSlackBytes) fail("payload section without its final zero bytes");
    if (found.summary.size() != 1) fail("summary section must hold one record");
    if (found.geometries.size() >= baked::kNone || found.instances.size() >= baked::kNone ||
        found.materials.size() >= baked::kNone || found.masks.size() >= baked::kNone ||
        found.textures.size() >= baked::kNone || found.material_slots.size() >= baked::kNone)
      fail("too many records");
  }

  bool zero_between_sections() const {
    uint64_t end = sizeof header_;
    const auto zero = [&](uint64_t begin, uint64_t stop) {
      for (uint64_t i = begin; i < stop; ++i)
        if (bytes_[static_cast<size_t>(i)] != std::byte{0}) return false;
      return true;
    };
    for (const baked::SectionRecord& record : header_.sections) {
      if (!zero(end, record.offset)) return false;
      end = record.offset + record.bytes;
    }
    return zero(end, bytes_.size());
  }

  std::span<const std::byte> bytes_;
  const std::string& name_;
  baked::FileHeader header_{};
};

} // namespace

void fail_damaged(const std::string& name, const std::string& what) {
  throw FileError(ErrorKind::kInput, name, "damaged baked file: " + what);
}

BakedSections read_section_table(std::span<const std::byte> bytes, const std::string& name) {
  return SectionTable(bytes, name).read();
}

} // namespace packtrace
