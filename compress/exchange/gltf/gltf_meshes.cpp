#include "compress/exchange/gltf/gltf_meshes.h"

#include <algorithm>
#include <bit>

#include <tbb/parallel_for.h>

#include "pbrt_import/base/printable.h"

namespace packtrace {
namespace {

/// The lattice of a mesh's stored positions, for readers that keep it: steps of 1 if they are integers, otherwise the
/// geometry's, in object units.
GltfJson lattice_extras(const baked::GeometryRecord& geometry, bool integers) {
  if (integers) return gltf_integer_lattice();
  return {{"packtrace_lattice", {geometry.step_mantissa, geometry.step_exponent}}};
}

std::pair<std::vector<float>, std::vector<float>> bounds_of(const std::vector<Vec3>& positions) {
  Vec3 lo = positions.front(), hi = lo;
  for (const Vec3& p : positions) lo = glm::min(lo, p), hi = glm::max(hi, p);
  return {{lo.x, lo.y, lo.z}, {hi.x, hi.y, hi.z}};
}

template <class T>
std::span<const float> floats_of(const std::vector<T>& values) {
  return {reinterpret_cast<const float*>(values.data()), values.size() * sizeof(T) / sizeof(float)};
}

} // namespace

GltfJson gltf_integer_lattice() { return {{"packtrace_lattice", {8, -3}}}; }

double lattice_step(const baked::GeometryRecord& geometry) {
  return PositionGrid{geometry.step_mantissa, geometry.step_exponent}.step();
}

void GltfLatticeBox::extend(const LatticePoint& p) {
  for (size_t axis = 0; axis < 3; ++axis) {
    lo[axis] = empty ? p[axis] : std::min(lo[axis], p[axis]);
    hi[axis] = empty ? p[axis] : std::max(hi[axis], p[axis]);
  }
  empty = false;
}

void GltfLatticeBox::extend(const GltfLatticeBox& box) {
  if (box.empty) return;
  extend(box.lo);
  extend(box.hi);
}

int GltfLatticeBox::bits() const {
  uint64_t extent = 1;
  for (size_t axis = 0; axis < 3; ++axis) extent = std::max(extent, static_cast<uint64_t>(hi[axis] - lo[axis]));
  return static_cast<int>(std::bit_width(extent));
}

void DracoGrids::add(const baked::GeometryRecord& geometry, uint32_t number, const GltfLatticeBox& box) {
  boxes_[key(geometry, number)].extend(box);
}

DracoGrid DracoGrids::grid(const baked::GeometryRecord& geometry, uint32_t number) const {
  const GltfLatticeBox& box = boxes_.at(key(geometry, number));
  return {box.lo, lattice_step(geometry), box.bits()};
}

DracoGrids::Key DracoGrids::key(const baked::GeometryRecord& geometry, uint32_t number) {
  return {lattice_step(geometry), (geometry.flags & baked::kWorldSpace) != 0 ? baked::kNone : number};
}

void GltfMeshes::add_geometry(uint32_t geometry, GltfGeometry&& from) {
  if (templates_.size() <= geometry) templates_.resize(geometry + 1), frames_.resize(geometry + 1, DAffine(1.0));
  if (integers_.size() <= geometry) integers_.resize(geometry + 1);
  if (config_.codec == GltfCodec::kMeshopt) return add_meshopt(geometry, std::move(from));
  for (GltfPrimitive& primitive : from.primitives) {
    if (!from.with_uvs && !primitive.draco) primitive.plain.uvs.clear();
    templates_[geometry].push_back(primitive.draco ? add_draco(primitive) : add_plain(std::move(primitive.plain)));
    primitive = {};
  }
}

GltfMeshes::Template GltfMeshes::add_plain(PlainPrimitive&& plain) {
  Template made{plain.material_slot, {}, {}, false};
  GltfJson& attributes = made.primitive["attributes"];
  attributes["POSITION"] = add_floats(floats_of(plain.positions), "VEC3");
  const auto [lo, hi] = bounds_of(plain.positions);
  GltfJson& accessor = model_.element("accessors", attributes["POSITION"].get<int>());
  accessor["min"] = shortest(lo), accessor["max"] = shortest(hi);
  if (!plain.normals.empty()) attributes["NORMAL"] = add_floats(floats_of(plain.normals), "VEC3");
  made.primitive["indices"] = add_indices(plain.triangles, plain.positions.size());
  ++report_.primitives;
  report_.vertices += plain.positions.size(), report_.triangles += plain.triangles.size();
  if (plain.uvs.empty()) return made;
  if (config_.material_extensions)
    attributes["TEXCOORD_0"] = add_floats(floats_of(plain.uvs), "VEC2");
  else
    made.mapped = true, made.uvs = std::move(plain.uvs);
  return made;
}

GltfMeshes::Template GltfMeshes::add_draco(const GltfPrimitive& from) {
  const PlainPrimitive& plain = from.plain;
  const DracoPrimitive& draco = *from.draco;
  Template made{plain.material_slot, {}, {}, false};
  GltfJson ids;
  const auto attribute = [&](const char* name, const char* type, int id) {
    ids[name] = id;
    made.primitive["attributes"][name] =
        model_.add("accessors", {{"componentType", kGltfFloat}, {"count", draco.points}, {"type", type}});
  };
  attribute("POSITION", "VEC3", draco.position_id);
  const auto [lo, hi] = bounds_of(plain.positions);
  GltfJson& accessor = model_.element("accessors", made.primitive["attributes"]["POSITION"].get<int>());
  accessor["min"] = shortest(lo), accessor["max"] = shortest(hi);
  if (draco.normal_id >= 0) attribute("NORMAL", "VEC3", draco.normal_id);
  if (draco.uv_id >= 0) attribute("TEXCOORD_0", "VEC2", draco.uv_id);
  made.primitive["indices"] = model_.add(
      "accessors", {{"componentType", kGltfUnsignedInt}, {"count", 3 * uint64_t{draco.faces}}, {"type", "SCALAR"}});
  made.primitive["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", model_.add_view(draco.bytes, 0)},
                                                                {"attributes", std::move(ids)}};
  model_.use_extension("KHR_draco_mesh_compression", true);
  report_.geometry_bytes += draco.bytes.size();
  ++report_.primitives;
  report_.vertices += draco.points, report_.triangles += draco.faces;
  report_.collapsed_triangles += plain.triangles.size() - draco.faces;
  return made;
}

