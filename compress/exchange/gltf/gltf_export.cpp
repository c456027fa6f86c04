#include "compress/exchange/gltf/gltf_export.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <tbb/parallel_for.h>
#include <tiny_gltf.h>

#include "compress/exchange/gltf/gltf_instances.h"
#include "compress/exchange/gltf/gltf_materials.h"
#include "compress/exchange/gltf/plain_primitives.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/printable.h"

namespace packtrace {
namespace {

constexpr int kMaxDracoBits = 30;
constexpr double kNear = 1e-4, kFar = 10.0; // near and far planes relative to the scene's diagonal; pbrt has none
constexpr const char *kDracoExtension = "KHR_draco_mesh_compression", *kInstancing = "EXT_mesh_gpu_instancing";

struct LatticeBox {
  LatticePoint lo{}, hi{};
  bool empty = true;
  void extend(const LatticePoint& p) {
    for (size_t axis = 0; axis < 3; ++axis) {
      lo[axis] = empty ? p[axis] : std::min(lo[axis], p[axis]);
      hi[axis] = empty ? p[axis] : std::max(hi[axis], p[axis]);
    }
    empty = false;
  }
  /// Bits per axis for codes that count from lo, at least 1.
  int bits() const {
    uint64_t extent = 1;
    for (size_t axis = 0; axis < 3; ++axis) extent = std::max(extent, static_cast<uint64_t>(hi[axis] - lo[axis]));
    return static_cast<int>(std::bit_width(extent));
  }
};

/// A primitive, encoded but not yet added to the model.
struct EncodedPrimitive {
  PlainPrimitive plain;
  std::optional<DracoPrimitive> draco;
};

double step_of(const baked::GeometryRecord& geometry) {
  return PositionGrid{geometry.step_mantissa, geometry.step_exponent}.step();
}

/// Draco grids of all geometries. World-space geometries with equal steps lie on one lattice and share a grid, so that
/// touching surfaces decode to equal positions.
class Grids {
public:
  void add(const baked::GeometryRecord& geometry, uint32_t number, const LatticeBox& box) {
    LatticeBox& whole = boxes_[key(geometry, number)];
    if (box.empty) return;
    whole.extend(box.lo);
    whole.extend(box.hi);
  }
  DracoGrid grid(const baked::GeometryRecord& geometry, uint32_t number) const {
    const LatticeBox& box = boxes_.at(key(geometry, number));
    return {box.lo, step_of(geometry), box.bits()};
  }

private:
  using Key = std::pair<double, uint32_t>;
  static Key key(const baked::GeometryRecord& geometry, uint32_t number) {
    return {step_of(geometry), (geometry.flags & baked::kWorldSpace) != 0 ? baked::kNone : number};
  }
  std::map<Key, LatticeBox> boxes_;
};

class Document {
public:
  Document(const BakedFile& file, GltfReport& report) : file_(file), report_(report), materials_(file, model_) {
    model_.asset.version = "2.0";
    model_.asset.generator = "packtrace";
    model_.buffers.emplace_back();
    model_.scenes.emplace_back();
    model_.defaultScene = 0;
    tinygltf::Node root;
    root.name = "world";
    root.scale = {-1.0, 1.0, 1.0};
    if (const DVec3 origin = file.origin(); origin != DVec3(0.0)) root.translation = {-origin.x, origin.y, origin.z};
    model_.nodes.push_back(std::move(root));
    model_.scenes.front().nodes = {0};
    materials_.add_all();
  }

  void add_geometry(uint32_t geometry, std::vector<EncodedPrimitive>&& primitives) {
    if (templates_.size() <= geometry) templates_.resize(geometry + 1);
    for (EncodedPrimitive& primitive : primitives) {
      templates_[geometry].push_back({primitive.plain.material_slot, add_primitive(primitive)});
      primitive = {};
    }
  }

  /// @param instancing see GltfConfig
  void add_nodes(bool instancing) {
    std::map<int, std::vector<InstanceTransform>> groups; // by mesh
    for (const baked::InstanceRecord& instance : file_.instances()) {
      if (templates_[instance.geometry].empty()) continue;
      tinygltf::Node node;
      node.mesh = mesh_of(instance);
      const std::array<float, 12>& m = instance.world_from_object;
      if (instancing) {
        const Affine map(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9], m[10], m[11]);
        if (const std::optional<InstanceTransform> transform = decompose(map)) {
          groups[node.mesh].push_back(*transform);
          continue;
        }
      }
      if (m != std::array<float, 12>{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0})
        node.matrix = {m[0], m[1], m[2], 0, m[3], m[4], m[5], 0, m[6], m[7], m[8], 0, m[9], m[10], m[11], 1};
      add_node(std::move(node));
    }
    for (const auto& [mesh, transforms] : groups) add_group(mesh, transforms);
    for (const Camera& camera : file_.cameras()) add_camera(camera);
  }

