#include "pbrt_import/gltf/gltf_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <ranges>

#include "pbrt_import/gltf/gltf_primitive.h"
#include "pbrt_import/text/problem_text.h"

namespace packtrace::gltf {
Reader::Reader(const std::filesystem::path& file, uint32_t file_number, const MeshFileContext& context)
    : context_(context), document_(std::make_unique<Document>(file, file_number, context)),
      nodes_(place_nodes(*document_, context.options.time.value_or(0.0))) {
  collect_meshes();
}

void Reader::report(const std::string& problem, std::string_view consequence) {
  if (!problem.empty()) context_.feed.reporter().error(document_->place(), problem + "; " + std::string(consequence));
}

void Reader::collect_meshes() {
  Skins skins(*document_, nodes_);
  for (const PlacedNode& placed : nodes_) {
    context_.progress.check_cancelled();
    report(problem_of([&] {
             const Value node = document_->element("nodes", placed.node);
             const std::optional<uint64_t> mesh = node.find_integer("mesh");
             if (!mesh) return;
             document_->element("meshes", *mesh); // throws if there is none
             Pose pose{placed.weights, {}};
             if (const std::optional<uint64_t> skin = node.find_integer("skin")) {
               pose.joints = skins.joint_maps(*skin);
               uses_.push_back({*mesh, DAffine(1.0), std::move(pose)}); // the node's own map does not matter
               return;
             }
             const std::vector<DAffine> maps = instances_of(*document_, node);
             document_->memory().resize(document_->memory().bytes() + maps.size() * sizeof(MeshUse),
                                        "instances of the glTF document");
             for (const DAffine& map : maps) uses_.push_back({*mesh, compose(placed.world_from_node, map), pose});
           }),
           "the node is left out");
  }
}

void Reader::add_cameras(const DAffine& world_from_file) {
  for (const PlacedNode& placed : nodes_ | std::views::reverse)
    report(problem_of([&] {
             const Value node = document_->element("nodes", placed.node);
             if (const std::optional<uint64_t> camera = node.find_integer("camera"))
               add_camera(placed, *camera, world_from_file);
           }),
           "the camera is left out");
}

void Reader::add_camera(const PlacedNode& placed, uint64_t number, const DAffine& world_from_file) {
  const Value camera = document_->element("cameras", number);
  const bool perspective = camera.at("type").text() == "perspective";
  if (!perspective && camera.at("type").text() != "orthographic") camera.fail("has an unknown type");
  const Value lens = camera.at(perspective ? "perspective" : "orthographic");
  const double up = perspective ? lens.at("yfov").number() : lens.at("ymag").number();
  const double across = perspective ? 0.0 : lens.at("xmag").number();
  const double aspect = perspective ? lens.number_or("aspectRatio", 16.0 / 9.0) : std::abs(across / up);
  if (!(up > 0.0) || (perspective && up >= std::numbers::pi) || !(aspect > 1e-4 && aspect < 1e4))
    lens.fail("has a field of view that is not possible");
  DirectiveFeed& feed = context_.feed;
  constexpr double kHeight = 720.0, kMaxSide = 65536.0;
  const std::array<int32_t, 2> size = {static_cast<int32_t>(std::clamp(std::round(kHeight * aspect), 1.0, kMaxSide)),
                                       720};
  feed.begin("Film", document_->place(), {"image"});
  feed.integers("xresolution", {&size[0], 1});
  feed.integers("yresolution", {&size[1], 1});
  feed.send();
  // glTF's cameras look along -z, pbrt's along +z.
  const DAffine flip(1, 0, 0, 0, 1, 0, 0, 0, -1, 0, 0, 0);
  const DAffine world_from_camera = compose(compose(world_from_file, placed.world_from_node), flip);
  if (!(std::abs(glm::determinant(glm::dmat3(world_from_camera))) > 0.0))
    camera.fail("is placed by a map without an inverse");
  feed.transform("Transform", document_->place(), inverse(world_from_camera));
  feed.begin("Camera", document_->place(), {perspective ? "perspective" : "orthographic"});
  if (perspective) { // pbrt's angle is that of the shorter side
    const double half = std::tan(0.5 * up) * std::min(aspect, 1.0);
    feed.number("fov", static_cast<float>(2.0 * std::atan(half) * 180.0 / std::numbers::pi));
  } else {
    const std::array<float, 4> window = {static_cast<float>(-std::abs(across)), static_cast<float>(std::abs(across)),
                                         static_cast<float>(-up), static_cast<float>(up)};
    feed.floats(ParameterType::kFloat, "screenwindow", window);
  }
  feed.send();
  feed.transform("Transform", document_->place(), DAffine(1.0));
}

void Reader::add_world() {
  DirectiveFeed& feed = context_.feed;
  const Materials materials(*document_, context_.file_names);
  std::vector<uint32_t> counts(document_->count("meshes"), 0);
  for (const MeshUse& use : uses_)
    if (use.pose.empty()) ++counts[static_cast<size_t>(use.mesh)];
  const auto object_name = [](uint64_t mesh, const Value& value) {
    return value.text_or("name", "mesh") + "#" + std::to_string(mesh);
  };
  for (size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] < 2) continue;
    context_.progress.check_cancelled();
    report(problem_of([&] {
             feed.with_attributes(document_->place(), [&] {
               feed.transform("Transform", document_->place(), DAffine(1.0));
               feed.begin("ObjectBegin", document_->place(), {object_name(i, document_->element("meshes", i))});
               feed.send();
               add_shapes(materials, i, {});
               feed.begin("ObjectEnd", document_->place());
               feed.send();
             });
           }),
           "the mesh is left out");
  }
  for (const MeshUse& use : uses_) {
    context_.progress.check_cancelled();
    feed.with_attributes(document_->place(), [&] {
      feed.transform("ConcatTransform", document_->place(), use.world_from_mesh);
      if (!use.pose.empty() || counts[static_cast<size_t>(use.mesh)] < 2)
        return add_shapes(materials, use.mesh, use.pose);
      feed.begin("ObjectInstance", document_->place(), {object_name(use.mesh, document_->element("meshes", use.mesh))});
      feed.send();
    });
  }
  for (const PlacedNode& placed : nodes_)
    report(problem_of([&] {
             const std::optional<Value> light =
                 document_->element("nodes", placed.node).extension("KHR_lights_punctual");
             if (light) add_light(placed, light->at("light").integer());
           }),
           "the light is left out");
}

