#pragma once

#include <gtest/gtest.h>

#include "tests/pbrt_import/gltf_builder.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {

inline const std::vector<float> kSquare = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};

/// Imports a document as .gltf; as .glb it must have the same shapes.
inline Imported import_gltf(const SceneFolder& folder, const GltfBuilder& gltf, const ImportOptions& options = {}) {
  Imported text = import_file(folder.write("a.gltf", gltf.text()), options);
  const Imported binary = import_file(folder.write("a.glb", gltf.binary()), options);
  EXPECT_EQ(text.scene.shapes.size(), binary.scene.shapes.size());
  EXPECT_EQ(placed_triangle_count(text.scene), placed_triangle_count(binary.scene));
  return text;
}

/// A document with one mesh in one node.
inline GltfBuilder with_primitive(const nlohmann::json& primitive, GltfBuilder gltf,
                                  const nlohmann::json& node = nlohmann::json::object()) {
  const size_t mesh = gltf.mesh(primitive);
  nlohmann::json whole = node;
  whole["mesh"] = mesh;
  gltf.node(whole);
  return gltf;
}

/// A triangle with the corners (0, 0, 0), (1, 0, 0) and (0, 1, 0) in node 0.
inline GltfBuilder gltf_triangle(const nlohmann::json& node = nlohmann::json::object()) {
  GltfBuilder gltf;
  const nlohmann::json primitive = {{"attributes", {{"POSITION", gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0})}}}};
  return with_primitive(primitive, gltf, node);
}

/// A channel of an animation.
struct GltfChannel {
  size_t node = 0;
  std::string path, interpolation;
  std::vector<float> times, values;
};

/// Appends an animation.
inline void add_animation(GltfBuilder& gltf, const std::vector<GltfChannel>& channels, const std::string& name = "") {
  nlohmann::json animation;
  for (const GltfChannel& channel : channels) {
    const char* const type = channel.path == "rotation" ? "VEC4" : channel.path == "weights" ? "SCALAR" : "VEC3";
    const size_t input = gltf.accessor<float>("SCALAR", 5126, channel.times);
    const size_t output = gltf.accessor<float>(type, 5126, channel.values);
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size()}, {"target", {{"node", channel.node}, {"path", channel.path}}}});
    animation["samplers"].push_back({{"input", input}, {"output", output}, {"interpolation", channel.interpolation}});
  }
  if (!name.empty()) animation["name"] = name;
  gltf.json["animations"].push_back(animation);
}

/// A triangle whose first corner hangs on joint 0, the second on joint 1, the third half on each. Joint 1 moves by
/// (0, 8, 0) from 0 to 2 s.
inline GltfBuilder gltf_skin() {
  GltfBuilder gltf;
  const size_t positions = gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const size_t normals = gltf.positions({0, 0, 1, 0, 0, 1, 0, 0, 1});
  const size_t joints = gltf.accessor<uint8_t>("VEC4", 5121, {0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0});
  const size_t weights = gltf.accessor<float>("VEC4", 5126, {1, 0, 0, 0, 1, 0, 0, 0, .5f, .5f, 0, 0});
  gltf.mesh(
      {{"attributes", {{"POSITION", positions}, {"NORMAL", normals}, {"JOINTS_0", joints}, {"WEIGHTS_0", weights}}}});
  gltf.node({{"mesh", 0}, {"skin", 0}, {"translation", {100, 0, 0}}}); // does not matter
  gltf.node({{"name", "still"}});
  gltf.node({{"name", "moving"}, {"translation", {0, 0, 5}}});
  // The second joint was at (0, 0, 5) when the mesh was bound.
  const std::vector<float> inverse = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0,  1,
                                      1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -5, 1};
  const size_t bind =
      gltf.accessor({{"bufferView", gltf.view(inverse)}, {"componentType", 5126}, {"type", "MAT4"}, {"count", 2}});
  gltf.json["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", bind}}};
  add_animation(gltf, {{2, "translation", "LINEAR", {0, 2}, {0, 0, 5, 0, 8, 5}}});
  return gltf;
}

} // namespace packtrace
