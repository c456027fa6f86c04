#include "pbrt_import/gltf/gltf_primitive.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

#include "pbrt_import/gltf/gltf_accessors.h"
#include "pbrt_import/gltf/gltf_draco.h"
#include "pbrt_import/gltf/gltf_frames.h"

namespace packtrace::gltf {
namespace {

enum class Mode : uint64_t { kTriangles = 4, kStrip = 5, kFan = 6 };

/// A primitive's triangles and attributes.
struct PrimitiveMesh {
  std::vector<float> positions, normals, uvs; ///< 3, 3 and 2 per vertex; the last two may be empty
  std::vector<uint32_t> indices;              ///< as its mode arranges them
  std::vector<JointSet> joints;               ///< only with a skin
  uint64_t vertices = 0;
};

std::vector<float> read_attribute(Document& document, const Value& attributes, const char* name, uint32_t components,
                                  uint64_t& vertices) {
  const std::optional<uint64_t> accessor = attributes.find_integer(name);
  if (!accessor) return {};
  AccessorValues values = read_floats(document, *accessor);
  if (values.components != components) attributes.fail("has a " + std::string(name) + " of the wrong type");
  if (vertices != 0 && values.count != vertices) attributes.fail("has attributes of different lengths");
  vertices = values.count;
  return std::move(values.values);
}

std::string numbered(const char* name, size_t number) { return name + std::to_string(number); }

PrimitiveMesh read_plain(Document& document, const Value& primitive, const std::string& uv_name, bool skinned) {
  PrimitiveMesh mesh;
  const Value attributes = primitive.at("attributes");
  mesh.positions = read_attribute(document, attributes, "POSITION", 3, mesh.vertices);
  mesh.normals = read_attribute(document, attributes, "NORMAL", 3, mesh.vertices);
  mesh.uvs = read_attribute(document, attributes, uv_name.c_str(), 2, mesh.vertices);
  constexpr size_t kMaxJointSets = 16;
  for (size_t set = 0; skinned && attributes.has(numbered("JOINTS_", set).c_str()); ++set) {
    if (set == kMaxJointSets) attributes.fail("has more than 16 sets of joints");
    mesh.joints.push_back({read_attribute(document, attributes, numbered("JOINTS_", set).c_str(), 4, mesh.vertices),
                           read_attribute(document, attributes, numbered("WEIGHTS_", set).c_str(), 4, mesh.vertices)});
  }
  if (const std::optional<uint64_t> indices = primitive.find_integer("indices")) {
    mesh.indices = read_indices(document, *indices);
  } else {
    mesh.indices.resize(static_cast<size_t>(mesh.vertices));
    std::iota(mesh.indices.begin(), mesh.indices.end(), 0u);
  }
  return mesh;
}

PrimitiveMesh read_draco(Document& document, const Value& primitive, const Value& extension, const std::string& uv_name,
                         bool skinned) {
  const std::span<const std::byte> bytes = document.view_bytes(extension.at("bufferView").integer());
  DracoWants wants{{"POSITION", 3}, {"NORMAL", 3}, {uv_name, 2}};
  if (skinned) wants["JOINTS_0"] = wants["WEIGHTS_0"] = 4;
  MemoryReservation memory(document.context().options.memory);
  DracoPrimitive decoded = decode_draco(bytes, wants, extension, memory);
  document.values_memory().merge(std::move(memory));
  PrimitiveMesh mesh;
  mesh.vertices = decoded.vertices;
  mesh.indices = std::move(decoded.indices);
  mesh.positions = std::move(decoded.attributes["POSITION"]);
  mesh.normals = std::move(decoded.attributes["NORMAL"]);
  mesh.uvs = std::move(decoded.attributes[uv_name]);
  if (skinned && decoded.attributes.contains("JOINTS_0"))
    mesh.joints.push_back({std::move(decoded.attributes["JOINTS_0"]), std::move(decoded.attributes["WEIGHTS_0"])});
  if (primitive.find_integer("mode").value_or(4) == static_cast<uint64_t>(Mode::kFan))
    primitive.fail("has a mode that Draco does not know");
  return mesh;
}

/// Weights of a primitive's morph targets, one per target or none at all.
/// @param pose_weights empty: those of its mesh
std::vector<double> morph_weights(const Value& mesh_value, const Value& primitive,
                                  std::span<const double> pose_weights) {
  const std::optional<Value> targets = primitive.find("targets"), own = mesh_value.find("weights");
  if (!targets) return {};
  std::vector<double> weights(pose_weights.begin(), pose_weights.end());
  if (weights.empty() && own) weights = own->numbers(own->size());
  if (!weights.empty() && weights.size() != targets->size())
    primitive.fail("has " + std::to_string(targets->size()) + " morph targets, but " + std::to_string(weights.size()) +
                   " weights");
  return weights;
}

std::vector<float> read_target(Document& document, const Value& primitive, size_t number, const char* attribute,
                               const PrimitiveMesh& mesh) {
  uint64_t vertices = mesh.vertices;
  return read_attribute(document, primitive.at("targets")[number], attribute, 3, vertices);
}

void morph(Document& document, const Value& primitive, std::span<const double> weights, PrimitiveMesh& mesh) {
  for (size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] == 0.0) continue;
    add_target(read_target(document, primitive, i, "POSITION", mesh), weights[i], mesh.positions);
    add_target(read_target(document, primitive, i, "NORMAL", mesh), weights[i], mesh.normals);
  }
}

