// Fuzzes baked files, resident and paged: decoding of pages, validation, and every query on a file that passed
// validation. Each input is tried in three forms: unchanged; with correct sizes and hashes of header, table and pages;
// and with correct sizes and hashes of its decoded pages, too.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <vector>

#include "compress/format/deformation/deformation_player.h"
#include "compress/format/file/baked_file.h"
#include "compress/format/file/file_summary.h"
#include "compress/format/motion/motion_stream.h"
#include "compress/format/voxels/proxy_section.h"
#include "pbrt_import/scene/motion_pose.h"
#include "tests/fuzz/baked_input.h"

namespace packtrace::fuzz {
namespace {

bool same_bits(const void* a, const void* b, size_t bytes) { return std::memcmp(a, b, bytes) == 0; }

/// Decodes a cluster as a whole and vertex by vertex.
void read_cluster(const ClusterView& cluster) {
  const uint32_t vertices = cluster.vertex_count(), count = cluster.triangle_count();
  std::vector<Vec3> positions(vertices), normals(cluster.has_normals() ? vertices : 0);
  std::vector<Vec2> uvs(cluster.has_uvs() ? vertices : 0);
  std::vector<Triangle> triangles(count);
  decode_positions(cluster, positions);
  decode_indices(cluster, 0, triangles);
  if (cluster.has_normals()) decode_normals(cluster, normals);
  if (cluster.has_uvs()) decode_uvs(cluster, uvs);
  Vec3 lo, hi;
  cluster.bounds(lo, hi);
  for (uint32_t v = 0; v < vertices; ++v) {
    const Vec3 p = cluster.position(v);
    require(is_finite(p), "position not finite");
    require(same_bits(&p, &positions[v], sizeof p), "positions differ");
    for (int axis = 0; axis < 3; ++axis) require(p[axis] >= lo[axis] && p[axis] <= hi[axis], "vertex outside the box");
    if (cluster.has_normals()) {
      const Vec3 n = cluster.normal(v);
      require(same_bits(&n, &normals[v], sizeof n), "normals differ");
      require(std::abs(glm::length(n) - 1.0f) < 1e-3f, "normal not of unit length");
    }
    if (cluster.has_uvs()) {
      const Vec2 uv = cluster.uv(v);
      require(same_bits(&uv, &uvs[v], sizeof uv), "texture coordinates differ");
      require(std::isfinite(uv.x) && std::isfinite(uv.y), "texture coordinate not finite");
    }
  }
  for (uint32_t i = 0; i < count; ++i) {
    const Triangle t = cluster.triangle(i);
    require(std::max({t.x, t.y, t.z}) < vertices, "vertex index out of range");
    require(t == triangles[i], "triangles differ");
  }
  (void)cluster.stream_bits();
}

void read_geometry(const BakedFile& file, uint32_t geometry) {
  const auto clusters = static_cast<uint32_t>(file.clusters(geometry).size());
  for (uint32_t c = 0; c < clusters; ++c) {
    const ClusterView cluster = file.cluster(geometry, c);
    require(cluster.material_slot() < file.geometries()[geometry].slot_count, "material slot");
    read_cluster(cluster);
    const uint32_t first = cluster.record().first_triangle;
    for (const uint32_t triangle : {first, first + cluster.triangle_count() - 1})
      require(file.cluster_of_triangle(geometry, triangle) == c, "cluster of a triangle");
  }
}

/// Each cluster of level 0 leads up one chain of groups. Along it, errors grow and each sphere contains those below.
void read_lod(const BakedFile& file, uint32_t geometry) {
  const LodView lod = file.lod(geometry);
  std::vector<uint32_t> above(lod.groups.size(), baked::kNoLodGroup); // a group made from this one
  for (size_t level = 0; level < lod.levels.size(); ++level) {
    const std::vector<LodLink> links = lod.links_of(level);
    require(links.size() == file.clusters(lod.levels[level].geometry).size(), "number of links");
    for (const LodLink& link : links) {
      require(link.group < lod.groups.size() && lod.groups[link.group].level == level, "group of a cluster");
      if (link.generating_group != baked::kNoLodGroup) above[link.generating_group] = link.group;
    }
  }
  for (uint32_t i = 0; i < above.size(); ++i) {
    require((above[i] == baked::kNoLodGroup) == std::isinf(lod.groups[i].error), "terminal group");
    if (above[i] == baked::kNoLodGroup) continue;
    require(above[i] > i && lod.groups[above[i]].error >= lod.groups[i].error, "error of a group");
    require(baked::holds_sphere(lod.groups[above[i]], lod.groups[i]), "sphere of a group");
  }
}

/// Every node except a tree's root is the child of one node, and no deeper than the record says. Each triangle that any
/// ray class sees is in one leaf of its geometry's tree.
void read_trees(const BakedFile& file) {
  const BakedSections& sections = file.sections();
  std::vector<std::vector<uint32_t>> leaves;
  for (const baked::ClusterRecord& cluster : sections.clusters) leaves.emplace_back(cluster.triangle_count);
  for (const baked::TreeRecord& tree : sections.trees) {
    const auto nodes = sections.nodes.subspan(static_cast<size_t>(tree.first_node), tree.node_count);
    std::vector<uint32_t> depth(nodes.size());
    if (!depth.empty()) depth[0] = 1;
    for (uint32_t n = 0; n < nodes.size(); ++n) {
      require(depth[n] > 0 && depth[n] <= tree.depth && tree.depth <= baked::kMaxTreeDepth, "depth of a node");
      uint32_t child = nodes[n].first_child, triangle = nodes[n].first_triangle;
      for (const uint8_t kind : nodes[n].children)
        if (kind == baked::kInnerChild) {
          require(child > n && child < nodes.size() && depth[child] == 0, "child of a node");
          depth[child++] = depth[n] + 1;
        } else
          for (uint32_t i = 0; i < kind; ++i) ++leaves.at(nodes[n].cluster).at(triangle++);
    }
  }
  if (sections.trees.empty()) return;
  for (uint32_t g = 0; g < file.geometries().size(); ++g) {
    uint32_t c = static_cast<uint32_t>(file.geometries()[g].first_cluster);
    for (uint32_t material_class = 0; material_class < 8; ++material_class)
      for (uint32_t i = 0; i < file.geometries()[g].class_clusters[material_class]; ++i, ++c)
        for (const uint32_t count : leaves[c]) require(count == ((material_class & 3) != 3), "leaf of a triangle");
  }
}

/// Every frame is decoded to the same vertices from the begin of its group and after others.
void read_frames(const BakedFile& file) {
  const auto records = deformation_records(file.sections().deformation);
  for (uint32_t i = 0; i < records.size(); ++i) {
    DeformationPlayer player(file, i);
    for (const uint32_t frame : {records[i].frame_count - 1, 1u, 0u}) {
      player.seek(frame);
      for (uint32_t c = 0; c < file.clusters(records[i].geometry).size(); ++c) {
        std::vector<FramePoint> now(file.clusters(records[i].geometry)[c].vertex_count);
        std::vector<FrameVertex> alone(now.size());
        player.read(c, now);
        player.decode(frame, c, alone);
        for (size_t v = 0; v < now.size() && frame + 1 < records[i].frame_count; ++v)
          for (size_t axis = 0; axis < 3; ++axis)
            require(static_cast<uint32_t>(now[v][axis]) == alone[v][axis], "vertex of a frame");
      }
    }
  }
}

void read_motion(const BakedFile& file) {
  RigidMotion motion;
  require(!unpack_rigid_motion(file.sections().rigid_motion, motion), "motion");
  const TimeSpan span = time_span(motion);
  for (const InstanceMotion& moving : motion.instances) {
    require(moving.instance < file.instances().size(), "number of a moving instance");
    for (const double time : {span.begin_s, 0.5 * span.begin_s + 0.5 * span.end_s, span.end_s}) {
      const Affine map(pose(motion, moving, file.world_from_object(moving.instance), time));
      for (int column = 0; column < 4; ++column) require(is_finite(map[column]), "pose");
    }
  }
}

void read_rest(const BakedFile& file) {
  for (uint32_t i = 0; i < file.instances().size(); ++i) {
    const Affine map = file.world_from_object(i);
    for (int column = 0; column < 4; ++column) require(is_finite(map[column]), "instance transform");
    for (const uint32_t material : file.instance_materials(i))
      require(material < file.sections().materials.size(), "material number");
  }
  for (uint32_t i = 0; i < file.sections().masks.size(); ++i) {
    const AlphaMaskView mask = file.mask(i);
    for (const Vec2 uv : {Vec2(0.3f, 0.7f), Vec2(-1e30f, 1e30f), Vec2(0.0f), Vec2(1.0f)}) (void)mask.opaque(uv);
  }
  for (uint32_t i = 0; i < file.sections().textures.size(); ++i) {
    const TextureView texture = file.texture(i);
    (void)texture.texel(texture.width - 1, texture.height - 1);
    for (const Vec2 uv : {Vec2(0.3f, 0.7f), Vec2(-1e30f, 1e30f), Vec2(0.0f), Vec2(1.0f)}) (void)texture.sample(uv);
  }
  for (const Material& material : file.materials()) {
    require(material.albedo_texture == kNoTexture || material.albedo_texture < file.sections().textures.size(),
            "texture number");
    for (const uint32_t mask : {material.alpha_mask, material.shadow_alpha_mask})
      require(mask == kNoMask || mask < file.sections().masks.size(), "mask number");
  }
  const ShadingData shading = file.shading();
  require(shading.materials.size() == (file.has_shading() ? file.sections().materials.size() : 0), "shading");
  for (const Light& light : shading.lights)
    require(light.map == kNoMap || light.map < shading.maps.size(), "map of a light");
  require(file.cameras().size() == file.sections().cameras.size(), "number of cameras");
  (void)file.world_bounds();
  read_frames(file);
  read_motion(file);
  require(summarize(file).bytes.total == file.file_bytes(), "summary of the file");
}

/// Reads voxels all over each grid.
void read_proxies_of(const BakedFile& file) {
  const std::span<const uint8_t> bytes = proxy_bytes(file);
  if (bytes.empty()) return;
  for (const Proxy& proxy : read_proxies(bytes)) {
    require(proxy.record.geometry < file.geometries().size(), "geometry of a proxy");
    const VoxelIndex size = proxy.frame().size;
    if (proxy.is_field()) {
      for (float at = -1.0f; at < static_cast<float>(size[0] + 2); at += 0.7f)
        require(std::isfinite(proxy.field.distance({at, 0.5f * at, 1.5f * at})), "distance");
      continue;
    }
    constexpr uint32_t kSteps = 12;
    for (uint32_t i = 0; i < kSteps * kSteps * kSteps; ++i) {
      const auto at = [&](uint32_t step, uint32_t count) { return step * (count - 1) / (kSteps - 1); };
      const VoxelIndex v = {at(i % kSteps, size[0]), at(i / kSteps % kSteps, size[1]),
                            at(i / kSteps / kSteps, size[2])};
      if (proxy.voxels.test(v)) require(proxy.voxels.swatch(v) <= proxy.palette.size(), "swatch");
    }
  }
}

void read_baked(std::span<const std::byte> bytes) {
  expect_read_or_refused([&] {
    const BakedFile file = BakedFile::from_bytes(bytes);
    for (uint32_t g = 0; g < file.geometries().size(); ++g) read_geometry(file, g);
    for (uint32_t g = 0; g < file.base_geometry_count(); ++g) read_lod(file, g);
    read_trees(file);
    read_proxies_of(file);
    read_rest(file);
  });
}

/// The content hash of decoded pages is wrong after changes, and validation would stop there. So it is repaired.
void read_decoded_pages(std::span<const std::byte> bytes) {
  expect_read_or_refused([&] {
    DiskForm form;
    std::vector<std::byte> resident = expand_paged_file(bytes, "memory", form);
    repair_resident(resident);
    read_baked(resident);
  });
}

} // namespace
} // namespace packtrace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace packtrace::fuzz;
  const std::span bytes = std::as_bytes(std::span(data, size));
  read_baked(bytes);
  std::vector<std::byte> repaired(bytes.begin(), bytes.end());
  repair(repaired);
  read_baked(repaired);
  if (packtrace::is_paged_file(repaired)) read_decoded_pages(repaired);
  return 0;
}
