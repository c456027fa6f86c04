#include "pbrt_import/gltf/gltf_nodes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <ranges>

#include <glm/gtc/quaternion.hpp>

#include "pbrt_import/gltf/gltf_accessors.h"
#include "pbrt_import/text/problem_text.h"

namespace packtrace::gltf {
namespace {

DVec3 to_dvec3(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

/// What an animation sets of a node.
struct AnimatedValues {
  std::optional<std::vector<double>> translation, rotation, scale, weights;
};

/// Values of a sampler at a time. Source: glTF 2.0 specification, appendix C.
std::vector<double> evaluate(const std::vector<float>& times, const std::vector<float>& values, size_t components,
                             const std::string& interpolation, double time, bool rotates) {
  const bool cubic = interpolation == "CUBICSPLINE";
  const size_t stride = components * (cubic ? 3 : 1), shift = cubic ? components : 0;
  const auto value = [&](size_t key, size_t i) { return double{values[key * stride + shift + i]}; };
  std::vector<double> result(components);
  const auto after = std::ranges::upper_bound(times, time, {}, [](float t) { return double{t}; });
  const auto next = static_cast<size_t>(after - times.begin());
  if (next == 0 || next == times.size() || interpolation == "STEP") {
    for (size_t i = 0; i < components; ++i) result[i] = value(next == 0 ? 0 : next - 1, i);
    return result;
  }
  const size_t key = next - 1;
  const double span = double{times[next]} - double{times[key]}, t = (time - double{times[key]}) / span;
  if (!cubic && rotates) { // rotations are interpolated on the sphere
    const auto quaternion = [&](size_t k) { return glm::dquat(value(k, 3), value(k, 0), value(k, 1), value(k, 2)); };
    const glm::dquat q = glm::slerp(quaternion(key), quaternion(next), t);
    return {q.x, q.y, q.z, q.w};
  }
  for (size_t i = 0; i < components; ++i) {
    if (!cubic) {
      result[i] = value(key, i) + (value(next, i) - value(key, i)) * t;
      continue;
    }
    const double out = span * double{values[key * stride + 2 * components + i]},
                 in = span * double{values[next * stride + i]};
    const double t2 = t * t, t3 = t2 * t;
    result[i] = (2 * t3 - 3 * t2 + 1) * value(key, i) + (t3 - 2 * t2 + t) * out + (3 * t2 - 2 * t3) * value(next, i) +
                (t3 - t2) * in;
  }
  return result;
}

void read_channel(Document& document, const Value& animation, const Value& channel, double time,
                  std::map<uint64_t, AnimatedValues>& animated) {
  const Value target = channel.at("target");
  const std::optional<uint64_t> node = target.find_integer("node");
  const std::string path = target.at("path").text();
  if (!node) return;
  const bool rotates = path == "rotation";
  const bool morphs = path == "weights";
  if (!rotates && !morphs && path != "translation" && path != "scale") target.fail("has an unknown path");
  const Value sampler = animation.at("samplers")[static_cast<size_t>(channel.at("sampler").integer())];
  const std::string interpolation = sampler.text_or("interpolation", "LINEAR");
  if (interpolation != "LINEAR" && interpolation != "STEP" && interpolation != "CUBICSPLINE")
    sampler.fail("has an unknown interpolation");
  const ValuesInUse in_use(document);
  const AccessorValues times = read_floats(document, sampler.at("input").integer());
  const AccessorValues values = read_floats(document, sampler.at("output").integer());
  const uint64_t keys = times.count * (interpolation == "CUBICSPLINE" ? 3 : 1);
  const bool fits = times.components == 1 && keys > 0 &&
                    (morphs ? values.components == 1 && values.count % keys == 0 && values.count > 0
                            : values.components == (rotates ? 4u : 3u) && values.count == keys);
  if (!fits) sampler.fail("has times and values that do not fit each other");
  for (size_t i = 1; i < times.values.size(); ++i)
    if (!(times.values[i] > times.values[i - 1])) sampler.fail("has times that do not increase");
  const size_t components = values.values.size() / static_cast<size_t>(keys); // of morphing: its targets
  std::vector<double> value = evaluate(times.values, values.values, components, interpolation, time, rotates);
  if (!std::ranges::all_of(value, [](double v) { return std::isfinite(v); }))
    sampler.fail("has values that are not finite");
  AnimatedValues& set = animated[*node];
  (rotates ? set.rotation : morphs ? set.weights : path == "scale" ? set.scale : set.translation) = std::move(value);
}

/// Values that the document's first animation gives nodes at a time; further animations are alternatives to it.
std::map<uint64_t, AnimatedValues> animate(Document& document, double time) {
  std::map<uint64_t, AnimatedValues> animated;
  Reporter& reporter = document.context().feed.reporter();
  if (document.count("animations") == 0) return animated;
  if (document.count("animations") > 1) reporter.note(document.place(), "of several animations the first is used");
  const std::string problem = problem_of([&] {
    const Value animation = document.element("animations", 0), channels = animation.at("channels");
    for (size_t i = 0; i < channels.size(); ++i) read_channel(document, animation, channels[i], time, animated);
  });
  if (!problem.empty()) reporter.error(document.place(), problem + "; the animation ends there");
  return animated;
}

DAffine local_map(const Value& node, const AnimatedValues& animated) {
  if (const std::optional<Value> matrix = node.find("matrix")) {
    const std::vector<double> m = matrix->numbers(16);
    if (m[3] != 0.0 || m[7] != 0.0 || m[11] != 0.0 || m[15] != 1.0) matrix->fail("is not affine");
    return DAffine(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10], m[12], m[13], m[14]);
  }
  return compose_trs(to_dvec3(animated.translation.value_or(node.numbers_or("translation", {0.0, 0.0, 0.0}))),
                     animated.rotation.value_or(node.numbers_or("rotation", {0.0, 0.0, 0.0, 1.0})),
                     to_dvec3(animated.scale.value_or(node.numbers_or("scale", {1.0, 1.0, 1.0}))));
}

/// The roots of the document's scene; without scenes, all nodes that are nobody's child.
std::vector<uint64_t> scene_roots(Document& document) {
  std::vector<uint64_t> roots;
  const size_t count = document.count("nodes");
  if (document.count("scenes") > 0) {
    const Value scene = document.element("scenes", document.root().find_integer("scene").value_or(0));
    if (document.count("scenes") > 1)
      document.context().feed.reporter().note(document.place(), "of several scenes the default one is read");
    const std::optional<Value> nodes = scene.find("nodes");
    for (size_t i = 0; nodes && i < nodes->size(); ++i) roots.push_back((*nodes)[i].integer());
    return roots;
  }
  std::vector<bool> is_child(count, false);
  for (size_t i = 0; i < count; ++i) {
    const std::optional<Value> children = document.element("nodes", i).find("children");
    for (size_t k = 0; children && k < children->size(); ++k)
      if (const uint64_t child = (*children)[k].integer(); child < count) is_child[static_cast<size_t>(child)] = true;
  }
  for (size_t i = 0; i < count; ++i)
    if (!is_child[i]) roots.push_back(i);
  return roots;
}

} // namespace

DAffine compose_trs(DVec3 translation, const std::vector<double>& rotation, DVec3 scale) {
  glm::dquat q(rotation[3], rotation[0], rotation[1], rotation[2]);
  const double length = glm::length(q);
  q = length > 0.0 && std::isfinite(length) ? q / length : glm::dquat(1.0, 0.0, 0.0, 0.0);
  const glm::dmat3 turn = glm::mat3_cast(q);
  return DAffine(turn[0] * scale.x, turn[1] * scale.y, turn[2] * scale.z, translation);
}

std::vector<PlacedNode> place_nodes(Document& document, double time) {
  Reporter& reporter = document.context().feed.reporter();
  const std::map<uint64_t, AnimatedValues> animated = animate(document, time);
  const size_t count = document.count("nodes");
  std::vector<bool> visited(count, false);
  std::vector<PlacedNode> open, placed;
  std::vector<uint64_t> roots = scene_roots(document);
  for (const uint64_t root : roots | std::views::reverse) open.push_back({root, DAffine(1.0), {}});
  while (!open.empty()) {
    PlacedNode next = open.back();
    open.pop_back();
    const std::string problem = problem_of([&] {
      const Value node = document.element("nodes", next.node);
      if (visited[static_cast<size_t>(next.node)]) node.fail("has several parents");
      visited[static_cast<size_t>(next.node)] = true;
      const auto found = animated.find(next.node);
      const AnimatedValues values = found == animated.end() ? AnimatedValues{} : found->second;
      next.world_from_node = compose(next.world_from_node, local_map(node, values));
      if (const std::optional<Value> weights = node.find("weights")) next.weights = weights->numbers(weights->size());
      if (values.weights) next.weights = *values.weights;
      placed.push_back(next);
      const std::optional<Value> children = node.find("children");
      for (size_t i = children ? children->size() : 0; i-- > 0;)
        open.push_back({(*children)[i].integer(), next.world_from_node, {}});
    });
    if (!problem.empty()) reporter.error(document.place(), problem + "; the node is left out");
  }
  return placed;
}

std::vector<DAffine> instances_of(Document& document, const Value& node) {
  const std::optional<Value> extension = node.extension("EXT_mesh_gpu_instancing");
  if (!extension) return {DAffine(1.0)};
  const ValuesInUse in_use(document);
  const Value attributes = extension->at("attributes");
  constexpr std::array<const char*, 3> kNames = {"TRANSLATION", "ROTATION", "SCALE"};
  std::array<AccessorValues, 3> values;
  uint64_t count = 0;
  for (size_t k = 0; k < kNames.size(); ++k) {
    const std::optional<uint64_t> accessor = attributes.find_integer(kNames[k]);
    if (!accessor) continue;
    values[k] = read_floats(document, *accessor);
    if (values[k].components != (k == 1 ? 4u : 3u))
      attributes.fail("has a " + std::string(kNames[k]) + " of the wrong type");
    if (count > 0 && values[k].count != count) attributes.fail("has attributes of different lengths");
    count = values[k].count;
  }
  document.memory().resize(document.memory().bytes() + count * sizeof(DAffine), "instances of the glTF document");
  std::vector<DAffine> maps;
  maps.reserve(static_cast<size_t>(count));
  for (size_t i = 0; i < count; ++i) {
    const auto vector = [&](size_t k, double fallback) {
      const std::vector<float>& v = values[k].values;
      return v.empty() ? DVec3(fallback) : DVec3(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
    };
    std::vector<double> rotation{0.0, 0.0, 0.0, 1.0};
    for (size_t c = 0; c < 4 && !values[1].values.empty(); ++c) rotation[c] = double{values[1].values[4 * i + c]};
    maps.push_back(compose_trs(vector(0, 0.0), rotation, vector(2, 1.0)));
  }
  return maps;
}

} // namespace packtrace::gltf
