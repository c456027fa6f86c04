#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "compress/format/cluster/cluster_validation.h"
#include "compress/format/deformation/deformation_view.h"
#include "compress/format/file/baked_file.h"
#include "compress/format/file/lod_validation.h"
#include "compress/format/file/section_table.h"
#include "compress/format/layout/bit_stream.h"
#include "compress/format/motion/deformation_validation.h"
#include "compress/format/motion/rigid_motion_validation.h"
#include "compress/format/trees/tree_validation.h"
#include "compress/format/voxels/proxy_codec.h"
#include "compress/format/voxels/proxy_section.h"

namespace packtrace {
namespace {

static_assert(baked::kNone == kNoMask && baked::kNone == kNoTexture);

/// Checks the records of one file image. Each error names the file, the section and the record.
class Validator {
public:
  Validator(std::span<const std::byte> bytes, const std::string& name, bool clusters_checked)
      : name_(name), clusters_checked_(clusters_checked), sections_(read_section_table(bytes, name)) {}

  BakedSections run() {
    check_proxies();
    check_shading();
    check_materials_and_masks();
    check_textures();
    check_instances();
    check_level_chains();
    check_lod_levels();
    check_geometries();
    if (const auto fault = find_lod_group_fault(sections_)) fail(fault->section, fault->record, fault->what);
    if (const auto fault = find_tree_fault(sections_)) fail(fault->section, fault->record, fault->what);
    check_cameras();
    check_motion();
    check_requirements();
    check_summary();
    return sections_;
  }

private:
  [[noreturn]] void fail(const std::string& what) const { fail_damaged(name_, what); }
  [[noreturn]] void fail(const char* section, uint64_t record, std::string_view what) const {
    fail(std::string(section) + " " + std::to_string(record) + ": " + std::string(what));
  }

  /// Strings do not share bytes, so the total length of all names is at most the size of the section.
  bool text_ok(baked::StringRef ref) {
    text_bytes_ += ref.bytes;
    return text_bytes_ <= sections_.strings.size() && ref.offset <= sections_.strings.size() &&
           ref.bytes <= sections_.strings.size() - ref.offset;
  }

  void check_materials_and_masks() {
    for (size_t i = 0; i < sections_.materials.size(); ++i) {
      const baked::MaterialRecord& m = sections_.materials[i];
      if ((m.flags & ~kAllMaterialFlags) != 0) fail("material", i, "flags");
      for (const float a : m.albedo)
        if (!(a >= 0.0f && a <= 1.0f)) fail("material", i, "albedo");
      const auto mask_ok = [&](bool wanted, uint32_t mask) {
        return wanted ? mask < sections_.masks.size() : mask == baked::kNone;
      };
      if (!mask_ok((m.flags & kAlphaMask) != 0, m.alpha_mask) ||
          !mask_ok((m.flags & kShadowAlphaMask) != 0, m.shadow_alpha_mask))
        fail("material", i, "alpha mask");
      const bool texture_ok = m.albedo_texture == baked::kNone ||
                              ((m.flags & kAlbedoTexture) != 0 && m.albedo_texture < sections_.textures.size());
      if (!texture_ok) fail("material", i, "albedo texture");
      if (!text_ok(m.name)) fail("material", i, "name");
    }
    for (size_t i = 0; i < sections_.masks.size(); ++i) {
      const baked::MaskRecord& m = sections_.masks[i];
      if (m.width == 0 || m.height == 0 || m.wrap > 2 || m.reserved != 0) fail("mask", i, "size or wrap mode");
      const uint64_t words = uint64_t{AlphaMask::row_words(m.width)} * m.height; // < 2^59
      if (m.first_word > sections_.mask_words.size() || words > sections_.mask_words.size() - m.first_word)
        fail("mask", i, "extent");
      for (const float f : {m.uv_scale[0], m.uv_scale[1], m.uv_offset[0], m.uv_offset[1]})
        if (!std::isfinite(f)) fail("mask", i, "texture transform");
    }
  }

  /// Splits the proxies from the texture bytes.
  void check_proxies() {
    if ((sections_.summary.front().purpose & voxels::kHasProxies) == 0) return;
    const std::optional<std::span<const uint8_t>> proxies = split_proxies(sections_.texture_bytes);
    if (!proxies) fail("proxies", 0, "extent");
    if (const auto fault = find_proxy_fault(*proxies, sections_.geometries.size())) fail("proxies", 0, *fault);
  }