  std::vector<std::byte> write() {
    const auto require = [&](const char* extension) {
      model_.extensionsUsed.emplace_back(extension);
      return &model_;
    };
    if (has_draco_) require(kDracoExtension)->extensionsRequired.emplace_back(kDracoExtension);
    if (report_.grouped_instances > 0) require(kInstancing)->extensionsRequired.emplace_back(kInstancing);
    if (!model_.textures.empty()) require("KHR_texture_transform");
    const auto transmits = [](const tinygltf::Material& m) {
      return m.extensions.count("KHR_materials_transmission") > 0;
    };
    if (std::any_of(model_.materials.begin(), model_.materials.end(), transmits)) require("KHR_materials_transmission");
    report_.meshes = model_.meshes.size(), report_.nodes = model_.nodes.size();
    report_.materials = model_.materials.size(), report_.images = model_.images.size();
    report_.cameras = model_.cameras.size();
    report_.image_bytes = materials_.image_bytes(), report_.simplified_materials = materials_.simplified();
    if (model_.buffers.front().data.empty()) model_.buffers.clear();
    std::ostringstream out(std::ios::binary);
    if (!tinygltf::TinyGLTF().WriteGltfSceneToStream(&model_, out, false, true))
      throw std::runtime_error("the glTF writer failed");
    const std::string text = std::move(out).str();
    std::vector<std::byte> bytes(text.size());
    std::memcpy(bytes.data(), text.data(), text.size());
    report_.file_bytes = bytes.size();
    return bytes;
  }

private:
  struct Template {
    uint32_t material_slot;
    tinygltf::Primitive primitive; ///< without a material
  };

  tinygltf::Primitive add_primitive(const EncodedPrimitive& from) {
    const PlainPrimitive& plain = from.plain;
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    const bool draco = from.draco.has_value();
    const size_t vertices = draco ? from.draco->points : plain.positions.size();
    const size_t triangles = draco ? from.draco->faces : plain.triangles.size();
    const auto attribute = [&](const char* name, const auto& values) {
      if (!values.empty()) primitive.attributes[name] = add_accessor(values, vertices, draco);
    };
    attribute("POSITION", plain.positions);
    attribute("NORMAL", plain.normals);
    attribute("TEXCOORD_0", plain.uvs);
    set_bounds(model_.accessors[static_cast<size_t>(primitive.attributes["POSITION"])], plain.positions);
    primitive.indices = add_indices(plain.triangles, triangles, draco);
    if (draco) {
      has_draco_ = true;
      tinygltf::Value::Object ids{{"POSITION", tinygltf::Value(from.draco->position_id)}};
      if (from.draco->normal_id >= 0) ids["NORMAL"] = tinygltf::Value(from.draco->normal_id);
      if (from.draco->uv_id >= 0) ids["TEXCOORD_0"] = tinygltf::Value(from.draco->uv_id);
      const int view = append_buffer_view(model_, from.draco->bytes.data(), from.draco->bytes.size());
      report_.geometry_bytes += from.draco->bytes.size();
      primitive.extensions[kDracoExtension] = tinygltf::Value(tinygltf::Value::Object{
          {"bufferView", tinygltf::Value(view)}, {"attributes", tinygltf::Value(std::move(ids))}});
    }
    ++report_.primitives;
    report_.vertices += vertices, report_.triangles += triangles;
    report_.collapsed_triangles += plain.triangles.size() - triangles;
    return primitive;
  }

  template <typename Vector>
  int add_accessor(const std::vector<Vector>& values, size_t count, bool draco) {
    tinygltf::Accessor accessor;
    accessor.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
    accessor.type = Vector::length() == 3 ? TINYGLTF_TYPE_VEC3 : TINYGLTF_TYPE_VEC2;
    return add_accessor(std::move(accessor), values, count, draco, TINYGLTF_TARGET_ARRAY_BUFFER);
  }

