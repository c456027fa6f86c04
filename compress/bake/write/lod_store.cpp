#include "compress/bake/write/lod_store.h"

#include <cinttypes>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <span>
#include <string>
#include <system_error>
#include <type_traits>
#include <vector>

#include <xxhash.h>

#include "compress/format/layout/section_file.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/base/output_file.h"

namespace packtrace {
namespace {

/// Increment with every change to what the builder or encoder produces for the same geometry.
constexpr uint32_t kRevision = 10;
constexpr std::array<uint8_t, 8> kMagic = {'P', 'T', 'K', 'L', 'O', 'D', '\n', 0};
constexpr const char* kExtension = ".ptklod";

enum Part : uint32_t { kLevels, kClusters, kPayload, kGroups, kLinks, kPartCount };

struct StoreHeader {
  std::array<uint8_t, 8> magic;
  uint32_t version; ///< file format version and kRevision
  uint32_t header_bytes;
  uint64_t file_bytes;
  std::array<uint64_t, 2> content_hash;
  uint32_t section_count;
  uint32_t reserved;
  std::array<baked::SectionRecord, kPartCount> sections;
  LodKey key;
  uint64_t header_hash;
};
static_assert(sizeof(StoreHeader) == 192 && std::is_trivially_copyable_v<StoreHeader>);

struct StoredLevel {
  uint64_t triangles, payload_bytes;
  std::array<uint64_t, 4> stream_bits;
  uint32_t cluster_count, group_count, triangle_count, vertex_count;
  std::array<uint32_t, 8> class_clusters;
  std::array<float, 3> bounds_lo, bounds_hi;
  float error, max_normal_error, mean_normal_error;
  uint32_t normal_encoding;
};
static_assert(sizeof(StoredLevel) == 136 && std::is_trivially_copyable_v<StoredLevel>);

constexpr std::array<uint32_t, kPartCount> kRecordBytes = {sizeof(StoredLevel), sizeof(baked::ClusterRecord), 1,
                                                           sizeof(baked::LodGroupRecord), sizeof(baked::LodLinkRecord)};
constexpr uint32_t kStoreVersion = (baked::kVersion << 16) | kRevision;

/// Hashes numbers and hashes of arrays.
class Hasher {
public:
  template <class T>
  void add(const std::vector<T>& values) {
    static_assert(std::has_unique_object_representations_v<T>);
    const XXH128_hash_t hash = XXH3_128bits(values.data(), values.size() * sizeof(T));
    words_.insert(words_.end(), {values.size(), hash.low64, hash.high64});
  }
  void add_number(uint64_t value) { words_.push_back(value); }
  LodKey result() const {
    const XXH128_hash_t hash = XXH3_128bits(words_.data(), words_.size() * sizeof(uint64_t));
    return {hash.low64, hash.high64};
  }

private:
  std::vector<uint64_t> words_;
};

StoredLevel stored(const EncodedLod::Level& level) {
  const EncodedGeometry& e = level.encoded;
  return {level.triangles,
          e.payload.size(),
          {e.stream_bits.indices, e.stream_bits.positions, e.stream_bits.normals, e.stream_bits.uvs},
          static_cast<uint32_t>(e.clusters.size()),
          level.group_count,
          e.triangle_count,
          e.vertex_count,
          e.class_clusters,
          {e.bounds_lo.x, e.bounds_lo.y, e.bounds_lo.z},
          {e.bounds_hi.x, e.bounds_hi.y, e.bounds_hi.z},
          level.error,
          level.max_normal_error,
          level.mean_normal_error,
          static_cast<uint32_t>(level.normal_encoding)};
}

/// Copies the records of a section. Returns false if it is not inside the file or has the wrong record size.
template <class T>
bool read_part(std::span<const std::byte> bytes, const baked::SectionRecord& part, std::vector<T>& out) {
  if (part.record_bytes != sizeof(T) || part.offset > bytes.size() || part.bytes > bytes.size() - part.offset ||
      part.bytes % sizeof(T) != 0)
    return false;
  out.resize(static_cast<size_t>(part.bytes / sizeof(T)));
  if (!out.empty()) std::memcpy(out.data(), bytes.data() + part.offset, static_cast<size_t>(part.bytes));
  return true;
}

bool is_angle(float degrees) { return degrees >= 0.0f && degrees <= 180.0f; }

std::optional<EncodedLod> decode(std::span<const std::byte> bytes, const LodKey& key) {
  StoreHeader header;
  if (bytes.size() < sizeof header) return std::nullopt;
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.magic != kMagic || header.version != kStoreVersion || header.header_bytes != sizeof header ||
      header.file_bytes != bytes.size() || header.section_count != kPartCount || header.key != key ||
      header.header_hash != XXH3_64bits(&header, offsetof(StoreHeader, header_hash)))
    return std::nullopt;
  const XXH128_hash_t hash = XXH3_128bits(bytes.data() + sizeof header, bytes.size() - sizeof header);
  if (header.content_hash != std::array<uint64_t, 2>{hash.low64, hash.high64}) return std::nullopt;

