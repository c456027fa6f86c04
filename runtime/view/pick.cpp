#include "runtime/view/pick.h"

#include <cassert>

#include <fmt/format.h>

#include "pbrt_import/scene/material_flag_names.h"
#include "runtime/frame/view_layers.h"
#include "runtime/view/layer_previews.h"

namespace packtrace {
namespace {

/// The surface at a pixel of the G-buffer.
Pick::Surface surface_at(const ViewFile& file, const FrameLoop& loop, size_t at) {
  const GBuffer& g = loop.gbuffer();
  const SceneSource& source = *loop.scene().source;
  Pick::Surface surface;
  surface.position = DVec3(g.position[at]) + source.origin();
  surface.instance = g.instance[at];
  surface.triangle = g.triangle[at], surface.material = g.material[at];
  surface.back_face = g.back_face[at] != 0;
  const SceneSource& traced = *(loop.config().detail.camera_uses_levels() ? &loop.traced_source() : &source);
  surface.geometry = traced.instances()[g.instance[at]].geometry;
  surface.position_error = traced.position_error(surface.geometry);
  const SurfaceDetail detail = traced.detail_of(g.instance[at], g.triangle[at]);
  surface.level = detail.level, surface.cluster = detail.cluster, surface.error_world = detail.error_world;
  if (file.targets)
    if (const auto& instances = file.targets().instances; g.instance[at] < instances.size())
      surface.instance_name = instances[g.instance[at]].name;
  if (surface.material < file.material_names.size()) surface.material_name = file.material_names[surface.material];
  surface.flags = material_flag_words(source.materials()[surface.material].flags);
  return surface;
}

} // namespace

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
  const GBuffer& g = pane.loop().gbuffer();
  const uint32_t factor = pane.loop().config().supersample;
  const size_t traced = (size_t{y} * factor + factor / 2) * g.size.width + size_t{x} * factor + factor / 2;
  if (g.instance[traced] != kNoInstance) pick.surface = surface_at(file, pane.loop(), traced);
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
  lines.push_back(fmt::format("position error at most {:.3g} per axis", s.position_error));
  return lines;
}

} // namespace packtrace