  int add_indices(const std::vector<Triangle>& triangles, size_t count, bool draco) {
    tinygltf::Accessor accessor;
    accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    accessor.type = TINYGLTF_TYPE_SCALAR;
    return add_accessor(std::move(accessor), triangles, 3 * count, draco, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  }

  /// Adds an accessor. With Draco it has no buffer view.
  template <typename Value>
  int add_accessor(tinygltf::Accessor accessor, const std::vector<Value>& values, size_t count, bool draco,
                   int target) {
    accessor.count = count;
    if (!draco) {
      const size_t bytes = values.size() * sizeof(Value);
      accessor.bufferView = append_buffer_view(model_, values.data(), bytes);
      model_.bufferViews.back().target = target;
      if (target != 0) report_.geometry_bytes += bytes;
    }
    model_.accessors.push_back(std::move(accessor));
    return static_cast<int>(model_.accessors.size() - 1);
  }

  static void set_bounds(tinygltf::Accessor& accessor, const std::vector<Vec3>& positions) {
    Vec3 lo = positions.front(), hi = lo;
    for (const Vec3& p : positions) lo = glm::min(lo, p), hi = glm::max(hi, p);
    accessor.minValues = {lo.x, lo.y, lo.z};
    accessor.maxValues = {hi.x, hi.y, hi.z};
  }

  /// Returns the mesh for the instance's geometry and material list; meshes of one geometry share its buffers.
  int mesh_of(const baked::InstanceRecord& instance) {
    const auto [place, added] =
        meshes_.try_emplace({instance.geometry, instance.first_slot}, static_cast<int>(model_.meshes.size()));
    if (!added) return place->second;
    tinygltf::Mesh mesh;
    mesh.name = to_utf8(file_.text(file_.geometries()[instance.geometry].name));
    for (const Template& part : templates_[instance.geometry]) {
      mesh.primitives.push_back(part.primitive);
      mesh.primitives.back().material =
          static_cast<int>(file_.sections().material_slots[instance.first_slot + part.material_slot]);
    }
    model_.meshes.push_back(std::move(mesh));
    return place->second;
  }

  /// Adds a node for all instances of a mesh; a single one needs no extension.
  void add_group(int mesh, const std::vector<InstanceTransform>& transforms) {
    tinygltf::Node node;
    node.mesh = mesh;
    const InstanceTransform identity;
    tinygltf::Value::Object attributes;
    const auto add = [&](const char* name, int type, const auto member, std::vector<double>* single) {
      const auto& first = transforms.front().*member;
      std::vector<std::decay_t<decltype(first)>> values;
      for (const InstanceTransform& transform : transforms) values.push_back(transform.*member);
      if (std::ranges::all_of(values, [&](const auto& value) { return value == identity.*member; })) return;
      if (transforms.size() == 1) {
        single->assign(first.begin(), first.end());
        return;
      }
      tinygltf::Accessor accessor;
      accessor.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
      accessor.type = type;
      attributes[name] = tinygltf::Value(add_accessor(std::move(accessor), values, values.size(), false, 0));
    };
    add("TRANSLATION", TINYGLTF_TYPE_VEC3, &InstanceTransform::translation, &node.translation);
    add("ROTATION", TINYGLTF_TYPE_VEC4, &InstanceTransform::rotation, &node.rotation);
    add("SCALE", TINYGLTF_TYPE_VEC3, &InstanceTransform::scale, &node.scale);
    if (transforms.size() > 1) {
      if (attributes.empty()) { // instances at one place: the extension needs an attribute that has their number
        for (size_t i = 0; i < transforms.size(); ++i) add_node(tinygltf::Node(node));
        return;
      }
      node.extensions[kInstancing] =
          tinygltf::Value(tinygltf::Value::Object{{"attributes", tinygltf::Value(std::move(attributes))}});
      report_.grouped_instances += transforms.size();
    }
    add_node(std::move(node));
  }

  void add_node(tinygltf::Node&& node) {
    model_.nodes.front().children.push_back(static_cast<int>(model_.nodes.size()));
    model_.nodes.push_back(std::move(node));
  }

  void add_camera(const Camera& camera) {
    if (camera.projection == Projection::kEnvironment || camera.width_px == 0 || camera.height_px == 0) {
      ++report_.skipped_cameras;
      return;
    }
    tinygltf::Camera out;
    out.name = to_utf8(camera.film_name);
    const double aspect = double(camera.width_px) / double(camera.height_px);
    // Half size of the screen. An off-centre window becomes centred.
    glm::dvec2 half(std::max(aspect, 1.0), std::max(1.0 / aspect, 1.0));
    if (camera.screen_window)
      half = glm::abs(glm::dvec2(camera.screen_window->y - camera.screen_window->x,
                                 camera.screen_window->w - camera.screen_window->z)) *
             0.5;
    if (camera.projection == Projection::kPerspective) {
      const double tangent = std::tan(camera.fov_degrees * std::numbers::pi / 360.0);
      out.type = "perspective";
      out.perspective.yfov = 2.0 * std::atan(half.y * tangent);
      out.perspective.aspectRatio = half.x / half.y;
      out.perspective.znear = kNear * scene_size();
      out.perspective.zfar = kFar * scene_size();
    } else {
      out.type = "orthographic";
      out.orthographic.xmag = half.x, out.orthographic.ymag = half.y;
      out.orthographic.zfar = kFar * scene_size();
    }
    model_.cameras.push_back(std::move(out));
    tinygltf::Node node;
    node.camera = static_cast<int>(model_.cameras.size() - 1);
    const DAffine& m = camera.world_from_camera; // glTF's cameras look along -z
    node.matrix = {m[0].x,  m[0].y,  m[0].z,  0, m[1].x, m[1].y, m[1].z, 0,
                   -m[2].x, -m[2].y, -m[2].z, 0, m[3].x, m[3].y, m[3].z, 1};
    add_node(std::move(node));
  }

  /// Diagonal of the scene in world units, or 1 if it is 0.
  double scene_size() const {
    const double diagonal = file_.world_bounds().diagonal();
    return diagonal > 0.0 ? diagonal : 1.0;
  }

  const BakedFile& file_;
  GltfReport& report_;
  tinygltf::Model model_;
  GltfMaterials materials_;
  std::vector<std::vector<Template>> templates_; ///< by geometry
  std::map<std::pair<uint32_t, uint32_t>, int> meshes_;
  bool has_draco_ = false;
};

void validate(const GltfConfig& config) {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw Error(ErrorKind::kUsage, message);
  };
  require(config.codec.level >= 0 && config.codec.level <= 10, "Draco's level must be 0 to 10");
  require(config.codec.normal_bits >= 2 && config.codec.normal_bits <= 30, "normals take 2 to 30 bits");
  require(config.codec.uv_bits >= 1 && config.codec.uv_bits <= 30, "texture coordinates take 1 to 30 bits");
}

} // namespace

