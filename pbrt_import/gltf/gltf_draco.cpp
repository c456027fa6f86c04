#include "pbrt_import/gltf/gltf_draco.h"

#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <draco/compression/config/compression_shared.h>
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/mesh.h>
#pragma GCC diagnostic pop

namespace packtrace::gltf {
namespace {

constexpr const char* kWhat = "decoding Draco data";

/// A number as bitstreams before and from a version on store it: 32 bits, or a variable number of bytes.
std::optional<uint32_t> read_number(draco::DecoderBuffer& buffer, bool fixed) {
  uint32_t number = 0;
  if (fixed ? buffer.Decode(&number) : draco::DecodeVarint(&number, &buffer)) return number;
  return std::nullopt;
}

/// Most bytes that Draco allocates for the triangles whose header comes next; none if the header is damaged. Draco
/// compares counts with each other before it allocates, but not with the size of the data: 30 bytes claim 2^32 / 3
/// triangles. Source: draco/compression/mesh/mesh_edgebreaker_decoder_impl.cc, version 1.5.
std::optional<uint64_t> connectivity_bytes(const draco::MeshEdgebreakerDecoder& decoder, draco::DecoderBuffer header) {
  const uint16_t version = decoder.bitstream_version();
  const bool fixed = version < DRACO_BITSTREAM_VERSION(2, 0);
  if (version < DRACO_BITSTREAM_VERSION(2, 2) && !read_number(header, fixed)) return std::nullopt; // new vertices
  const std::optional<uint32_t> vertices = read_number(header, fixed), faces = read_number(header, fixed);
  uint8_t attributes = 0;
  if (!vertices || !faces || !header.Decode(&attributes)) return std::nullopt;
  const std::optional<uint32_t> symbols = read_number(header, fixed), splits = read_number(header, fixed);
  if (!symbols || !splits) return std::nullopt;
  // Per face: corner tables and the mesh 36, points of corners 24, queues 8, symbols of the valence coding 24 and
  // their growth. Per attribute with own seams: its corner table and maps of vertices.
  constexpr uint64_t kFace = 112, kVertex = 24, kSeamFace = 64, kSeamVertex = 24;
  return *faces * (kFace + kSeamFace * attributes) +
         (uint64_t{*vertices} + *splits) * (kVertex + kSeamVertex * attributes);
}

/// The same for the sequential coding: indices 12 bytes, and faces 12, three times while their vector grows.
std::optional<uint64_t> connectivity_bytes(const draco::MeshSequentialDecoder& decoder, draco::DecoderBuffer header) {
  const std::optional<uint32_t> faces =
      read_number(header, decoder.bitstream_version() < DRACO_BITSTREAM_VERSION(2, 2));
  if (!faces) return std::nullopt;
  constexpr uint64_t kFace = 48;
  return *faces * kFace;
}

/// Most bytes that Draco allocates for the values of a mesh whose triangles and kinds of attributes are decoded.
uint64_t values_bytes(const draco::PointCloud& cloud) {
  constexpr uint64_t kLimit = uint64_t{1} << 60; // no budget has so much
  constexpr uint64_t kPoint = 24;                // order and map of the points
  uint64_t bytes = 0;
  for (int i = 0; i < cloud.num_attributes() && bytes < kLimit; ++i) {
    const draco::PointAttribute& attribute = *cloud.attribute(i);
    const auto components = static_cast<uint64_t>(attribute.num_components());
    // The values, and 32-bit integers before their quantisation is undone, with their predictions.
    bytes += cloud.num_points() * (components * static_cast<uint64_t>(draco::DataTypeLength(attribute.data_type())) +
                                   12 * components + kPoint);
  }
  return bytes;
}

/// A decoder that reserves memory before it allocates.
template <class Decoder>
class ReservingDecoder : public Decoder {
public:
  explicit ReservingDecoder(MemoryReservation& memory) : memory_(memory) {}

protected:
  bool DecodeConnectivity() override {
    const std::optional<uint64_t> bytes = connectivity_bytes(*this, *this->buffer());
    if (!bytes) return false;
    memory_.resize(*bytes, kWhat);
    return Decoder::DecodeConnectivity();
  }
  bool DecodeAllAttributes() override {
    memory_.resize(memory_.bytes() + values_bytes(*this->point_cloud()), kWhat);
    return Decoder::DecodeAllAttributes();
  }

private:
  MemoryReservation& memory_;
};

std::unique_ptr<draco::MeshDecoder> decoder_of(uint8_t method, MemoryReservation& memory) {
  if (method == draco::MESH_EDGEBREAKER_ENCODING)
    return std::make_unique<ReservingDecoder<draco::MeshEdgebreakerDecoder>>(memory);
  if (method == draco::MESH_SEQUENTIAL_ENCODING)
    return std::make_unique<ReservingDecoder<draco::MeshSequentialDecoder>>(memory);
  return nullptr;
}

[[noreturn]] void fail(const Value& extension, const std::string& problem) {
  extension.fail("has damaged Draco data: " + problem);
}

/// Decodes a mesh with all that its data hold.
void decode_mesh(std::span<const std::byte> compressed, const Value& extension, MemoryReservation& memory,
                 draco::Mesh& mesh) {
  const auto* const data = reinterpret_cast<const char*>(compressed.data());
  draco::DecoderBuffer header_buffer, buffer;
  header_buffer.Init(data, compressed.size());
  buffer.Init(data, compressed.size());
  draco::DracoHeader header;
  const draco::Status known = draco::PointCloudDecoder::DecodeHeader(&header_buffer, &header);
  if (!known.ok()) fail(extension, known.error_msg());
  if (header.encoder_type != draco::TRIANGULAR_MESH) fail(extension, "they are not of a mesh");
  const std::unique_ptr<draco::MeshDecoder> decoder = decoder_of(header.encoder_method, memory);
  if (!decoder) fail(extension, "their method is not known");
  try {
    const draco::Status status = decoder->Decode(draco::DecoderOptions(), &buffer, &mesh);
    if (!status.ok()) fail(extension, status.error_msg());
  } catch (const std::bad_alloc&) {
    fail(extension, "they claim more than the memory holds");
  } catch (const std::length_error&) {
    fail(extension, "they claim more than the memory holds");
  }
}

std::vector<float> values_of(const draco::PointAttribute& attribute, uint32_t points, uint32_t components,
                             const std::string& name, const Value& extension) {
  std::vector<float> values(size_t{points} * components);
  for (draco::PointIndex point(0); point < points; ++point) {
    const draco::AttributeValueIndex value = attribute.mapped_index(point);
    if (value.value() >= attribute.size() ||
        !attribute.ConvertValue<float>(value, static_cast<int8_t>(components),
                                       &values[size_t{point.value()} * components]))
      extension.fail("has damaged Draco data of " + name);
  }
  return values;
}

} // namespace

DracoPrimitive decode_draco(std::span<const std::byte> compressed, const DracoWants& wants, const Value& extension,
                            MemoryReservation& memory) {
  draco::Mesh mesh;
  decode_mesh(compressed, extension, memory, mesh);
  DracoPrimitive primitive;
  primitive.vertices = mesh.num_points();
  uint64_t bytes = uint64_t{mesh.num_faces()} * 3 * sizeof(uint32_t);
  for (const auto& [name, components] : wants) bytes += uint64_t{primitive.vertices} * components * sizeof(float);
  memory.resize(memory.bytes() + bytes, kWhat);
  primitive.indices.reserve(size_t{mesh.num_faces()} * 3);
  for (draco::FaceIndex face(0); face < mesh.num_faces(); ++face)
    for (const draco::PointIndex& point : mesh.face(face)) {
      if (point.value() >= primitive.vertices) fail(extension, "an index is out of range");
      primitive.indices.push_back(point.value());
    }
  const Value numbers = extension.at("attributes");
  for (const auto& [name, components] : wants) {
    const std::optional<uint64_t> number = numbers.find_integer(name.c_str());
    if (!number) continue;
    const draco::PointAttribute* const attribute = *number <= std::numeric_limits<uint32_t>::max()
                                                       ? mesh.GetAttributeByUniqueId(static_cast<uint32_t>(*number))
                                                       : nullptr;
    if (!attribute) extension.fail("names the attribute " + name + ", which the Draco data lack");
    if (attribute->num_components() < static_cast<int>(components)) extension.fail("has too few components of " + name);
    primitive.attributes[name] = values_of(*attribute, primitive.vertices, components, name, extension);
  }
  memory.resize(bytes, kWhat);
  return primitive;
}

} // namespace packtrace::gltf
