#include "runtime/view/pick.h"

#include <algorithm>
#include <cassert>

#include <fmt/format.h>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/material_flag_names.h"
#include "runtime/frame/view_layers.h"
#include "runtime/view/layer_previews.h"

namespace packtrace {
namespace {

/// Adds what the cluster of a surface takes in the file.
void add_cluster(const BakedFile& file, Pick::Surface& surface) {
  const auto geometries = file.geometries();
  const auto next = std::ranges::upper_bound(geometries, uint64_t{surface.cluster}, {},
                                             [](const auto& geometry) { return uint64_t{geometry.first_cluster}; });
  if (next == geometries.begin()) return;
  const auto geometry = static_cast<uint32_t>(next - geometries.begin() - 1);
  const auto local = static_cast<uint32_t>(surface.cluster - geometries[geometry].first_cluster);
  if (local >= file.clusters(geometry).size()) return;
  const ClusterView cluster = file.cluster(geometry, local);
  surface.cluster_triangles = cluster.triangle_count(), surface.cluster_vertices = cluster.vertex_count();
  const ClusterView::StreamBits bits = cluster.stream_bits();
  for (const auto& [name, stream] : {std::pair("indices", bits.indices), std::pair("positions", bits.positions),
                                     std::pair("normals", bits.normals), std::pair("uvs", bits.uvs)})
    if (stream > 0) surface.cluster_bytes.emplace_back(name, (stream + 7) / 8);
  surface.cluster_bytes.emplace_back("record", sizeof(baked::ClusterRecord));
}

} // namespace

std::optional<Pick::Surface> pick_surface(const ViewFile& file, const FrameLoop& loop, uint32_t x, uint32_t y) {
  assert(x < loop.config().size.width && y < loop.config().size.height);
  const uint32_t factor = loop.config().supersample;
  const std::optional<CameraHit> hit = loop.hit_at(x * factor + factor / 2, y * factor + factor / 2);
  if (!hit) return std::nullopt;
  const SceneSource& source = *loop.scene().source;
  Pick::Surface surface;
  surface.position = DVec3(hit->position) + source.origin();
  surface.instance = hit->instance;
  surface.triangle = hit->triangle, surface.material = hit->material;
  surface.back_face = hit->back_face;
  const SceneSource& traced = *(loop.config().detail.camera_uses_levels() ? &loop.traced_source() : &source);
  surface.geometry = traced.instances()[hit->instance].geometry;
  surface.position_error = traced.position_error(surface.geometry);
  const SurfaceDetail detail = traced.detail_of(hit->instance, hit->triangle);
  surface.level = detail.level, surface.cluster = detail.cluster, surface.error_world = detail.error_world;
  if (loop.scene().file != nullptr) add_cluster(*loop.scene().file, surface);
  if (file.targets)
    if (const auto& instances = file.targets().instances; hit->instance < instances.size())
      surface.instance_name = instances[hit->instance].name;
  if (surface.material < file.material_names.size()) surface.material_name = file.material_names[surface.material];
  surface.flags = material_flag_words(source.materials()[surface.material].flags);
  return surface;
}

Pick pick_pixel(const ViewFile& file, const PaneRenderer& pane, uint32_t x, uint32_t y) {
  const RenderedImage& image = pane.image();
  assert(x < image.size.width && y < image.size.height);
  Pick pick;
  pick.x = x, pick.y = y;
  const size_t at = size_t{y} * image.size.width + x;
  pick.hit = image.coverage[at] > 0.0f;
  if (!pick.hit) return pick;
  pick.ao = image.ao[at], pick.ao_raw = image.ao_raw[at], pick.depth = image.depth[at];
  pick.normal = image.normal[at], pick.albedo = image.albedo[at];
  pick.instance = image.instance[at];
  const auto add = [&](const char* name) {
    if (const std::vector<float>* view = view_of(image, name); view != nullptr && !view->empty())
      pick.views.emplace_back(name, (*view)[at]);
  };
  if (pane.loop().config().view_layers) {
    for (const char* name : kTracedViews) add(name);
    for (const char* name : kDenoiserViews) add(name);
  }
  pick.surface = pick_surface(file, pane.loop(), x, y);
  return pick;
}

std::vector<std::string> pick_lines(const Pick& p) {
  if (!p.hit) return {"nothing"};
  std::vector<std::string> lines;
  lines.push_back(fmt::format("ao {:.4f}, last frame {:.4f}, depth {:.5g}", p.ao, p.ao_raw, p.depth));
  lines.push_back(fmt::format("normal {:.4f} {:.4f} {:.4f}", p.normal.x, p.normal.y, p.normal.z));
  lines.push_back(fmt::format("albedo {:.4f} {:.4f} {:.4f}", p.albedo.x, p.albedo.y, p.albedo.z));
  lines.push_back(fmt::format("instance {} {}", p.instance, p.surface ? p.surface->instance_name : ""));
  for (size_t i = 0; i < p.views.size(); ++i) { // two in a line
    const auto& [name, value] = p.views[i];
    const std::string text = fmt::format("{} {:.5g}", name, value);
    if (i % 2 == 0)
      lines.push_back(text);
    else
      lines.back() += ", " + text;
  }
  if (!p.surface) return lines;
  const Pick::Surface& s = *p.surface;
  lines.push_back(fmt::format("position {:.6g} {:.6g} {:.6g}", s.position.x, s.position.y, s.position.z));
  lines.push_back(fmt::format("material {} {}", s.material, s.material_name));
  lines.push_back("flags " + s.flags);
  lines.push_back(
      fmt::format("geometry {}, triangle {}, {} side", s.geometry, s.triangle, s.back_face ? "back" : "front"));
  lines.push_back(fmt::format("level {}, cluster {}, error bound {:.3g}", s.level, s.cluster, s.error_world));
  if (!s.cluster_bytes.empty()) {
    lines.push_back(fmt::format("{} triangles, {} vertices in the cluster", s.cluster_triangles, s.cluster_vertices));
    std::string text;
    for (const auto& [name, bytes] : s.cluster_bytes)
      text += fmt::format("{}{} {} B", text.empty() ? "" : ", ", name, bytes);
    lines.push_back(text);
  }
  lines.push_back(fmt::format("position error at most {:.3g} per axis", s.position_error));
  return lines;
}

} // namespace packtrace