  /// Splits the shading from the texture bytes.
  void check_shading() {
    const uint64_t bytes = sections_.summary.front().shading_bytes;
    if (bytes > sections_.texture_bytes.size()) fail("shading", 0, "extent");
    sections_.shading = sections_.texture_bytes.last(static_cast<size_t>(bytes));
    sections_.texture_bytes = sections_.texture_bytes.first(sections_.texture_bytes.size() - sections_.shading.size());
    if (bytes == 0) return;
    if (const auto fault = find_shading_fault(sections_.shading, sections_.materials.size()))
      fail("shading", 0, *fault);
  }

  void check_textures() {
    for (size_t i = 0; i < sections_.textures.size(); ++i) {
      const baked::TextureRecord& t = sections_.textures[i];
      if (const auto fault = find_texture_fault(t, sections_.texture_bytes.size())) fail("texture", i, *fault);
      if (!text_ok(t.name)) fail("texture", i, "name");
    }
  }

  void check_geometries() {
    uint64_t next_cluster = 0, next_payload = 0;
    for (size_t i = 0; i < sections_.geometries.size(); ++i) {
      const baked::GeometryRecord& g = sections_.geometries[i];
      if (g.first_cluster != next_cluster || g.cluster_count > sections_.clusters.size() - next_cluster)
        fail("geometry", i, "cluster range");
      if (g.payload_offset != next_payload || g.payload_bytes % 4 != 0 ||
          g.payload_bytes > sections_.payload.size() - kReadSlackBytes - next_payload)
        fail("geometry", i, "payload range");
      if (g.step_mantissa < kMinStepMantissa || g.step_mantissa > kMaxStepMantissa ||
          g.step_exponent < kMinStepExponent || g.step_exponent > kMaxStepExponent)
        fail("geometry", i, "step");
      if (g.anchor_shift > 26) fail("geometry", i, "anchor shift");
      for (const int64_t o : g.origin)
        if (o < -kMaxLattice || o > kMaxLattice) fail("geometry", i, "origin");
      for (const int32_t e : g.uv_exponent)
        if (e < kMinUvExponent || e > kMaxUvExponent) fail("geometry", i, "texture coordinate step");
      if (!(g.max_position_error >= 0.0 && g.max_position_error <= g.position_error_bound &&
            std::isfinite(g.position_error_bound)))
        fail("geometry", i, "position error");
      for (const float e : {g.max_normal_error_degrees, g.mean_normal_error_degrees, g.max_uv_error})
        if (!(e >= 0.0f && std::isfinite(e))) fail("geometry", i, "normal or texture coordinate error");
      if (g.mean_normal_error_degrees > g.max_normal_error_degrees || g.max_normal_error_degrees > 180.0f)
        fail("geometry", i, "normal error");
      if (g.normal_encoding >= kNormalFormats.size()) fail("geometry", i, "normal encoding");
      if (g.uv_encoding >= kUvEncodingNames.size() ||
          (g.uv_encoding != static_cast<uint32_t>(UvEncoding::kLattice) && g.uv_exponent != std::array<int16_t, 2>{}))
        fail("geometry", i, "texture coordinate encoding");
      if ((g.flags & ~baked::kGeometryFlags) != 0) fail("geometry", i, "flags");
      if ((g.requirements & ~baked::kAllRequirements) != 0) fail("geometry", i, "requirements");
      if (!text_ok(g.name)) fail("geometry", i, "name");
      check_slots(i, g);
      check_clusters(i, g);
      next_cluster += g.cluster_count;
      next_payload += g.payload_bytes;
    }
    if (next_cluster != sections_.clusters.size()) fail("clusters that belong to no geometry");
    if (next_payload != sections_.payload.size() - kReadSlackBytes) fail("payload that belongs to no geometry");
  }

  uint32_t class_of_slot(uint32_t slot) const {
    return baked::material_class(sections_.materials[sections_.material_slots[slot]].flags);
  }

  /// Finds the end of each run of slots with equal class, so that same_classes() compares thousands of slots in a few
  /// steps.
  void find_class_ends() {
    class_ends_.resize(sections_.material_slots.size());
    for (auto i = static_cast<uint32_t>(class_ends_.size()); i-- > 0;)
      class_ends_[i] =
          i + 1 < class_ends_.size() && class_of_slot(i) == class_of_slot(i + 1) ? class_ends_[i + 1] : i + 1;
  }

