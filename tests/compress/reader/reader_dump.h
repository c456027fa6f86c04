#pragma once

#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/motion/motion_stream.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::reader_test {

/// Arrays in the format that ptk_reader.py's compare() expects.
class Dump {
public:
  template <typename Value>
  void put(std::span<const Value> values) {
    const auto bytes = std::as_bytes(values);
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  template <typename Value>
  void put(const std::vector<Value>& values) {
    put(std::span<const Value>(values));
  }
  void put_number(uint32_t number) { put(std::span<const uint32_t>(&number, 1)); }
  const std::vector<std::byte>& bytes() const { return bytes_; }

private:
  std::vector<std::byte> bytes_;
};

/// Writes a cut at a threshold between the errors of a geometry's levels.
inline void put_cut(Dump& out, const BakedFile& file, uint32_t geometry) {
  const LodView lod = file.lod(geometry);
  out.put_number(static_cast<uint32_t>(lod.levels.size()));
  if (lod.levels.empty()) return;
  const float threshold = 0.7f * lod.levels[lod.levels.size() / 2].error;
  out.put(std::span<const float>(&threshold, 1));
  std::vector<uint32_t> cut;
  for (size_t level = 0; level < lod.levels.size(); ++level) {
    const std::vector<LodLink> links = lod.links_of(level);
    for (uint32_t c = 0; c < links.size(); ++c) {
      const LodLink& link = links[c];
      const float made = link.generating_group == baked::kNoLodGroup ? 0.0f : lod.groups[link.generating_group].error;
      if (lod.groups[link.group].error > threshold && made <= threshold)
        cut.insert(cut.end(), {lod.levels[level].geometry, c});
    }
  }
  out.put_number(static_cast<uint32_t>(cut.size() / 2));
  out.put(cut);
}

inline void put_motion(Dump& out, const BakedFile& file) {
  RigidMotion motion;
  ASSERT_FALSE(unpack_rigid_motion(file.sections().rigid_motion, motion));
  for (const size_t count : {motion.tracks.size(), motion.instances.size(), motion.cameras.size()})
    out.put_number(static_cast<uint32_t>(count));
  for (const MotionTrack& track : motion.tracks) {
    out.put_number(static_cast<uint32_t>(track.interpolation) | (track.loop ? 2u : 0u));
    out.put_number(static_cast<uint32_t>(track.keys.size()));
    for (const MotionKey& key : track.keys) {
      std::vector<double> numbers{key.time_s};
      for (int axis = 0; axis < 3; ++axis) numbers.push_back(key.translation[axis]);
      for (const double part : {key.rotation.w, key.rotation.x, key.rotation.y, key.rotation.z})
        numbers.push_back(part);
      for (int i = 0; i < 9; ++i) numbers.push_back(key.scale[i / 3][i % 3]);
      out.put(std::vector<float>(numbers.begin(), numbers.end()));
    }
  }
  for (const InstanceMotion& moving : motion.instances) {
    for (const uint32_t number : {moving.instance, moving.track, moving.inner_track}) out.put_number(number);
    out.put(std::vector<float>{moving.pivot.x, moving.pivot.y, moving.pivot.z, static_cast<float>(moving.error_world)});
  }
  for (const CameraMotion& moving : motion.cameras) {
    out.put_number(moving.camera), out.put_number(moving.track);
    out.put(std::vector<float>{static_cast<float>(moving.error_world)});
  }
}

inline void put_shading(Dump& out, const BakedFile& file) {
  out.put_number(file.has_shading() ? 1 : 0);
  const ShadingData shading = file.shading();
  for (const SurfaceShading& s : shading.materials) {
    out.put_number(s.bits);
    const Vec3 colours[] = {s.specular, s.transmission, s.emission, s.metal_eta, s.metal_k};
    out.put(std::vector<float>{s.diffuse});
    out.put(std::span<const Vec3>(colours));
    out.put(std::vector<float>{s.eta, s.roughness, s.sigma});
  }
  for (const Light& light : shading.lights) {
    out.put_number(static_cast<uint32_t>(light.kind));
    out.put(std::span<const Vec3>(&light.radiance, 1));
  }
  for (const EnvironmentMap& map : shading.maps) {
    out.put_number(map.width), out.put_number(map.height);
    out.put(map.radiance);
  }
}

inline std::vector<std::byte> dump(const BakedFile& file) {
  Dump out;
  out.put_number(static_cast<uint32_t>(file.geometries().size()));
  for (uint32_t g = 0; g < file.geometries().size(); ++g) {
    const test::Decoded mesh = test::decode(file, g);
    out.put_number(static_cast<uint32_t>(mesh.positions.size()));
    out.put_number(static_cast<uint32_t>(mesh.triangles.size()));
    for (uint32_t c = 0; c < file.clusters(g).size(); ++c) {
      const ClusterView cluster = file.cluster(g, c);
      for (uint32_t v = 0; v < cluster.vertex_count(); ++v) out.put(std::span<const int64_t>(cluster.lattice(v)));
    }
    out.put(mesh.positions);
    out.put(mesh.normals);
    out.put(mesh.uvs);
    out.put(mesh.triangles);
    out.put(mesh.slots);
  }
  out.put_number(static_cast<uint32_t>(file.instances().size()));
  for (uint32_t i = 0; i < file.instances().size(); ++i) {
    out.put(std::span<const float>(file.instances()[i].world_from_object));
    out.put_number(file.instances()[i].geometry);
    out.put(file.instance_materials(i));
  }
  for (uint32_t i = 0; i < file.sections().textures.size(); ++i) {
    const TextureView texture = file.texture(i);
    for (uint32_t y = 0; y < texture.height; ++y)
      for (uint32_t x = 0; x < texture.width; ++x) out.put(std::span<const uint8_t>(texture.texel(x, y)));
  }
  for (uint32_t g = 0; g < file.base_geometry_count(); ++g) put_cut(out, file, g);
  put_motion(out, file);
  put_shading(out, file);
  return out.bytes();
}

} // namespace packtrace::reader_test
