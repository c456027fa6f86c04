#include "compress/exchange/gltf/gltf_export.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>

#include "compress/exchange/gltf/gltf_materials.h"
#include "compress/exchange/gltf/gltf_meshes.h"
#include "compress/exchange/gltf/gltf_nodes.h"

namespace packtrace {
namespace {

constexpr int kMaxDracoBits = 30;

class Exporter {
public:
  Exporter(const BakedFile& file, const GltfConfig& config, Progress& progress)
      : file_(file), config_(config), progress_(progress), materials_(file, config, model_) {}

  GltfExport run() {
    count_instances();
    decode();
    if (config_.codec == GltfCodec::kDraco) compress();
    if (config_.codec == GltfCodec::kMeshopt) {
      drop_whole_tiles();
      choose_uv_grid();
    }
    progress_.begin("compressing images", 0);
    model_.scene_nodes().push_back(model_.add("nodes", GltfJson::object())); // the root, which GltfNodes fills
    materials_.add_all(uvs_.map());
    GltfMeshes meshes(file_, config_, materials_, uvs_, model_, result_.report);
    std::vector<bool> merged = merge_world(meshes);
    if (config_.codec == GltfCodec::kMeshopt) code_integers();
    progress_.begin("assembling the file", 0);
    for (uint32_t g = 0; g < encoded_.size(); ++g) {
      if (config_.codec == GltfCodec::kDraco)
        for (const GltfPrimitive& primitive : encoded_[g].primitives)
          result_.report.plain_primitives += !primitive.draco;
      meshes.add_geometry(g, std::move(encoded_[g]));
    }
    GltfNodes(file_, config_, meshes, model_, result_.report).add_all(merged);
    meshes.finish();
    if (config_.codec == GltfCodec::kMeshopt && !config_.names)
      model_.set_asset_extras(gltf_integer_lattice()); // meshes of floats state their own
    report();
    if (config_.buffer_name.empty()) {
      result_.bytes = model_.write_binary();
    } else {
      result_.bytes = model_.write_text(config_.buffer_name);
      result_.buffer = model_.take_buffer();
    }
    result_.report.file_bytes = result_.bytes.size() + result_.buffer.size();
    return std::move(result_);
  }

private:
  uint32_t geometry_count() const {
    return config_.levels ? static_cast<uint32_t>(file_.geometries().size()) : file_.base_geometry_count();
  }

  void count_instances() {
    uses_.resize(file_.geometries().size());
    encoded_.resize(geometry_count());
    std::vector<bool> with_image;
    for (const baked::MaterialRecord& material : file_.sections().materials)
      with_image.push_back(material.alpha_mask != baked::kNone || material.albedo_texture != baked::kNone);
    std::vector<bool> needs_uvs(file_.geometries().size());
    for (uint32_t i = 0; i < file_.instances().size(); ++i) {
      const uint32_t geometry = file_.instances()[i].geometry;
      ++uses_[geometry];
      for (const uint32_t material : file_.instance_materials(i))
        if (with_image[material]) needs_uvs[geometry] = true;
    }
    for (uint32_t g = 0; g < file_.base_geometry_count(); ++g)
      for (const baked::LodLevelRecord& level : file_.lod(g).levels) needs_uvs[level.geometry] = needs_uvs[g];
    for (uint32_t g = 0; g < encoded_.size(); ++g) encoded_[g].with_uvs = needs_uvs[g];
  }

  void decode() {
    progress_.begin("decoding", encoded_.size());
    tbb::parallel_for(size_t{0}, encoded_.size(), [&](size_t g) {
      progress_.check_cancelled();
      for (PlainPrimitive& plain : plain_primitives(file_, static_cast<uint32_t>(g))) {
        for (const LatticePoint& p : plain.lattice) encoded_[g].box.extend(p);
        encoded_[g].primitives.push_back({std::move(plain), std::nullopt, std::nullopt});
      }
      const GltfLatticeBox& box = encoded_[g].box;
      if (config_.codec == GltfCodec::kMeshopt && !box.empty) encoded_[g].frame = position_frame(box.lo, box.hi);
      progress_.advance();
    });
  }

  void compress() {
    DracoGrids grids;
    for (uint32_t g = 0; g < encoded_.size(); ++g) grids.add(file_.geometries()[g], g, encoded_[g].box);
    progress_.begin("compressing meshes", encoded_.size());
    tbb::parallel_for(uint32_t{0}, static_cast<uint32_t>(encoded_.size()), [&](uint32_t g) {
      const DracoGrid grid = grids.grid(file_.geometries()[g], g);
      for (GltfPrimitive& primitive : encoded_[g].primitives) {
        progress_.check_cancelled();
        if (grid.bits <= kMaxDracoBits) primitive.draco = encode_draco(primitive.plain, grid, config_.draco);
      }
      progress_.advance();
    });
  }

  /// Whether an image looks the same after a shift of texture coordinates.
  template <class View>
  static bool repeats(const View& view, glm::dvec2 shift) {
    const glm::dvec2 texels = glm::dvec2(view.uv_scale) * shift;
    return view.wrap == WrapMode::kRepeat && texels == glm::floor(texels);
  }

  bool repeats(uint32_t material, glm::dvec2 shift) const {
    const baked::MaterialRecord& record = file_.sections().materials[material];
    return (record.alpha_mask == baked::kNone || repeats(file_.mask(record.alpha_mask), shift)) &&
           (record.albedo_texture == baked::kNone || repeats(file_.texture(record.albedo_texture), shift));
  }

