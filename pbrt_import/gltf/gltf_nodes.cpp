#include "pbrt_import/gltf/gltf_nodes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <ranges>
#include <utility>

#include "pbrt_import/gltf/gltf_accessors.h"
#include "pbrt_import/text/problem_text.h"

namespace packtrace::gltf {
namespace {

DVec3 to_dvec3(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

/// The rotation of a quaternion x, y, z, w of any length; none if its length is zero.
glm::dquat unit_rotation(double x, double y, double z, double w) {
  const glm::dquat q(w, x, y, z);
  const double length = glm::length(q);
  return length > 0.0 && std::isfinite(length) ? q / length : glm::dquat(1.0, 0.0, 0.0, 0.0);
}

DAffine local_map(const Value& node, const AnimatedValues& animated) {
  if (const std::optional<Value> matrix = node.find("matrix")) {
    const std::vector<double> m = matrix->numbers(16);
    if (m[3] != 0.0 || m[7] != 0.0 || m[11] != 0.0 || m[15] != 1.0) matrix->fail("is not affine");
    return DAffine(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10], m[12], m[13], m[14]);
  }
  return compose_trs(local_parts(node, animated));
}

/// The roots of the document's scene; without scenes, all nodes without a parent.
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

Trs local_parts(const Value& node, const AnimatedValues& animated) {
  const std::vector<double> r = animated.rotation.value_or(node.numbers_or("rotation", {0.0, 0.0, 0.0, 1.0}));
  return {to_dvec3(animated.translation.value_or(node.numbers_or("translation", {0.0, 0.0, 0.0}))),
          unit_rotation(r[0], r[1], r[2], r[3]),
          to_dvec3(animated.scale.value_or(node.numbers_or("scale", {1.0, 1.0, 1.0})))};
}

DAffine compose_trs(const Trs& parts) {
  const glm::dmat3 turn = glm::mat3_cast(parts.rotation);
  return DAffine(turn[0] * parts.scale.x, turn[1] * parts.scale.y, turn[2] * parts.scale.z, parts.translation);
}

std::vector<PlacedNode> place_nodes(Document& document, const Animation& animation, double time) {
  Reporter& reporter = document.context().feed.reporter();
  const size_t count = document.count("nodes");
  document.memory().resize(document.memory().bytes() + count * sizeof(PlacedNode), "nodes of the glTF document");
  std::vector<bool> visited(count, false);
  std::vector<std::pair<uint64_t, size_t>> open; // with the parent's place
  std::vector<PlacedNode> placed;
  placed.reserve(count);
  const std::vector<uint64_t> roots = scene_roots(document);
  for (const uint64_t root : roots | std::views::reverse) open.emplace_back(root, kNoNode);
  while (!open.empty()) {
    const auto [number, parent] = open.back();
    open.pop_back();
    const std::string problem = problem_of([&] {
      const Value node = document.element("nodes", number);
      if (visited[static_cast<size_t>(number)]) node.fail("has several parents");
      visited[static_cast<size_t>(number)] = true;
      const AnimatedValues values = animation.at(number, time);
      const DAffine local = local_map(node, values);
      PlacedNode next{number, local, {}, parent, kNoNode, local};
      if (parent != kNoNode) {
        next.world_from_node = compose(placed[parent].world_from_node, local);
        next.mover = placed[parent].mover;
        next.mover_from_node = compose(placed[parent].mover_from_node, local);
      }
      if (animation.moves(number) && !node.has("matrix"))
        next.mover = placed.size(), next.mover_from_node = DAffine(1.0);
      if (const std::optional<Value> weights = node.find("weights")) next.weights = weights->numbers(weights->size());
      if (values.weights) next.weights = *values.weights;
      placed.push_back(std::move(next));
      const std::optional<Value> children = node.find("children");
      for (size_t i = children ? children->size() : 0; i-- > 0;)
        open.emplace_back((*children)[i].integer(), placed.size() - 1);
    });
    if (!problem.empty()) reporter.error(document.place(), problem + "; the node is left out");
  }
  return placed;
}

std::vector<PlacedNode> nodes_at(Document& document, const Animation& animation, std::span<const PlacedNode> nodes,
                                 double time) {
  std::vector<PlacedNode> moved(nodes.begin(), nodes.end());
  for (PlacedNode& placed : moved) {
    if (placed.mover == kNoNode && !animation.morphs(placed.node)) continue;
    AnimatedValues values = animation.at(placed.node, time);
    const DAffine local = local_map(document.element("nodes", placed.node), values);
    placed.world_from_node = placed.parent == kNoNode ? local : compose(moved[placed.parent].world_from_node, local);
    if (values.weights) placed.weights = std::move(*values.weights);
  }
  return moved;
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
    Trs parts{vector(0, 0.0), {1.0, 0.0, 0.0, 0.0}, vector(2, 1.0)};
    if (const std::vector<float>& q = values[1].values; !q.empty())
      parts.rotation =
          unit_rotation(double{q[4 * i]}, double{q[4 * i + 1]}, double{q[4 * i + 2]}, double{q[4 * i + 3]});
    maps.push_back(compose_trs(parts));
  }
  return maps;
}

} // namespace packtrace::gltf
