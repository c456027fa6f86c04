#include "compress/format/shading/shading_codec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include "compress/format/shading/shading_fields.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

namespace fields = shading_stream;

/// A fault in the part that is being read; thrown within this file only.
struct ShadingFault {
  const char* what;
};

class ShadingWriter {
public:
  template <class T>
  void value(const T& v) {
    const auto* const first = reinterpret_cast<const uint8_t*>(&v);
    bytes_.insert(bytes_.end(), first, first + sizeof v);
  }
  void text(std::string_view v) { bytes_.insert(bytes_.end(), v.begin(), v.end()); }
  std::vector<uint8_t> bytes() && { return std::move(bytes_); }

private:
  std::vector<uint8_t> bytes_;
};

class ShadingReader {
public:
  explicit ShadingReader(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  size_t at() const { return at_; }
  bool at_end() const { return at_ == bytes_.size(); }
  /// Throws unless `count` elements of `bytes` each can follow.
  void require_room(uint64_t count, uint64_t bytes) const {
    if (count > (bytes_.size() - at_) / bytes) throw ShadingFault{"truncated"};
  }
  std::span<const uint8_t> take(size_t count) {
    require_room(count, 1);
    at_ += count;
    return bytes_.subspan(at_ - count, count);
  }
  template <class T>
  T value() {
    T result;
    std::memcpy(&result, take(sizeof result).data(), sizeof result);
    return result;
  }
  void number(DVec3& to, double low, double high, const char* what) {
    for (int c = 0; c < 3; ++c) {
      to[c] = value<double>();
      if (!(to[c] >= low && to[c] <= high)) throw ShadingFault{what};
    }
  }
  void number(float& to, float low, float high, const char* what) {
    to = value<float>();
    if (!(to >= low && to <= high)) throw ShadingFault{what};
  }
  void number(Vec3& to, float low, float high, const char* what) {
    for (int c = 0; c < 3; ++c) number(to[c], low, high, what);
  }

private:
  std::span<const uint8_t> bytes_;
  size_t at_ = 0;
};

/// A colour with an exponent that its components share, as in Radiance pictures: component c is m_c 2^(e - 136) with a
/// mantissa m_c of 8 bits.
std::array<uint8_t, 4> shared_exponent(Vec3 colour) {
  const float largest = std::max({colour.x, colour.y, colour.z});
  int exponent = 0;
  if (!(largest > 0.0f)) return {};
  std::frexp(largest, &exponent);
  if (std::round(std::ldexp(largest, 8 - exponent)) > 255.0f) ++exponent;
  if (exponent < -127) return {};
  exponent = std::min(exponent, 127);
  std::array<uint8_t, 4> bytes{};
  for (size_t c = 0; c < 3; ++c)
    bytes[c] = static_cast<uint8_t>(
        std::clamp(std::round(std::ldexp(colour[static_cast<int>(c)], 8 - exponent)), 0.0f, 255.0f));
  bytes[3] = static_cast<uint8_t>(exponent + 128);
  return bytes;
}

Vec3 colour_of(const uint8_t* bytes) {
  if (bytes[3] == 0) return Vec3(0.0f);
  const int exponent = int{bytes[3]} - 136;
  const auto component = [&](int c) { return std::ldexp(static_cast<float>(bytes[c]), exponent); };
  return {component(0), component(1), component(2)};
}

/// The materials' first word.
uint32_t word_of(const SurfaceShading& shading) {
  const SurfaceShading usual;
  uint32_t word = shading.bits;
  const auto add = [&](bool differs, uint32_t bit) { word |= differs ? bit : 0u; };
  add(shading.diffuse != usual.diffuse, fields::kHasDiffuse);
  add(shading.specular != usual.specular, fields::kHasSpecular);
  add(shading.transmission != usual.transmission, fields::kHasTransmission);
  add(shading.emission != usual.emission, fields::kHasEmission);
  add(shading.metal_eta != usual.metal_eta || shading.metal_k != usual.metal_k, fields::kHasMetal);
  add(shading.eta != usual.eta, fields::kHasEta);
  add(shading.roughness != usual.roughness, fields::kHasRoughness);
  add(shading.sigma != usual.sigma, fields::kHasSigma);
  return word;
}

SurfaceShading read_material(ShadingReader& reader) {
  const auto word = reader.value<uint32_t>();
  if ((word & ~fields::kAllMaterialBits) != 0) throw ShadingFault{"material bits"};
  SurfaceShading shading;
  shading.bits = word & kAllShadingBits;
  fields::for_each_property(shading, [&](uint32_t bit, auto& value, float low, float high) {
    if ((word & bit) != 0) reader.number(value, low, high, "material property");
  });
  if (word_of(shading) != word) throw ShadingFault{"material property that need not be stored"};
  return shading;
}

Light read_light(ShadingReader& reader, uint32_t map_count) {
  const auto kind = reader.value<uint32_t>();
  if (kind >= static_cast<uint32_t>(LightKind::kLightKinds)) throw ShadingFault{"kind of light"};
  Light light;
  light.kind = static_cast<LightKind>(kind);
  reader.number(light.radiance, 0.0f, 3e38f, "brightness of a light");
  fields::for_each_light_property(light, [&](auto& value, float low, float high) {
    reader.number(value, low, high, "place or direction of a light");
  });
  if (light.kind == LightKind::kInfinite) {
    light.map = reader.value<uint32_t>();
    if (light.map != kNoMap && light.map >= map_count) throw ShadingFault{"map of a light"};
  }
  return light;
}

/// @param decode whether to decode the pixels
EnvironmentMap read_map(ShadingReader& reader, bool decode) {
  EnvironmentMap map;
  map.width = reader.value<uint32_t>(), map.height = reader.value<uint32_t>();
  if (map.width == 0 || map.height == 0 || map.width > kMaxMapWidth || map.height > kMaxMapHeight)
    throw ShadingFault{"size of an environment map"};
  const auto name_bytes = reader.value<uint32_t>();
  if (name_bytes > fields::kMaxMapName) throw ShadingFault{"name of an environment map"};
  const auto name = reader.take(name_bytes);
  const auto pixels = reader.take(size_t{map.width} * map.height * 4);
  if (!decode) return map;
  map.name.assign(name.begin(), name.end());
  map.radiance.reserve(pixels.size() / 4);
  for (size_t i = 0; i < pixels.size(); i += 4) map.radiance.push_back(colour_of(&pixels[i]));
  return map;
}

/// Reads a stream. Throws ShadingFault.
/// @param keep whether to keep what is read; null: only check and measure it
ShadingBytes read_stream(std::span<const uint8_t> stream, uint64_t material_count, ShadingData* keep) {
  ShadingReader reader(stream);
  ShadingBytes bytes;
  if (reader.value<uint32_t>() != material_count) throw ShadingFault{"number of materials"};
  const auto lights = reader.value<uint32_t>(), maps = reader.value<uint32_t>();
  reader.require_room(material_count, sizeof(uint32_t));
  reader.require_room(lights, 4 * sizeof(uint32_t));
  reader.require_room(maps, 4 * sizeof(uint32_t));
  for (uint64_t i = 0; i < material_count; ++i) {
    const SurfaceShading shading = read_material(reader);
    if (keep) keep->materials.push_back(shading);
  }
  bytes.materials = reader.at();
  for (uint32_t i = 0; i < lights; ++i) {
    const Light light = read_light(reader, maps);
    if (keep) keep->lights.push_back(light);
  }
  bytes.lights = reader.at() - bytes.materials;
  for (uint32_t i = 0; i < maps; ++i) {
    EnvironmentMap map = read_map(reader, keep != nullptr);
    if (keep) keep->maps.push_back(std::move(map));
  }
  if (!reader.at_end()) throw ShadingFault{"bytes after its end"};
  bytes.maps = stream.size() - bytes.materials - bytes.lights;
  bytes.light_count = lights, bytes.map_count = maps;
  return bytes;
}

} // namespace