/// Collects what the frames of a primitive are evaluated from.
/// @param mesh not deformed yet
PosedFrames::Source frame_source(Document& document, const Value& mesh_value, const Value& primitive,
                                 const PoseFrames& poses, const PrimitiveMesh& mesh) {
  PosedFrames::Source source;
  source.positions = mesh.positions, source.joints = mesh.joints;
  source.mesh_weights = morph_weights(mesh_value, primitive, {});
  const std::optional<Value> targets = primitive.find("targets");
  source.targets.resize(targets ? targets->size() : 0);
  for (const std::vector<double>& of_frame : poses.weights) {
    const std::vector<double> weights = morph_weights(mesh_value, primitive, of_frame);
    for (size_t i = 0; i < weights.size(); ++i)
      if (weights[i] != 0.0 && source.targets[i].empty())
        source.targets[i] = read_target(document, primitive, i, "POSITION", mesh);
  }
  return source;
}

/// Marks the vertices that the importer keeps: those of triangles with three different, finite corners.
std::vector<uint8_t> used_vertices(const PrimitiveMesh& mesh, const std::vector<uint32_t>& indices) {
  std::vector<uint8_t> used(static_cast<size_t>(mesh.vertices), 0);
  const auto finite = [&](uint32_t v) {
    const float* const p = mesh.positions.data() + 3 * size_t{v};
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
  };
  for (size_t i = 0; i + 2 < indices.size(); i += 3) {
    const uint32_t a = indices[i], b = indices[i + 1], c = indices[i + 2];
    if (a == b || b == c || c == a || !finite(a) || !finite(b) || !finite(c)) continue;
    for (const uint32_t v : {a, b, c}) used[v] = 1;
  }
  return used;
}

/// Frames of a primitive; null if all are the same.
std::shared_ptr<const MeshFrames> frames_of(Document& document, const Value& primitive, const Pose& pose,
                                            PosedFrames::Source source) {
  auto frames = std::make_shared<const PosedFrames>(primitive.path(), pose.frames, std::move(source),
                                                    document.context().options.memory);
  const std::vector<Vec3> first = frames->positions(0);
  for (uint32_t frame = 1; frame < frames->count(); ++frame) {
    document.context().progress.check_cancelled();
    if (frames->positions(frame) != first) return frames;
  }
  return nullptr;
}

/// Corners of the triangles, three by three. Takes the mesh's indices.
std::vector<uint32_t> triangles_of(PrimitiveMesh& mesh, Mode mode, const Value& primitive) {
  std::vector<uint32_t> in = std::move(mesh.indices);
  uint32_t largest = 0;
  for (const uint32_t index : in) largest = std::max(largest, index);
  if (!in.empty() && largest >= mesh.vertices) primitive.fail("has an index out of range");
  if (mode == Mode::kTriangles) {
    if (in.size() % 3 != 0) primitive.fail("has " + std::to_string(in.size()) + " corners, which are not triangles");
    return in;
  }
  std::vector<uint32_t> out;
  const auto add = [&](uint32_t a, uint32_t b, uint32_t c) { out.insert(out.end(), {a, b, c}); };
  out.reserve(in.size() * 3);
  for (size_t i = 0; i + 2 < in.size(); ++i) {
    if (mode == Mode::kFan)
      add(in[i + 1], in[i + 2], in[0]);
    else if (i % 2 == 0)
      add(in[i], in[i + 1], in[i + 2]);
    else
      add(in[i], in[i + 2], in[i + 1]);
  }
  // Equal neighbours connect strips; their triangles have no area.
  std::vector<uint32_t> kept;
  kept.reserve(out.size());
  for (size_t i = 0; i < out.size(); i += 3)
    if (out[i] != out[i + 1] && out[i + 1] != out[i + 2] && out[i] != out[i + 2])
      kept.insert(kept.end(), out.begin() + static_cast<std::ptrdiff_t>(i),
                  out.begin() + static_cast<std::ptrdiff_t>(i + 3));
  return kept;
}

/// Turns texture coordinates to pbrt's, whose v points upwards, with a rotating transform applied.
void convert_uvs(std::vector<float>& uvs, const MaterialUse& use) {
  const double c = std::cos(use.uv_rotation), s = std::sin(use.uv_rotation);
  for (size_t i = 0; i + 1 < uvs.size(); i += 2) {
    double u = double{uvs[i]}, v = double{uvs[i + 1]};
    if (use.uv_rotation != 0.0) {
      const double x = u * double{use.uv_scale.x}, y = v * double{use.uv_scale.y};
      u = c * x + s * y + double{use.uv_offset.x};
      v = -s * x + c * y + double{use.uv_offset.y};
    }
    uvs[i] = static_cast<float>(u), uvs[i + 1] = static_cast<float>(1.0 - v);
  }
}

