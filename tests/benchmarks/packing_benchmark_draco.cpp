#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>

#include "pbrt_import/base/error.h"
#include "tests/benchmarks/packing_benchmark_codecs.h"
#include "tests/benchmarks/packing_benchmark_vertex.h"

namespace packtrace {
namespace {

constexpr int kNormalBits = 12;
constexpr int kUvBits = 14;
constexpr int kMaxPositionBits = 30;

void require(const draco::Status& status) {
  if (!status.ok()) throw std::runtime_error("draco: " + status.error_msg_string());
}

template <typename Value>
int add_attribute(draco::Mesh& mesh, draco::GeometryAttribute::Type type, draco::DataType data_type, uint8_t components,
                  const std::vector<Value>& values) {
  draco::GeometryAttribute attribute;
  attribute.Init(type, nullptr, components, data_type, false, sizeof(Value), 0);
  const int id = mesh.AddAttribute(attribute, true, static_cast<uint32_t>(values.size()));
  for (uint32_t i = 0; i < values.size(); ++i)
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &values[i]);
  return id;
}

class DracoCodec : public PackingCodec {
public:
  std::string name() const override { return "Draco, compression level 10"; }

  size_t encode(const Mesh& mesh, const PackingPrecision& precision) override {
    encode_to(mesh, precision, false, buffer_);
    return buffer_.size();
  }
  void decode() override { decoded_ = decode_from(buffer_); }

  /// Draco reorders and merges vertices. A second, larger encoding that stores vertex numbers gives the correspondence.
  PackingErrors errors(const Mesh& source, const PackingPrecision& precision) override {
    draco::EncoderBuffer numbered;
    encode_to(source, precision, true, numbered);
    const auto mesh = decode_from(numbered);
    PlainMesh plain;
    std::vector<uint32_t> source_vertex;
    const draco::PointAttribute* const numbers = mesh->GetNamedAttribute(draco::GeometryAttribute::GENERIC);
    const draco::PointAttribute* const positions = mesh->GetNamedAttribute(draco::GeometryAttribute::POSITION);
    const draco::PointAttribute* const normals = mesh->GetNamedAttribute(draco::GeometryAttribute::NORMAL);
    const draco::PointAttribute* const uvs = mesh->GetNamedAttribute(draco::GeometryAttribute::TEX_COORD);
    for (draco::PointIndex point(0); point < mesh->num_points(); ++point) {
      numbers->GetMappedValue(point, &source_vertex.emplace_back());
      positions->GetMappedValue(point, &plain.positions.emplace_back());
      if (normals != nullptr) normals->GetMappedValue(point, &plain.normals.emplace_back());
      if (uvs != nullptr) uvs->GetMappedValue(point, &plain.uvs.emplace_back());
    }
    plain.triangles.resize(decoded_->num_faces());
    return compare_vertices(source, plain, source_vertex);
  }

private:
  static void encode_to(const Mesh& source, const PackingPrecision& precision, bool numbered,
                        draco::EncoderBuffer& out) {
    draco::Mesh mesh;
    mesh.set_num_points(static_cast<uint32_t>(source.positions.size()));
    mesh.SetNumFaces(source.triangles.size());
    for (uint32_t i = 0; i < source.triangles.size(); ++i) {
      const Triangle& t = source.triangles[i];
      mesh.SetFace(draco::FaceIndex(i), {draco::PointIndex(t.x), draco::PointIndex(t.y), draco::PointIndex(t.z)});
    }
    using Attribute = draco::GeometryAttribute;
    const int positions = add_attribute(mesh, Attribute::POSITION, draco::DT_FLOAT32, 3, source.positions);
    int normals = -1, uvs = -1;
    if (!source.normals.empty()) normals = add_attribute(mesh, Attribute::NORMAL, draco::DT_FLOAT32, 3, source.normals);
    if (!source.uvs.empty()) uvs = add_attribute(mesh, Attribute::TEX_COORD, draco::DT_FLOAT32, 2, source.uvs);
    if (numbered) {
      std::vector<uint32_t> numbers(source.positions.size());
      for (uint32_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
      add_attribute(mesh, Attribute::GENERIC, draco::DT_UINT32, 1, numbers);
    }
    mesh.DeduplicateAttributeValues();
    mesh.DeduplicatePointIds();

    draco::ExpertEncoder encoder(mesh);
    encoder.SetSpeedOptions(0, 0); // compression level 10
    encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
    const PackingBox box = packing_box(source);
    const int bits = static_cast<int>(std::ceil(std::log2(box.side / precision.step + 1.0)));
    if (bits > kMaxPositionBits) throw Error(ErrorKind::kLimitExceeded, "draco: more than 30 bits for positions");
    const auto range = static_cast<float>(precision.step * (std::exp2(bits) - 1.0));
    encoder.SetAttributeExplicitQuantization(positions, bits, 3, &box.lo.x, std::max(range, float(box.side)));
    if (normals >= 0) encoder.SetAttributeQuantization(normals, kNormalBits);
    if (uvs >= 0) encoder.SetAttributeQuantization(uvs, kUvBits);
    out.Clear();
    require(encoder.EncodeToBuffer(&out));
  }

  static std::unique_ptr<draco::Mesh> decode_from(const draco::EncoderBuffer& buffer) {
    draco::DecoderBuffer input;
    input.Init(buffer.data(), buffer.size());
    auto mesh = draco::Decoder().DecodeMeshFromBuffer(&input);
    require(mesh.status());
    return std::move(mesh).value();
  }

  draco::EncoderBuffer buffer_;
  std::unique_ptr<draco::Mesh> decoded_;
};

} // namespace

std::unique_ptr<PackingCodec> draco_codec() { return std::make_unique<DracoCodec>(); }

} // namespace packtrace