std::vector<uint8_t> encode_shading(const Scene& scene) {
  ShadingWriter writer;
  writer.value(static_cast<uint32_t>(scene.materials.size()));
  writer.value(static_cast<uint32_t>(scene.lights.size()));
  writer.value(static_cast<uint32_t>(scene.environment_maps.size()));
  for (const Material& material : scene.materials) {
    const uint32_t word = word_of(material.shading);
    writer.value(word);
    fields::for_each_property(material.shading, [&](uint32_t bit, const auto& value, float, float) {
      if ((word & bit) != 0) writer.value(value);
    });
  }
  for (const Light& light : scene.lights) {
    writer.value(light.kind), writer.value(light.radiance);
    fields::for_each_light_property(light, [&](const auto& value, float, float) { writer.value(value); });
    if (light.kind == LightKind::kInfinite) writer.value(light.map);
  }
  for (const EnvironmentMap& map : scene.environment_maps) {
    if (map.name.size() > fields::kMaxMapName)
      throw Error(ErrorKind::kLimitExceeded, "an environment map's file name is longer than 4096 bytes");
    if (map.radiance.size() != size_t{map.width} * map.height)
      throw Error(ErrorKind::kInput, "invalid scene: an environment map's pixels and size disagree");
    writer.value(map.width), writer.value(map.height), writer.value(static_cast<uint32_t>(map.name.size()));
    writer.text(map.name);
    for (const Vec3 colour : map.radiance) writer.value(shared_exponent(colour));
  }
  std::vector<uint8_t> stream = std::move(writer).bytes();
  if (const auto fault = find_shading_fault(stream, scene.materials.size()))
    throw Error(ErrorKind::kInput, "invalid scene: shading: " + std::string(*fault));
  return stream;
}

ShadingData read_shading(std::span<const uint8_t> stream, uint64_t material_count) {
  ShadingData data;
  try {
    read_stream(stream, material_count, &data);
  } catch (const ShadingFault& fault) {
    throw Error(ErrorKind::kInput, std::string("shading: ") + fault.what);
  }
  return data;
}

std::optional<std::string_view> find_shading_fault(std::span<const uint8_t> stream, uint64_t material_count) {
  try {
    read_stream(stream, material_count, nullptr);
    return std::nullopt;
  } catch (const ShadingFault& fault) {
    return fault.what;
  }
}

ShadingBytes shading_bytes(std::span<const uint8_t> stream, uint64_t material_count) {
  return read_stream(stream, material_count, nullptr);
}

} // namespace packtrace
