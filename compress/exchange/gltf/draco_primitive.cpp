#include "compress/exchange/gltf/draco_primitive.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>

namespace packtrace {
namespace {

using Attribute = draco::GeometryAttribute;

template <typename Vector>
int add_attribute(draco::Mesh& mesh, Attribute::Type type, const std::vector<Vector>& values) {
  Attribute attribute;
  attribute.Init(type, nullptr, static_cast<uint8_t>(Vector::length()), draco::DT_FLOAT32, false, sizeof(Vector), 0);
  const int id = mesh.AddAttribute(attribute, true, static_cast<uint32_t>(values.size()));
  for (uint32_t i = 0; i < values.size(); ++i)
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &values[i]);
  return id;
}

} // namespace

std::optional<DracoPrimitive> encode_draco(const PlainPrimitive& primitive, const DracoGrid& grid,
                                           const DracoConfig& config) {
  draco::Mesh mesh;
  mesh.set_num_points(static_cast<uint32_t>(primitive.positions.size()));
  mesh.SetNumFaces(primitive.triangles.size());
  for (uint32_t i = 0; i < primitive.triangles.size(); ++i) {
    const Triangle& t = primitive.triangles[i];
    mesh.SetFace(draco::FaceIndex(i), {draco::PointIndex(t.x), draco::PointIndex(t.y), draco::PointIndex(t.z)});
  }
  DracoPrimitive result;
  const int position = add_attribute(mesh, Attribute::POSITION, primitive.positions);
  const int normal = primitive.normals.empty() ? -1 : add_attribute(mesh, Attribute::NORMAL, primitive.normals);
  const int uv = primitive.uvs.empty() ? -1 : add_attribute(mesh, Attribute::TEX_COORD, primitive.uvs);
  const auto unique_id = [&](int id) { return id < 0 ? -1 : static_cast<int>(mesh.attribute(id)->unique_id()); };
  result.position_id = unique_id(position), result.normal_id = unique_id(normal), result.uv_id = unique_id(uv);
  mesh.DeduplicateAttributeValues();
  mesh.DeduplicatePointIds();

  draco::ExpertEncoder encoder(mesh);
  encoder.SetSpeedOptions(10 - config.level, 10 - config.level);
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  encoder.SetTrackEncodedProperties(true);
  Vec3 origin;
  for (int axis = 0; axis < 3; ++axis) origin[axis] = from_lattice(grid.origin[static_cast<size_t>(axis)], grid.step);
  const auto range = static_cast<float>(grid.step * (std::exp2(grid.bits) - 1.0)); // so one code is one step
  encoder.SetAttributeExplicitQuantization(position, grid.bits, 3, &origin.x, range);
  if (normal >= 0) encoder.SetAttributeQuantization(normal, config.normal_bits);
  if (uv >= 0) encoder.SetAttributeQuantization(uv, config.uv_bits);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeToBuffer(&buffer).ok()) return std::nullopt;
  result.points = static_cast<uint32_t>(encoder.num_encoded_points());
  result.faces = static_cast<uint32_t>(encoder.num_encoded_faces());
  result.bytes.resize(buffer.size());
  std::memcpy(result.bytes.data(), buffer.data(), buffer.size());
  return result;
}

} // namespace packtrace