  /// Whether both runs of slots have the same classes, in ascending order.
  bool same_classes(uint32_t first, uint32_t other, uint32_t count) const {
    for (uint32_t i = 0; i < count;) {
      const uint32_t end = std::min(class_ends_[first + i] - first, count);
      if (end != std::min(class_ends_[other + i] - other, count)) return false;
      if (class_of_slot(first + i) != class_of_slot(other + i)) return false;
      if (end < count && class_of_slot(first + end) < class_of_slot(first + i)) return false;
      i = end;
    }
    return true;
  }

  void check_slots(size_t geometry, const baked::GeometryRecord& g) const {
    if ((g.flags & baked::kLodLevel) != 0) return; // it uses the base's slots
    if (g.cluster_count == 0 ? g.slot_count != 0 : g.slot_count == 0 || g.slot_count > g.cluster_count)
      fail("geometry", geometry, "material slots");
    if (g.cluster_count > 0 && first_slots_[geometry] == baked::kNone)
      fail("geometry", geometry, "no instance places it");
  }

  void check_clusters(size_t geometry, const baked::GeometryRecord& g) {
    const auto clusters = sections_.clusters.subspan(static_cast<size_t>(g.first_cluster), g.cluster_count);
    const auto class_in_first = [&](uint32_t slot) { return class_of_slot(first_slots_[geometry] + slot); };
    const auto fault = find_cluster_list_fault(g, clusters, sections_.payload.data() + g.payload_offset, class_in_first,
                                               clusters_checked_);
    if (!fault) return;
    if (fault->cluster) fail("cluster", g.first_cluster + *fault->cluster, fault->what);
    fail("geometry", geometry, fault->what);
  }

  void check_instances() {
    for (size_t i = 0; i < sections_.material_slots.size(); ++i)
      if (sections_.material_slots[i] >= sections_.materials.size()) fail("material slot", i, "material");
    find_class_ends();
    first_slots_.assign(sections_.geometries.size(), baked::kNone);
    for (size_t i = 0; i < sections_.instances.size(); ++i) {
      const baked::InstanceRecord& instance = sections_.instances[i];
      if (instance.geometry >= sections_.geometries.size() ||
          (sections_.geometries[instance.geometry].flags & baked::kLodLevel) != 0)
        fail("instance", i, "geometry");
      for (const float f : instance.world_from_object)
        if (!std::isfinite(f)) fail("instance", i, "transform");
      const uint32_t slots = sections_.geometries[instance.geometry].slot_count;
      if (slots > sections_.material_slots.size() || instance.first_slot > sections_.material_slots.size() - slots)
        fail("instance", i, "material slots");
      uint32_t& first = first_slots_[instance.geometry];
      if (first == baked::kNone) first = instance.first_slot;
      if (!same_classes(first, instance.first_slot, slots)) fail("instance", i, "material classes");
    }
    check_runs();
  }

  /// LOD levels use the material slots of their base.
  void check_lod_levels() {
    if (const auto fault = find_lod_level_fault(sections_)) fail(fault->section, fault->record, fault->what);
    for (const baked::LodLevelRecord& level : sections_.lod_levels)
      first_slots_[level.geometry] = first_slots_[level.base];
  }

  /// Instances of a level chain show any of its geometries, so all of these have as many slots of the same classes. At
  /// least one of them has an instance.
  void check_level_chains() {
    const auto levels = std::ranges::partition_point(
        sections_.geometries, [](const baked::GeometryRecord& g) { return (g.flags & baked::kLodLevel) == 0; });
    const auto base_geometries = static_cast<uint32_t>(levels - sections_.geometries.begin());
    if (const auto fault = find_chain_fault(sections_.deformation, sections_.geometries, base_geometries))
      fail("level chain", fault->record, fault->what);
    const std::span<const baked::LevelChainRecord> chains = level_chains(sections_.deformation);
    for (size_t i = 0; i < chains.size(); ++i) {
      const std::span<const uint32_t> geometries = std::span(chains[i].geometry).first(chains[i].level_count);
      const auto placed = std::ranges::find_if(geometries, [&](uint32_t g) { return first_slots_[g] != baked::kNone; });
      if (placed == geometries.end()) fail("level chain", i, "no instance places it");
      const uint32_t first = first_slots_[*placed], count = sections_.geometries[*placed].slot_count;
      for (const uint32_t g : geometries) {
        if (sections_.geometries[g].slot_count != count) fail("level chain", i, "material slots");
        if (first_slots_[g] == baked::kNone) first_slots_[g] = first;
        if (!same_classes(first, first_slots_[g], count)) fail("level chain", i, "material classes");
      }
    }
  }