/// Adds a primitive; returns null if no triangle is left of it.
GltfJson GltfMeshes::add_coded(const MeshoptPrimitive& coded, const PositionFrame& frame) {
  report_.collapsed_triangles += coded.collapsed_triangles;
  report_.max_normal_error_degrees = std::max(report_.max_normal_error_degrees, coded.max_normal_error_degrees);
  if (coded.triangles == 0) return nullptr;
  ++report_.primitives;
  report_.vertices += coded.lattice.size(), report_.triangles += coded.triangles;
  model_.use_extension("KHR_mesh_quantization", true);
  return add_meshopt_primitive(coded, frame, config_.meshopt_normal_bits, uvs_, streams_);
}

/// Adds a geometry whose positions are integers; those whose lattice is too fine stay floats.
void GltfMeshes::add_meshopt(uint32_t geometry, GltfGeometry&& from) {
  const baked::GeometryRecord& record = file_.geometries()[geometry];
  const std::optional<PositionFrame>& frame = from.frame;
  for (GltfPrimitive& primitive : from.primitives) {
    if (!frame) {
      ++report_.plain_primitives;
      if (!from.with_uvs) primitive.plain.uvs.clear();
      for (Vec2& uv : primitive.plain.uvs) // as the materials expect them
        if (uvs_.step > 0.0) uv = Vec2((glm::dvec2(uv) - uvs_.origin) / uvs_.step);
      templates_[geometry].push_back(add_plain(std::move(primitive.plain)));
      continue;
    }
    GltfJson coded = add_coded(*primitive.meshopt, *frame);
    if (!coded.is_null()) templates_[geometry].push_back({primitive.plain.material_slot, std::move(coded), {}, false});
    primitive = {};
  }
  if (!frame) return;
  integers_[geometry] = true;
  const double step = lattice_step(record);
  DAffine& map = frames_[geometry];
  map = DAffine(step);
  for (size_t axis = 0; axis < 3; ++axis)
    map[3][static_cast<int>(axis)] = static_cast<double>(frame->origin[axis]) * step;
}

int GltfMeshes::add_floats(std::span<const float> values, const char* type) {
  const int view = model_.add_view(std::as_bytes(values), kGltfVertices);
  report_.geometry_bytes += values.size_bytes();
  const size_t components = static_cast<size_t>(type[3] - '0');
  return model_.add(
      "accessors",
      {{"bufferView", view}, {"componentType", kGltfFloat}, {"count", values.size() / components}, {"type", type}});
}

int GltfMeshes::add_indices(const std::vector<Triangle>& triangles, size_t vertices) {
  GltfJson accessor{{"count", 3 * triangles.size()}, {"type", "SCALAR"}};
  const bool small = fits_short_indices(vertices);
  accessor["componentType"] = small ? kGltfUnsignedShort : kGltfUnsignedInt;
  if (small) {
    std::vector<uint16_t> shorts;
    shorts.reserve(3 * triangles.size());
    for (const Triangle& t : triangles)
      for (int corner = 0; corner < 3; ++corner) shorts.push_back(static_cast<uint16_t>(t[corner]));
    accessor["bufferView"] = model_.add_view(std::as_bytes(std::span(shorts)), kGltfIndices);
    report_.geometry_bytes += shorts.size() * sizeof(uint16_t);
  } else {
    accessor["bufferView"] = model_.add_view(std::as_bytes(std::span(triangles)), kGltfIndices);
    report_.geometry_bytes += triangles.size() * sizeof(Triangle);
  }
  return model_.add("accessors", std::move(accessor));
}