GltfExport export_gltf(const BakedFile& file, const GltfConfig& config, Progress& progress) {
  validate(config);
  const auto geometries = file.base_geometry_count(); // LOD levels are not exported
  std::vector<std::vector<EncodedPrimitive>> encoded(geometries);
  std::vector<LatticeBox> boxes(geometries);
  progress.begin("decoding", geometries);
  tbb::parallel_for(uint32_t{0}, geometries, [&](uint32_t g) {
    progress.check_cancelled();
    for (PlainPrimitive& plain : plain_primitives(file, g)) {
      for (const LatticePoint& p : plain.lattice) boxes[g].extend(p);
      encoded[g].push_back({std::move(plain), std::nullopt});
    }
    progress.advance();
  });
  Grids grids;
  for (uint32_t g = 0; g < geometries; ++g) grids.add(file.geometries()[g], g, boxes[g]);

  GltfExport result;
  if (config.draco) {
    progress.begin("compressing", geometries);
    tbb::parallel_for(uint32_t{0}, geometries, [&](uint32_t g) {
      const DracoGrid grid = grids.grid(file.geometries()[g], g);
      for (EncodedPrimitive& primitive : encoded[g]) {
        progress.check_cancelled();
        if (grid.bits <= kMaxDracoBits) primitive.draco = encode_draco(primitive.plain, grid, config.codec);
      }
      progress.advance();
    });
  }
  progress.begin("assembling the file", 0);
  Document document(file, result.report);
  for (uint32_t g = 0; g < geometries; ++g) {
    if (config.draco)
      for (const EncodedPrimitive& primitive : encoded[g]) result.report.plain_primitives += !primitive.draco;
    document.add_geometry(g, std::move(encoded[g]));
  }
  document.add_nodes(config.instancing);
  result.bytes = document.write();
  return result;
}

} // namespace packtrace