/// The lattice of the positions: the one that the mesh or the document states, as exports do, or that of integers.
std::optional<std::vector<int32_t>> lattice_of(Document& document, const Value& mesh, const Value& primitive,
                                               bool skinned) {
  if (skinned || primitive.find("targets")) return std::nullopt; // the positions leave it
  if (std::optional<std::vector<int32_t>> stated = stated_lattice(document, mesh)) return stated;
  const std::optional<uint64_t> positions = primitive.at("attributes").find_integer("POSITION");
  if (!positions) return std::nullopt;
  const Value accessor = document.element("accessors", *positions);
  constexpr uint64_t kFloat = 5126;
  const std::optional<Value> normalized = accessor.find("normalized");
  if (accessor.at("componentType").integer() == kFloat || (normalized && normalized->flag())) return std::nullopt;
  return std::vector<int32_t>{8, -3}; // steps of 1
}

} // namespace

std::optional<std::vector<int32_t>> stated_lattice(Document& document, const Value& mesh) {
  constexpr const char* kLattice = "packtrace_lattice";
  for (const Value& owner : {mesh, document.root().at("asset")}) {
    const std::optional<Value> extras = owner.find("extras");
    if (!extras || !extras->has(kLattice)) continue;
    const std::vector<double> values = extras->at(kLattice).numbers(2);
    constexpr double kLimit = 1e9; // beyond it the importer reports them
    std::vector<int32_t> lattice;
    for (const double value : values) lattice.push_back(static_cast<int32_t>(std::clamp(value, -kLimit, kLimit)));
    return lattice;
  }
  return std::nullopt;
}

void add_gltf_primitive(Document& document, const Materials& materials, const Value& mesh_value, const Value& primitive,
                        const Pose& pose) {
  const ValuesInUse values(document);
  DirectiveFeed& feed = document.context().feed;
  const uint64_t mode = primitive.find_integer("mode").value_or(4);
  if (mode < 4) return feed.reporter().warning(document.place(), "points and lines have no surface; they are left out");
  if (mode > 6) primitive.fail("has an unknown mode");
  const MaterialUse& use = materials.use(primitive.find_integer("material"));
  const std::string uv_name = "TEXCOORD_" + std::to_string(use.uv_set);
  const std::optional<Value> draco = primitive.extension("KHR_draco_mesh_compression");
  PrimitiveMesh mesh = draco ? read_draco(document, primitive, *draco, uv_name, pose.skinned())
                             : read_plain(document, primitive, uv_name, pose.skinned());
  if (mesh.positions.empty()) primitive.fail("has no positions");
  if (primitive.at("attributes").has("COLOR_0"))
    feed.reporter().warning(document.place(), "colours of vertices are left out");
  if (pose.skinned()) check_joints(mesh.joints, mesh.vertices, pose.joints->size(), primitive);
  PosedFrames::Source source;
  if (pose.frames) source = frame_source(document, mesh_value, primitive, *pose.frames, mesh);
  morph(document, primitive, morph_weights(mesh_value, primitive, pose.weights), mesh);
  if (pose.skinned()) move_with_joints(*pose.joints, mesh.joints, mesh.positions, mesh.normals);
  // Draco's decoder turns strips into triangles.
  const std::vector<uint32_t> indices = triangles_of(mesh, draco ? Mode::kTriangles : Mode{mode}, primitive);
  if (indices.empty()) return;
  convert_uvs(mesh.uvs, use);
  std::shared_ptr<const MeshFrames> frames;
  if (pose.frames) {
    source.used = used_vertices(mesh, indices);
    frames = frames_of(document, primitive, pose, std::move(source));
  }

  const Place place = document.place();
  feed.with_attributes(place, [&] {
    if (use.name.empty())
      feed.begin("Material", place, {"matte"});
    else
      feed.begin("NamedMaterial", place, {use.name});
    feed.send();
    if (use.emission != Vec3(0.0f)) {
      feed.begin("AreaLightSource", place, {"diffuse"});
      feed.colour("L", use.emission);
      feed.send();
    }
    feed.begin("Shape", place, {"trianglemesh"});
    feed.floats(ParameterType::kPoint3, "P", mesh.positions);
    if (!mesh.normals.empty()) feed.floats(ParameterType::kNormal, "N", mesh.normals);
    if (!mesh.uvs.empty()) feed.floats(ParameterType::kFloat, "uv", mesh.uvs);
    feed.integers("indices", {reinterpret_cast<const int32_t*>(indices.data()), indices.size()}); // below 2^31
    if (const std::optional<std::vector<int32_t>> lattice = lattice_of(document, mesh_value, primitive, pose.skinned()))
      feed.integers("lattice", *lattice);
    if (frames) feed.deforms({0, frames, pose.frames->frames_per_second, 0});
    if (use.absent)
      feed.number("alpha", 0.0f);
    else if (!use.opacity.empty())
      feed.texture("alpha", use.opacity);
    feed.send();
  });
}

} // namespace packtrace::gltf