/// Texture coordinates of a part as a material without KHR_texture_transform needs them.
int GltfMeshes::mapped_uvs(uint32_t geometry, size_t part, const UvMap& map) {
  const auto [place, added] =
      mapped_.try_emplace({geometry, part, map.scale.x, map.scale.y, map.offset.x, map.offset.y}, 0);
  if (!added) return place->second;
  std::vector<Vec2> uvs;
  for (const Vec2& uv : templates_[geometry][part].uvs) uvs.emplace_back(glm::dvec2(uv) * map.scale + map.offset);
  return place->second = add_floats(floats_of(uvs), "VEC2");
}

std::optional<int> GltfMeshes::mesh_of(uint32_t geometry, uint32_t first_slot) {
  if (geometry >= templates_.size() || templates_[geometry].empty()) return std::nullopt;
  const auto [place, added] = meshes_.try_emplace({geometry, first_slot}, static_cast<int>(model_.count("meshes")));
  if (!added) return place->second;
  GltfJson mesh;
  const baked::GeometryRecord& record = file_.geometries()[geometry];
  if (config_.names) mesh["name"] = to_utf8(file_.text(record.name));
  // Integers need no extras without names: the asset states their lattice.
  if (config_.names || !integers_[geometry]) mesh["extras"] = lattice_extras(record, integers_[geometry]);
  for (size_t i = 0; i < templates_[geometry].size(); ++i) {
    const Template& part = templates_[geometry][i];
    const uint32_t material = file_.sections().material_slots[first_slot + part.material_slot];
    GltfJson primitive = part.primitive;
    primitive["material"] = materials_.number(material);
    if (part.mapped && materials_.has_image(material))
      primitive["attributes"]["TEXCOORD_0"] = mapped_uvs(geometry, i, materials_.vertex_map(material));
    mesh["primitives"].push_back(std::move(primitive));
  }
  model_.add("meshes", std::move(mesh));
  return place->second;
}

void GltfMeshes::add_world(std::vector<Placed>&& geometries, Progress& progress) {
  // Batches of one step, material and set of attributes. The extent of a batch stays within 16 bits where its
  // geometries do.
  struct Key {
    double step;
    int material;
    bool normals, uvs;
    auto operator<=>(const Key&) const = default;
  };
  std::map<Key, std::vector<Batch>> batches;
  for (Placed& placed : geometries) {
    const double step = lattice_step(file_.geometries()[placed.geometry]);
    for (GltfPrimitive& primitive : placed.encoded->primitives) {
      PlainPrimitive& plain = primitive.plain;
      const uint32_t material = file_.sections().material_slots[placed.first_slot + plain.material_slot];
      if (!materials_.has_image(material)) plain.uvs.clear();
      GltfLatticeBox box;
      for (const LatticePoint& p : plain.lattice) box.extend(p);
      std::vector<Batch>& open =
          batches[{step, materials_.number(material), !plain.normals.empty(), !plain.uvs.empty()}];
      constexpr int kShortBits = 16;
      const auto fits = [&](const Batch& batch) {
        GltfLatticeBox both = batch.box;
        both.extend(box);
        return position_frame(both.lo, both.hi) && both.bits() <= std::max({kShortBits, box.bits(), batch.box.bits()});
      };
      auto to = std::ranges::find_if(open, fits);
      if (to == open.end()) to = open.insert(open.end(), Batch{});
      to->box.extend(box);
      append(to->plain, std::move(plain));
    }
    *placed.encoded = {};
  }
  std::vector<Batch*> all;
  for (auto& [key, list] : batches)
    for (Batch& batch : list) all.push_back(&batch);
  progress.begin("compressing merged meshes", all.size());
  tbb::parallel_for(size_t{0}, all.size(), [&](size_t i) {
    progress.check_cancelled();
    Batch& batch = *all[i];
    batch.frame = *position_frame(batch.box.lo, batch.box.hi);
    batch.coded = meshopt_primitive(batch.plain, batch.frame, config_.meshopt_normal_bits, uvs_, true);
    batch.plain = {};
    progress.advance();
  });
  for (const auto& [key, list] : batches)
    for (const Batch& batch : list) add_batch(batch, key.step, key.material);
}

void GltfMeshes::add_batch(const Batch& batch, double step, int material) {
  GltfJson primitive = add_coded(batch.coded, batch.frame);
  if (primitive.is_null()) return;
  primitive["material"] = material;
  GltfJson node{{"mesh", model_.add("meshes", {{"primitives", GltfJson::array({std::move(primitive)})}})},
                {"scale", {step, step, step}}};
  if (batch.frame.origin != LatticePoint{})
    for (const int64_t q : batch.frame.origin) node["translation"].push_back(static_cast<double>(q) * step);
  world_nodes_.push_back(model_.add("nodes", std::move(node)));
}

} // namespace packtrace