  /// Shifts the texture coordinates of each primitive to near 0 where its images repeat, so that fewer bits suffice.
  void drop_whole_tiles() {
    std::vector<std::vector<uint32_t>> users(file_.geometries().size());
    for (uint32_t i = 0; i < file_.instances().size(); ++i) users[file_.instances()[i].geometry].push_back(i);
    for (uint32_t g = 0; g < file_.base_geometry_count(); ++g) // levels of detail keep theirs
      for (GltfPrimitive& primitive : encoded_[g].primitives) {
        std::vector<Vec2>& uvs = primitive.plain.uvs;
        if (!encoded_[g].with_uvs || uvs.empty()) continue;
        glm::dvec2 lo(uvs.front());
        for (const Vec2& uv : uvs) lo = glm::min(lo, glm::dvec2(uv));
        const glm::dvec2 shift = glm::floor(lo);
        const bool same = std::ranges::all_of(users[g], [&](uint32_t i) {
          return repeats(file_.instance_materials(i)[primitive.plain.material_slot], shift);
        });
        if (same)
          for (Vec2& uv : uvs) uv = Vec2(glm::dvec2(uv) - shift);
      }
  }

  /// Chooses a grid for all texture coordinates: errors stay below an eighth of a texel of the largest texture. Floats
  /// remain if that takes more than 16 bits.
  void choose_uv_grid() {
    glm::dvec2 lo(std::numeric_limits<double>::infinity()), hi = -lo;
    for (const GltfGeometry& geometry : encoded_)
      for (const GltfPrimitive& primitive : geometry.primitives)
        if (geometry.with_uvs)
          for (const Vec2& uv : primitive.plain.uvs)
            lo = glm::min(lo, glm::dvec2(uv)), hi = glm::max(hi, glm::dvec2(uv));
    double texels = 1.0; // per unit of the coordinates
    const auto count = [&](const auto& image) {
      texels = std::max({texels, double(image.width) * std::abs(double{image.uv_scale.x}),
                         double(image.height) * std::abs(double{image.uv_scale.y})});
    };
    for (uint32_t i = 0; i < file_.sections().masks.size(); ++i) count(file_.mask(i));
    for (uint32_t i = 0; i < file_.sections().textures.size(); ++i) count(file_.texture(i));
    const double extent = std::max(hi.x - lo.x, hi.y - lo.y);
    constexpr double kTexelFraction = 0.25;
    const double step = kTexelFraction / texels;
    if (!(extent >= 0.0) || !std::isfinite(extent) || extent / step > std::numeric_limits<uint16_t>::max()) return;
    uvs_ = {lo, step};
    result_.report.max_uv_error = 0.5 * step;
  }

  /// Merges geometries of one instance in world space by material, where nothing refers to them by name.
  /// @return by instance: whether it was merged
  std::vector<bool> merge_world(GltfMeshes& meshes) {
    std::vector<bool> merged(file_.instances().size());
    if (config_.codec != GltfCodec::kMeshopt || config_.names) return merged;
    std::vector<GltfMeshes::Placed> placed;
    for (uint32_t i = 0; i < file_.instances().size(); ++i) {
      const baked::InstanceRecord& instance = file_.instances()[i];
      const uint32_t g = instance.geometry;
      const bool alone = uses_[g] == 1 && (file_.geometries()[g].flags & baked::kWorldSpace) != 0;
      const bool has_levels = config_.levels && file_.lod(g).levels.size() > 1;
      if (!alone || has_levels || !encoded_[g].frame) continue;
      merged[i] = true;
      placed.push_back({g, instance.first_slot, &encoded_[g]});
    }
    meshes.add_world(std::move(placed), progress_);
    return merged;
  }

  /// Codes the primitives of geometries that are not merged, where their positions are stored as integers.
  void code_integers() {
    progress_.begin("compressing meshes", encoded_.size());
    tbb::parallel_for(size_t{0}, encoded_.size(), [&](size_t g) {
      const std::optional<PositionFrame>& frame = encoded_[g].frame;
      for (GltfPrimitive& primitive : encoded_[g].primitives) {
        progress_.check_cancelled();
        if (!frame) continue;
        PlainPrimitive& plain = primitive.plain;
        primitive.meshopt = meshopt_primitive(plain, *frame, config_.meshopt_normal_bits, uvs_, encoded_[g].with_uvs);
        PlainPrimitive rest;
        rest.material_slot = plain.material_slot;
        plain = std::move(rest);
      }
      progress_.advance();
    });
  }

  void report() {
    GltfReport& report = result_.report;
    report.meshes = model_.count("meshes"), report.nodes = model_.count("nodes");
    report.materials = model_.count("materials"), report.images = model_.count("images");
    report.cameras = model_.count("cameras");
    report.moving = !file_.sections().rigid_motion.empty() || !file_.sections().deformation.empty();
    report.image_bytes = materials_.image_bytes(), report.simplified_materials = materials_.simplified();
    report.min_texture_psnr = materials_.lowest_psnr();
    report.losses = find_losses(file_, ExportFormat::kGltf, {config_.levels, config_.material_extensions});
  }

  const BakedFile& file_;
  const GltfConfig& config_;
  Progress& progress_;
  GltfModel model_;
  GltfMaterials materials_;
  GltfExport result_;
  UvGrid uvs_;
  std::vector<uint32_t> uses_; ///< instances by geometry
  std::vector<GltfGeometry> encoded_;
};

} // namespace

GltfExport export_gltf(const BakedFile& file, const GltfConfig& config, Progress& progress) {
  validate(config);
  return Exporter(file, config, progress).run();
}

} // namespace packtrace