  EncodedLod lod;
  std::vector<StoredLevel> levels;
  std::vector<baked::ClusterRecord> clusters;
  std::vector<uint8_t> payload;
  if (!read_part(bytes, header.sections[kLevels], levels) || !read_part(bytes, header.sections[kClusters], clusters) ||
      !read_part(bytes, header.sections[kPayload], payload) ||
      !read_part(bytes, header.sections[kGroups], lod.groups) || !read_part(bytes, header.sections[kLinks], lod.links))
    return std::nullopt;
  size_t cluster = 0, byte = 0;
  for (const StoredLevel& level : levels) {
    if (level.cluster_count > clusters.size() - cluster || level.payload_bytes > payload.size() - byte ||
        level.normal_encoding >= kNormalFormats.size() || !is_angle(level.max_normal_error) ||
        !is_angle(level.mean_normal_error))
      return std::nullopt;
    EncodedGeometry e;
    const auto first = clusters.begin() + static_cast<std::ptrdiff_t>(cluster);
    e.clusters.assign(first, first + level.cluster_count);
    const auto begin = payload.begin() + static_cast<std::ptrdiff_t>(byte);
    e.payload.assign(begin, begin + static_cast<std::ptrdiff_t>(level.payload_bytes));
    cluster += level.cluster_count, byte += static_cast<size_t>(level.payload_bytes);
    e.class_clusters = level.class_clusters;
    e.triangle_count = level.triangle_count, e.vertex_count = level.vertex_count;
    e.bounds_lo = Vec3(level.bounds_lo[0], level.bounds_lo[1], level.bounds_lo[2]);
    e.bounds_hi = Vec3(level.bounds_hi[0], level.bounds_hi[1], level.bounds_hi[2]);
    e.stream_bits = {level.stream_bits[0], level.stream_bits[1], level.stream_bits[2], level.stream_bits[3]};
    lod.levels.push_back({std::move(e), level.triangles, level.group_count, level.error,
                          static_cast<NormalEncoding>(level.normal_encoding), level.max_normal_error,
                          level.mean_normal_error});
  }
  if (cluster != clusters.size() || byte != payload.size()) return std::nullopt;
  return lod;
}

} // namespace

LodKey lod_key(const QuantizedGeometry& g, const GeometryClusters& base, const LodLimits& limits) {
  Hasher hash;
  for (const uint64_t number :
       {uint64_t{limits.max_levels}, uint64_t{g.grid.mantissa}, static_cast<uint64_t>(g.grid.exponent),
        static_cast<uint64_t>(g.normal_encoding), static_cast<uint64_t>(g.uv_encoding),
        static_cast<uint64_t>(g.uv_exponent[0]), static_cast<uint64_t>(g.uv_exponent[1]),
        static_cast<uint64_t>(g.origin[0]), static_cast<uint64_t>(g.origin[1]), static_cast<uint64_t>(g.origin[2]),
        uint64_t{g.anchor_shift}, uint64_t{limits.coarser_normals}})
    hash.add_number(number);
  hash.add(g.positions);
  hash.add(g.vertices);
  for (const TriangleKind& kind : g.kinds)
    hash.add_number((uint64_t{kind.slot} << 2) | (uint64_t{kind.flat} << 1) | uint64_t{kind.uvs});
  hash.add(g.slot_class);
  hash.add(base.triangles);
  hash.add(base.clusters);
  hash.add(limits.locked);
  return hash.result();
}

LodStore::LodStore(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw Error(ErrorKind::kIo, folder_.string() + ": " + error.message());
}

std::filesystem::path LodStore::path_of(const LodKey& key) const {
  std::array<char, 33> name{};
  std::snprintf(name.data(), name.size(), "%016" PRIx64 "%016" PRIx64, key[1], key[0]);
  return folder_ / (name.data() + std::string(kExtension));
}

std::optional<EncodedLod> LodStore::find(const LodKey& key, const LodBase& base) const {
  std::error_code not_there;
  if (!std::filesystem::is_regular_file(path_of(key), not_there)) return std::nullopt;
  try {
    std::optional<EncodedLod> lod = decode(read_file_bytes(path_of(key)), key);
    if (lod && find_stored_lod_fault(*lod, base)) return std::nullopt;
    return lod;
  } catch (const Error&) {
    return std::nullopt; // unreadable files are built again
  }
}

void LodStore::keep(const LodKey& key, const EncodedLod& lod) const {
  std::vector<StoredLevel> levels;
  std::vector<baked::ClusterRecord> clusters;
  std::vector<uint8_t> payload;
  for (const EncodedLod::Level& level : lod.levels) {
    levels.push_back(stored(level));
    clusters.insert(clusters.end(), level.encoded.clusters.begin(), level.encoded.clusters.end());
    payload.insert(payload.end(), level.encoded.payload.begin(), level.encoded.payload.end());
  }
  StoreHeader header{};
  header.magic = kMagic;
  header.version = kStoreVersion;
  header.key = key;
  const std::array<std::span<const std::byte>, kPartCount> parts = {
      std::as_bytes(std::span(levels)), std::as_bytes(std::span(clusters)), std::as_bytes(std::span(payload)),
      std::as_bytes(std::span(lod.groups)), std::as_bytes(std::span(lod.links))};
  OutputFile file(path_of(key), true);
  file.write(assemble_section_file(header, parts, kRecordBytes));
  file.commit();
}

void LodStore::clear() const {
  std::error_code error;
  std::vector<std::filesystem::path> ours;
  for (std::filesystem::directory_iterator at(folder_, error), end; !error && at != end; at.increment(error))
    if (at->path().extension() == kExtension) ours.push_back(at->path());
  if (error) throw Error(ErrorKind::kIo, folder_.string() + ": " + error.message());
  std::string first;
  size_t left = 0;
  for (const std::filesystem::path& path : ours) {
    std::filesystem::remove(path, error);
    if (error && left++ == 0) first = path.string() + ": " + error.message();
  }
  if (left > 1) first += ", and " + std::to_string(left - 1) + " more";
  if (left > 0) throw Error(ErrorKind::kIo, "cannot remove " + first);
  std::filesystem::remove(folder_, error); // stays if it contains other files
  if (error && error != std::errc::directory_not_empty)
    throw Error(ErrorKind::kIo, "cannot remove " + folder_.string() + ": " + error.message());
}

} // namespace packtrace
