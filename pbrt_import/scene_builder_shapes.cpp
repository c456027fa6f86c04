// The part of SceneBuilder that turns Shape directives into shapes and, at the end, all of it into a Scene.
#include "pbrt_import/scene_builder.h"

#include <algorithm>
#include <new>
#include <stdexcept>

#include "pbrt_import/scene/error.h"
#include "pbrt_import/shape_builder.h"
#include "pbrt_import/tokenizer.h"
#include "pbrt_import/transforms.h"

namespace packtrace {
namespace {

/// Renumbers the elements that something uses, in order, and drops the others.
template <class Element>
std::vector<uint32_t> keep_used(std::vector<Element>& elements, const std::vector<uint8_t>& used) {
  std::vector<uint32_t> numbers(elements.size(), 0);
  uint32_t count = 0;
  for (size_t i = 0; i < elements.size(); ++i) {
    if (!used[i]) continue;
    numbers[i] = count;
    if (count != i) elements[count] = std::move(elements[i]);
    ++count;
  }
  elements.erase(elements.begin() + count, elements.end());
  return numbers;
}

template <class Function>
void for_each_shape(Scene& scene, Function function) {
  for (Shape& shape : scene.shapes) function(shape);
  for (Object& object : scene.objects)
    for (Shape& shape : object.shapes) function(shape);
}

/// Leaves out meshes, materials and masks that no shape uses.
void drop_unused(Scene& scene) {
  std::vector<uint8_t> meshes(scene.meshes.size()), materials(scene.materials.size()), masks(scene.masks.size());
  for_each_shape(scene, [&](const Shape& shape) { meshes[shape.mesh] = materials[shape.material] = 1; });
  const std::vector<uint32_t> mesh_numbers = keep_used(scene.meshes, meshes);
  const std::vector<uint32_t> material_numbers = keep_used(scene.materials, materials);
  for_each_shape(scene, [&](Shape& shape) {
    shape.mesh = mesh_numbers[shape.mesh];
    shape.material = material_numbers[shape.material];
  });
  const auto for_each_mask = [&](auto function) {
    for (Material& material : scene.materials)
      for (uint32_t* const mask : {&material.alpha_mask, &material.shadow_alpha_mask})
        if (*mask != kNoMask) function(*mask);
  };
  for_each_mask([&](uint32_t mask) { masks[mask] = 1; });
  const std::vector<uint32_t> mask_numbers = keep_used(scene.masks, masks);
  for_each_mask([&](uint32_t& mask) { mask = mask_numbers[mask]; });
}

} // namespace

void SceneBuilder::add_shape(Directive& directive) {
  const std::string& kind = directive.names[0];
  const bool known = kind == "plymesh" || find_shape_kind(kind);
  ++statistics_.shapes[known ? kind : "unknown"];
  Shape shape;
  const Placement placement = place(directive, "shape");
  shape.parent_from_mesh = placement.map;
  shape.animation = placement.animation;
  shape.reverse_orientation = state_.attributes.reverse_orientation;
  bool usable = !directive.damaged; // else reported by the parser
  if (usable && !is_invertible(shape.parent_from_mesh)) {
    reporter_.error(directive.place, "the shape's transform has no inverse (a scale of 0?); the shape is skipped");
    usable = false;
  }
  if (!usable) {
    ++statistics_.shapes_skipped;
    return;
  }
  const TextureContext here = context(directive.place);
  MaterialUse use;
  if (!read_alpha(directive, here, use)) {
    ++statistics_.shapes_absent;
    return;
  }
  if (!make_mesh(directive, shape)) {
    ++statistics_.shapes_skipped;
    return;
  }
  const uint32_t material =
      state_.attributes.material == kNone ? MaterialLibrary::kDefault : state_.attributes.material;
  use.recipe = materials_.with_shape_parameters(material, directive.parameters, here);
  report_unused(directive.parameters, reporter_);
  const bool in_object = current_object_ != kNone;
  if (state_.attributes.area_light != kNone && (in_object || state_.animated())) {
    reporter_.warning(directive.place, std::string("area lights ") + (in_object ? "in objects" : "on animated shapes") +
                                           " do not emit, as in pbrt");
  } else {
    use.area_light = state_.attributes.area_light;
    statistics_.area_lights += use.area_light != kNone;
  }
  shape.material = materials_.use(use);
  (current_object_ == kNone ? scene_.shapes : scene_.objects[current_object_].shapes).push_back(shape);
}

/// @return false if the shape is absent for all rays
bool SceneBuilder::read_alpha(const Directive& directive, const TextureContext& context, MaterialUse& use) {
  if (directive.names[0] != "trianglemesh" && directive.names[0] != "plymesh") return true;
  const TextureParameters parameters(context, directive.parameters);
  const auto is_constant = [&](TextureGraph::Node node, bool zero) {
    const Vec3* const value = graph_.constant_value(node);
    return value && (*value == Vec3(0.0f)) == zero;
  };
  if (const auto alpha = parameters.find_float("alpha"); alpha && !is_constant(*alpha, false)) {
    if (is_constant(*alpha, true)) return false;
    use.alpha = *alpha;
  }
  if (const auto shadow = parameters.find_float("shadowalpha"); shadow && !is_constant(*shadow, false))
    use.shadow_alpha = *shadow;
  return true;
}

bool SceneBuilder::make_mesh(Directive& directive, Shape& shape) {
  return directive.names[0] == "plymesh" ? make_ply_mesh(directive, shape) : make_inline_mesh(directive, shape);
}

bool SceneBuilder::make_ply_mesh(const Directive& directive, Shape& shape) {
  const Parameter* const file = directive.parameters.find("filename", {ParameterType::kString});
  if (!file || file->strings.size() != 1) {
    reporter_.error(directive.place, "plymesh without a \"string filename\"; the shape is skipped");
    return false;
  }
  const std::filesystem::path path = file_names_.resolve(file->strings[0], file->place, reporter_);
  if (path.empty()) return false;
  const auto slot = static_cast<uint32_t>(scene_.meshes.size());
  shape.mesh = loader_.request_ply(path, directive.place, slot);
  if (shape.mesh == slot) scene_.meshes.emplace_back();
  return true;
}

bool SceneBuilder::make_inline_mesh(Directive& directive, Shape& shape) {
  const std::string& name = directive.names[0];
  const ShapeKind* const kind = find_shape_kind(name);
  std::string problem;
  if (!kind) problem = "unknown shape" + did_you_mean(closest_shape_kind(name));
  const ReportFn report = [&](Severity severity, uint32_t, std::string message) {
    reporter_.report(severity, directive.place, name + ": " + message);
  };
  Mesh mesh;
  try {
    ShapeContext shape_context{options_.tessellation_tolerance, report, 0};
    if (problem.empty()) {
      mesh = kind->make(directive.parameters, shape_context);
      scene_.dropped_triangles += shape_context.dropped_triangles;
      if (mesh.triangles.empty()) problem = "no triangle is left";
    }
  } catch (const Error& error) {
    problem = error.what();
  } catch (const std::bad_alloc&) {
    problem = "not enough memory";
  } catch (const std::length_error&) {
    problem = "not enough memory";
  }
  if (problem.empty() && bytes_of(mesh) > options_.memory_budget_bytes - mesh_bytes_)
    problem =
        "all meshes together exceed the memory budget of " + std::to_string(options_.memory_budget_bytes) + " bytes";
  if (!problem.empty()) {
    reporter_.error(directive.place, "Shape " + in_quotes(name) + " is skipped: " + problem);
    return false;
  }
  mesh_bytes_ += bytes_of(mesh);
  mesh.name = name + ":" + std::to_string(directive.place.line);
  shape.mesh = static_cast<uint32_t>(scene_.meshes.size());
  scene_.meshes.push_back(std::move(mesh));
  return true;
}

/// Objects that nothing shows are not worth reading their files.
void SceneBuilder::drop_unused_objects() {
  std::vector<uint8_t> used(scene_.objects.size(), 0);
  for (const Instance& instance : scene_.instances) used[instance.object] = 1;
  for (size_t i = 0; i < scene_.objects.size(); ++i) {
    const Object& object = scene_.objects[i];
    if (!used[i] && !object.shapes.empty())
      reporter_.note(object_places_[i], "object " + in_quotes(object.name) + " is never instanced; it is left out");
    if (object.shapes.empty()) used[i] = 0;
  }
  std::erase_if(scene_.instances, [&](const Instance& instance) { return !used[instance.object]; });
  object_places_.clear(); // numbers change
  object_numbers_.clear();
  const std::vector<uint32_t> numbers = keep_used(scene_.objects, used);
  for (Instance& instance : scene_.instances) instance.object = numbers[instance.object];
}

void SceneBuilder::drop_unusable_shapes(const std::vector<uint32_t>& material_numbers, std::vector<Shape>& shapes) {
  std::erase_if(shapes, [&](Shape& shape) {
    shape.material = material_numbers[shape.material];
    const bool absent = scene_.materials[shape.material].flags & kAbsent;
    const bool empty = scene_.meshes[shape.mesh].triangles.empty(); // its file could not be read
    statistics_.shapes_absent += absent && !empty;
    return absent || empty;
  });
}

ImportResult SceneBuilder::finish(const Place& end, Progress& progress) {
  if (phase_ == Phase::kWorld) {
    reporter_.warning(end, "the file ends without WorldEnd");
    end_world(end);
  } else if (phase_ == Phase::kOptions) {
    reporter_.warning(end, "the file ends without WorldBegin: the scene is empty");
  }
  drop_unused_objects();
  for_each_shape(scene_, [&](const Shape& shape) { loader_.require(shape.mesh); });
  materials_.require_images();
  loader_.load(scene_.meshes, graph_.images(), progress, statistics_, scene_.dropped_triangles);
  for (const ImageRequest& image : graph_.images())
    ++(image.missing ? statistics_.textures_missing : statistics_.textures_found);
  const std::vector<uint32_t> material_numbers = materials_.resolve(scene_.materials, scene_.masks, reporter_);
  drop_unusable_shapes(material_numbers, scene_.shapes);
  for (Object& object : scene_.objects) drop_unusable_shapes(material_numbers, object.shapes);
  if (const uint64_t absent = statistics_.shapes_absent; absent > 0)
    reporter_.note(end, absent == 1 ? "1 shape is left out: its alpha is 0 everywhere"
                                    : std::to_string(absent) + " shapes are left out: their alpha is 0 everywhere");
  drop_unused_objects();
  drop_unused(scene_);
  scene_.cameras = cameras_.finish();
  if (scene_.cameras.size() > 1)
    reporter_.note(end,
                   std::to_string(scene_.cameras.size()) + " cameras: the last one comes first, as pbrt uses that");
  statistics_.triangles = unique_triangle_count(scene_);
  return {std::move(scene_), std::move(statistics_)};
}

} // namespace packtrace
