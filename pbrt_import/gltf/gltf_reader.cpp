#include "pbrt_import/gltf/gltf_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "pbrt_import/gltf/gltf_primitive.h"
#include "pbrt_import/language/transforms.h"
#include "pbrt_import/text/problem_text.h"

namespace packtrace::gltf {
namespace {

std::string object_name(const Value& mesh, uint64_t number) {
  return mesh.text_or("name", "mesh") + "#" + std::to_string(number);
}

} // namespace

Reader::Reader(const std::filesystem::path& file, uint32_t file_number, const MeshFileContext& context,
               const DAffine& world_from_file)
    : context_(context), world_from_file_(world_from_file),
      document_(std::make_unique<Document>(file, file_number, context)), animation_(*document_),
      pose_time_(context.options.frames_per_second ? animation_.repeated(0.0) : context.options.time.value_or(0.0)),
      nodes_(place_nodes(*document_, animation_, context.options.time.value_or(0.0))),
      tracks_(*document_, animation_, nodes_, world_from_file_), is_object_(document_->count("meshes"), 0) {
  if (context.options.frames_per_second) posed_ = nodes_at(*document_, animation_, nodes_, pose_time_);
  collect_meshes();
}

void Reader::report(const std::string& problem, std::string_view consequence) {
  if (!problem.empty()) context_.feed.reporter().error(document_->place(), problem + "; " + std::string(consequence));
}

void Reader::collect_meshes() {
  MemoryReservation& memory = document_->memory();
  memory.resize(memory.bytes() + nodes_.size() * sizeof(MeshUse), "nodes of the glTF document");
  uses_.reserve(nodes_.size());
  Skins skins(*document_, nodes_);
  PosedSkins posed_skins(skins, posed());
  for (size_t i = 0; i < nodes_.size(); ++i) {
    context_.progress.check_cancelled();
    report(problem_of([&] { collect_mesh(i, skins, posed_skins); }), "the node is left out");
  }
  if (context_.options.frames_per_second) collect_frames(skins);
  std::vector<uint64_t> counts(is_object_.size(), 0);
  for (const MeshUse& use : uses_)
    if (use.pose.empty()) counts[static_cast<size_t>(use.mesh)] += use.motion ? 2 : use.node_from_mesh.size();
  for (size_t i = 0; i < counts.size(); ++i) is_object_[i] = counts[i] > 1;
  for (const MeshUse& use : uses_) // of meshes that are placed once
    if (use.pose.empty() && counts[static_cast<size_t>(use.mesh)] == 1 && leaves_lattice(use))
      is_object_[static_cast<size_t>(use.mesh)] = 1;
}

/// Whether the mesh states a lattice and its positions in world space do not lie on that lattice, because its node
/// rotates it, scales it non-uniformly or negatively, or translates it by a fraction of a step.
bool Reader::leaves_lattice(const MeshUse& use) {
  std::optional<std::vector<int32_t>> lattice;
  const std::string problem =
      problem_of([&] { lattice = stated_lattice(*document_, document_->element("meshes", use.mesh)); });
  // add_gltf_primitive() reports a malformed lattice.
  if (!problem.empty() || !lattice || use.node_from_mesh.empty()) return false;
  const DAffine map =
      compose(compose(world_from_file_, nodes_[use.placed].world_from_node), use.node_from_mesh.front());
  const double scale = map[0].x, step = std::ldexp(static_cast<double>((*lattice)[0]), (*lattice)[1]) * scale;
  if (glm::dmat3(map) != glm::dmat3(scale) || !(scale > 0.0)) return true;
  const DVec3 steps = map[3] / step;
  return steps != glm::round(steps);
}

void Reader::collect_mesh(size_t placed, Skins& skins, PosedSkins& posed_skins) {
  const Value node = document_->element("nodes", nodes_[placed].node);
  const std::optional<uint64_t> mesh = node.find_integer("mesh");
  if (!mesh) return;
  document_->element("meshes", *mesh); // throws if there is none
  MeshUse use;
  use.mesh = *mesh;
  use.weights_of = placed;
  use.pose.weights = posed()[placed].weights;
  use.deforms = animation_.morphs(nodes_[placed].node);
  use.skin = node.find_integer("skin");
  if (use.skin) {
    use.pose.joints = posed_skins.maps(*use.skin);
    use.deforms |= skins.moves(*use.skin, nodes_);
  } else {
    use.placed = placed;
    use.node_from_mesh = instances_of(*document_, node);
    report(problem_of([&] { use.motion = tracks_.of(placed); }), "the node and all that hangs on it stand still");
  }
  uses_.push_back(std::move(use));
}

/// Evaluates the weights of morph targets and the joint maps of all frames.
void Reader::collect_frames(Skins& skins) {
  const double span_s = animation_.span().end_s - animation_.span().begin_s;
  std::map<size_t, std::shared_ptr<PoseFrames>> moving; // by index in uses_
  for (size_t i = 0; i < uses_.size(); ++i)
    if (uses_[i].deforms) moving[i] = std::make_shared<PoseFrames>();
  if (moving.empty() || !(span_s > 0.0)) return;
  const double wanted = std::max(2.0, std::floor(span_s * *context_.options.frames_per_second + 0.5));
  if (!(wanted <= double{std::numeric_limits<int32_t>::max()}))
    throw Error(ErrorKind::kLimitExceeded, "the animation has too many frames");
  const auto count = static_cast<uint32_t>(wanted);
  const double rate = wanted / span_s;
  for (const auto& [i, frames] : moving) {
    const uint64_t each = sizeof(std::vector<double>) + sizeof(JointMaps) +
                          uses_[i].pose.weights.size() * sizeof(double) +
                          (uses_[i].skin ? 64 + uses_[i].pose.joints->size() * sizeof(DAffine) : 0);
    frames->memory = MemoryReservation(context_.options.memory);
    frames->memory.resize(count * each, "poses of the glTF document");
    frames->count = count, frames->frames_per_second = rate;
    frames->weights.resize(count), frames->joints.resize(count);
  }
  for (uint32_t frame = 0; frame < count; ++frame) {
    context_.progress.check_cancelled();
    const std::vector<PlacedNode> nodes =
        nodes_at(*document_, animation_, nodes_, animation_.repeated(static_cast<double>(frame) / rate));
    PosedSkins posed_skins(skins, nodes);
    for (const auto& [i, frames] : moving) {
      frames->weights[frame] = nodes[uses_[i].weights_of].weights;
      if (uses_[i].skin) frames->joints[frame] = posed_skins.maps(*uses_[i].skin);
    }
  }
  for (const auto& [i, frames] : moving) uses_[i].pose.frames = frames;
}

void Reader::report_motion() {
  const bool deforms = std::ranges::any_of(uses_, [](const MeshUse& use) { return use.deforms; });
  if (deforms && !context_.options.frames_per_second)
    context_.feed.reporter().note(document_->place(), "morph targets and skins stand as at " + to_text(pose_time_) +
                                                          " s; bake --sequence animation keeps their motion");
  const TimeSpan span = animation_.span();
  const uint64_t tracks = tracks_.count();
  if (tracks > 0)
    context_.feed.reporter().note(
        document_->place(), "the animation makes " + std::to_string(tracks) + (tracks == 1 ? " track" : " tracks") +
                                " from " + to_text(span.begin_s) + " to " + to_text(span.end_s) + " s, which repeat");
}

void Reader::add_cameras() {
  for (size_t i = nodes_.size(); i-- > 0;)
    report(problem_of([&] {
             const Value node = document_->element("nodes", nodes_[i].node);
             if (const std::optional<uint64_t> camera = node.find_integer("camera")) add_camera(i, *camera);
           }),
           "the camera is left out");
}

void Reader::add_camera(size_t placed, uint64_t number) {
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
  const DAffine world_from_camera = compose(compose(world_from_file_, nodes_[placed].world_from_node), flip);
  if (!(std::abs(glm::determinant(glm::dmat3(world_from_camera))) > 0.0))
    camera.fail("is placed by a map without an inverse");
  TrackedMotion motion;
  report(problem_of([&] { motion.track = tracks_.track_with(placed, flip).value_or(kNoTrack); }),
         "the camera stands still");
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
  feed.moves(motion);
  feed.send();
  feed.transform("Transform", document_->place(), DAffine(1.0));
}

void Reader::add_world() {
  const Materials materials(*document_, context_.file_names);
  add_objects(materials);
  for (const MeshUse& use : uses_) {
    context_.progress.check_cancelled();
    add_use(materials, use);
  }
  for (const PlacedNode& placed : nodes_)
    report(problem_of([&] {
             const std::optional<Value> light =
                 document_->element("nodes", placed.node).extension("KHR_lights_punctual");
             if (light) add_light(placed, light->at("light").integer());
           }),
           "the light is left out");
  report_motion();
}

void Reader::add_objects(const Materials& materials) {
  for (size_t i = 0; i < is_object_.size(); ++i) {
    if (!is_object_[i]) continue;
    context_.progress.check_cancelled();
    report(problem_of([&] { add_object(materials, i, {}, object_name(document_->element("meshes", i), i)); }),
           "the mesh is left out");
  }
}

void Reader::add_object(const Materials& materials, uint64_t mesh, const Pose& pose, const std::string& name) {
  DirectiveFeed& feed = context_.feed;
  feed.with_attributes(document_->place(), [&] {
    feed.transform("Transform", document_->place(), DAffine(1.0));
    feed.begin("ObjectBegin", document_->place(), {name});
    feed.send();
    add_shapes(materials, mesh, pose);
    feed.begin("ObjectEnd", document_->place());
    feed.send();
  });
}

void Reader::add_use(const Materials& materials, const MeshUse& use) {
  DirectiveFeed& feed = context_.feed;
  const bool shared = use.pose.empty() && is_object_[static_cast<size_t>(use.mesh)];
  std::string name;
  if (shared || use.alone()) name = object_name(document_->element("meshes", use.mesh), use.mesh);
  if (use.alone()) {
    name += "@" + std::to_string(nodes_[use.placed].node);
    add_object(materials, use.mesh, use.pose, name);
  }
  const DAffine world_from_node = use.placed == kNoNode ? DAffine(1.0) : nodes_[use.placed].world_from_node;
  for (const DAffine& node_from_mesh : use.node_from_mesh)
    feed.with_attributes(document_->place(), [&] {
      feed.transform("ConcatTransform", document_->place(), compose(world_from_node, node_from_mesh));
      if (name.empty()) return add_shapes(materials, use.mesh, use.pose);
      feed.begin("ObjectInstance", document_->place(), {name});
      if (use.motion) feed.moves({use.motion->track, compose(use.motion->inner, node_from_mesh)});
      feed.send();
    });
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
  if (placed.mover != kNoNode)
    feed.reporter().note(document_->place(), light.path() + " stands still, though its node moves");
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