void Reader::add_shapes(const Materials& materials, uint64_t number, const Pose& pose) {
  const Value mesh = document_->element("meshes", number);
  const std::string problem = problem_of([&] {
    const Value primitives = mesh.at("primitives");
    for (size_t i = 0; i < primitives.size(); ++i)
      report(problem_of([&] { add_gltf_primitive(*document_, materials, mesh, primitives[i], pose); }),
             "the primitive is left out");
  });
  report(problem, "the mesh is left out");
}

/// A light shines along its node's -z. Intensities are candela, or lux for directional ones; pbrt has no units of its
/// own.
void Reader::add_light(const PlacedNode& placed, uint64_t number) {
  const Value lights = document_->root().extension("KHR_lights_punctual").value_or(document_->root());
  const Value light = lights.at("lights")[static_cast<size_t>(number)];
  const std::string type = light.at("type").text();
  const std::vector<double> colour = light.numbers_or("color", {1.0, 1.0, 1.0});
  const auto intensity = static_cast<float>(light.number_or("intensity", 1.0));
  const Vec3 power =
      intensity * Vec3(static_cast<float>(colour[0]), static_cast<float>(colour[1]), static_cast<float>(colour[2]));
  DirectiveFeed& feed = context_.feed;
  const std::array<float, 3> origin = {0, 0, 0}, ahead = {0, 0, -1}, behind = {0, 0, 1};
  feed.with_attributes(document_->place(), [&] {
    feed.transform("ConcatTransform", document_->place(), placed.world_from_node);
    if (type == "directional") {
      feed.begin("LightSource", document_->place(), {"distant"});
      feed.colour("L", power);
      feed.floats(ParameterType::kPoint3, "from", behind);
      feed.floats(ParameterType::kPoint3, "to", origin);
    } else if (type == "point" || type == "spot") {
      feed.begin("LightSource", document_->place(), {type});
      feed.colour("I", power);
      feed.floats(ParameterType::kPoint3, "from", origin);
      if (type == "spot") {
        feed.floats(ParameterType::kPoint3, "to", ahead);
        const std::optional<Value> cone = light.find("spot");
        const double outer = cone ? cone->number_or("outerConeAngle", std::numbers::pi / 4) : std::numbers::pi / 4;
        const double inner = cone ? cone->number_or("innerConeAngle", 0.0) : 0.0;
        feed.number("coneangle", static_cast<float>(outer * 180.0 / std::numbers::pi));
        feed.number("conedeltaangle", static_cast<float>((outer - inner) * 180.0 / std::numbers::pi));
      }
    } else {
      light.fail("has an unknown type");
    }
    feed.send();
  });
}

} // namespace packtrace::gltf