  /// The runs of slots of one geometry must be equal or disjoint, so that visiting all distinct runs takes time linear
  /// in the file size.
  void check_runs() const {
    std::vector<std::pair<uint32_t, uint32_t>> runs; // geometry, first slot
    for (const baked::InstanceRecord& instance : sections_.instances)
      runs.emplace_back(instance.geometry, instance.first_slot);
    std::sort(runs.begin(), runs.end());
    runs.erase(std::unique(runs.begin(), runs.end()), runs.end());
    for (size_t i = 1; i < runs.size(); ++i)
      if (runs[i].first == runs[i - 1].first &&
          runs[i].second - runs[i - 1].second < sections_.geometries[runs[i].first].slot_count)
        fail("geometry", runs[i].first, "overlapping material slots");
  }

  void check_cameras() {
    for (size_t i = 0; i < sections_.cameras.size(); ++i) {
      const baked::CameraRecord& c = sections_.cameras[i];
      for (const double d : c.world_from_camera)
        if (!std::isfinite(d)) fail("camera", i, "transform");
      for (const double d : c.screen_window)
        if (!std::isfinite(d)) fail("camera", i, "screen window");
      if (!std::isfinite(c.fov_degrees) || c.projection > 2 || c.has_screen_window > 1 || c.width_px == 0 ||
          c.height_px == 0)
        fail("camera", i, "projection or film");
      if (!text_ok(c.film_name)) fail("camera", i, "film name");
    }
  }

  void check_motion() {
    if (const auto fault = validate_rigid_motion(sections_)) fail("rigid motion", fault->record, fault->what);
    if (const auto fault = validate_deformation(sections_)) fail("deformation", fault->record, fault->what);
  }

  void check_requirements() {
    for (size_t i = 0; i < sections_.requirements.size(); ++i) {
      const baked::RequirementRecord& r = sections_.requirements[i];
      if (r.stream >= baked::kStreamCount || r.reason >= baked::kReasonCount || r.reserved != 0)
        fail("requirement", i, "stream or reason");
      if (r.geometries == 0 || r.geometries > sections_.geometries.size()) fail("requirement", i, "geometries");
      if (i == 0) continue;
      const baked::RequirementRecord& before = sections_.requirements[i - 1];
      if (r.stream < before.stream || (r.stream == before.stream && r.reason <= before.reason))
        fail("requirement", i, "order");
    }
    const uint32_t purpose = sections_.summary.front().purpose & ~voxels::kHasProxies;
    if ((purpose & ((1u << baked::kKeepShift) - 1)) >= baked::kPurposeCount ||
        purpose >> baked::kKeepShift >> baked::kStreamCount != 0)
      fail("purpose");
  }

  void check_summary() {
    const baked::SummaryRecord& s = sections_.summary.front();
    if (s.precision_kind > 3 || s.world_step_mantissa > kMaxStepMantissa || s.world_step_exponent < kMinStepExponent ||
        s.world_step_exponent > kMaxStepExponent)
      fail("summary");
    for (size_t axis = 0; axis < 3; ++axis)
      if (std::isnan(s.bounds_lo[axis]) || std::isnan(s.bounds_hi[axis]) || !std::isfinite(s.origin[axis]))
        fail("summary bounds");
    for (const double area : {s.source_area, s.collapsed_area})
      if (!(area >= 0.0 && std::isfinite(area))) fail("summary areas");
  }

  const std::string& name_;
  bool clusters_checked_;
  BakedSections sections_;
  std::vector<uint32_t> class_ends_; // by material slot
  uint64_t text_bytes_ = 0;
  // By geometry: first_slot of its first instance. The other instances have equal classes.
  std::vector<uint32_t> first_slots_;
};

} // namespace

BakedSections validate_baked_file(std::span<const std::byte> bytes, const std::string& name, bool clusters_checked) {
  return Validator(bytes, name, clusters_checked).run();
}

} // namespace packtrace
