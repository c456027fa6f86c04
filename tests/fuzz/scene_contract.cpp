#include "tests/fuzz/scene_contract.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/fuzz/fuzz_target.h"

namespace packtrace::fuzz {
namespace {

bool is_affine_invertible(const DAffine& map) {
  for (int column = 0; column < 4; ++column)
    if (!is_finite(map[column])) return false;
  const double determinant = glm::determinant(glm::dmat3(map));
  return determinant != 0.0 && std::isfinite(determinant);
}

/// Checks indices from one array of a scene into another, and that all elements are used.
class Uses {
public:
  explicit Uses(size_t count) : used_(count, false) {}
  void add(uint32_t index, const char* what) {
    require(index < used_.size(), what);
    used_[index] = true;
  }
  bool all() const { return std::find(used_.begin(), used_.end(), false) == used_.end(); }

private:
  std::vector<bool> used_;
};

void require_material(const Material& material, Uses& masks, Uses& textures) {
  for (int c = 0; c < 3; ++c) require(material.albedo[c] >= 0.0f && material.albedo[c] <= 1.0f, "albedo outside [0,1]");
  require((material.flags & ~kAllMaterialFlags) == 0 && (material.flags & kAbsent) == 0, "material flags");
  const auto require_mask = [&](MaterialFlags flag, uint32_t mask) {
    require(((material.flags & flag) != 0) == (mask != kNoMask), "mask flag without mask or the reverse");
    if (mask != kNoMask) masks.add(mask, "mask number");
  };
  require_mask(kAlphaMask, material.alpha_mask);
  require_mask(kShadowAlphaMask, material.shadow_alpha_mask);
  if (material.albedo_texture == kNoTexture) return;
  require((material.flags & kAlbedoTexture) != 0, "texture without its flag");
  textures.add(material.albedo_texture, "texture number");
}

bool is_colour(Vec3 v, float high) {
  return v.x >= 0.0f && v.y >= 0.0f && v.z >= 0.0f && std::max({v.x, v.y, v.z}) <= high;
}

void require_shading(const SurfaceShading& s) {
  require((s.bits & ~kAllShadingBits) == 0, "shading bits");
  require(s.diffuse >= 0.0f && s.diffuse <= 1.0f && is_colour(s.specular, 1.0f) && is_colour(s.transmission, 1.0f),
          "reflection outside [0,1]");
  require(is_colour(s.emission, 3e38f) && is_colour(s.metal_eta, 1e6f) && is_colour(s.metal_k, 1e6f),
          "emission or index");
  require(s.eta >= 1.0f && s.eta <= 8.0f && s.roughness >= 0.0f && s.roughness <= 2.0f && s.sigma >= 0.0f &&
              s.sigma <= 90.0f,
          "index, roughness or sigma");
}

void require_light(const Light& light, const Scene& scene) {
  require(is_colour(light.radiance, 3e38f) && is_finite(light.position), "brightness or place of a light");
  require(std::abs(glm::length(light.direction) - 1.0f) < 1e-5f, "direction of a light");
  require(light.cos_outer <= light.cos_inner && light.cos_outer >= -1.0f && light.cos_inner <= 1.0f, "cone of a light");
  require(light.map == kNoMap || light.map < scene.environment_maps.size(), "map of a light");
}

void require_map(const EnvironmentMap& map) {
  require(map.width > 0 && map.height > 0 && map.width <= kMaxMapWidth && map.height <= kMaxMapHeight &&
              map.radiance.size() == size_t{map.width} * map.height,
          "size of an environment map");
  for (const Vec3 pixel : map.radiance) require(is_colour(pixel, INFINITY) && is_finite(pixel), "pixel of a map");
}

void require_texture(const AlbedoTexture& texture) {
  require(texture.width > 0 && texture.height > 0, "texture without texels");
  require(texture.rgb.size() == size_t{3} * texture.width * texture.height, "size of a texture");
  require(static_cast<uint32_t>(texture.wrap) <= 2, "wrap mode of a texture");
  for (const Vec2 v : {texture.uv_scale, texture.uv_offset})
    require(std::isfinite(v.x) && std::isfinite(v.y), "transform of a texture");
}

void require_mask(const AlphaMask& mask) {
  require(mask.width > 0 && mask.height > 0, "mask without texels");
  require(mask.words.size() == size_t{AlphaMask::row_words(mask.width)} * mask.height, "size of a mask");
  require(static_cast<uint32_t>(mask.wrap) <= 2, "wrap mode");
  for (const Vec2 v : {mask.uv_scale, mask.uv_offset})
    require(std::isfinite(v.x) && std::isfinite(v.y), "texture transform of a mask");
}

void require_key(const TransformKey& key) {
  require(is_affine_invertible(key.map), "key of an animation");
  require(std::abs(glm::dot(key.rotation, key.rotation) - 1.0) < 1e-9, "rotation not of unit length");
  const glm::dmat3 whole(key.map), product = glm::mat3_cast(key.rotation) * key.scale;
  double largest = 0.0, difference = 0.0;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) {
      largest = std::max(largest, std::abs(whole[column][row]));
      difference = std::max(difference, std::abs(whole[column][row] - product[column][row]));
    }
  require(difference <= 1e-9 * largest, "key that is not its rotation times its scale");
}

void require_animation(const AnimatedTransform& animation) {
  require(std::isfinite(animation.start_time) && std::isfinite(animation.end_time), "time of a key");
  require_key(animation.start);
  require_key(animation.end);
  require(glm::dot(animation.start.rotation, animation.end.rotation) >= 0.0, "animation the longer way round");
  const auto same = [&](double time, const DAffine& map) { return interpolate(animation, time) == map; };
  require(same(animation.start_time, animation.start.map), "animation does not start at its start");
  require(animation.end_time <= animation.start_time || same(animation.end_time, animation.end.map),
          "animation does not end at its end");
  const DAffine between = interpolate(animation, 0.5 * animation.start_time + 0.5 * animation.end_time);
  for (int column = 0; column < 4; ++column) require(is_finite(between[column]), "animation leaves the finite numbers");
}

void require_track(const MotionTrack& track, size_t least_keys) {
  require(track.keys.size() >= least_keys, "track that does not move");
  for (size_t i = 0; i < track.keys.size(); ++i) {
    const MotionKey& key = track.keys[i];
    require(std::isfinite(key.time_s) && (i == 0 || track.keys[i - 1].time_s < key.time_s), "times of a track");
    require(std::abs(glm::dot(key.rotation, key.rotation) - 1.0) < 1e-9, "rotation not of unit length");
    require(is_finite(key.translation), "translation of a track");
    for (int column = 0; column < 3; ++column) require(is_finite(key.scale[column]), "scale of a track");
  }
}

void require_camera(const Camera& camera) {
  require(is_affine_invertible(camera.world_from_camera), "camera transform");
  require(std::isfinite(camera.fov_degrees), "field of view");
  require(static_cast<uint32_t>(camera.projection) <= 2, "projection");
  require(camera.width_px > 0 && camera.height_px > 0, "film without pixels");
  for (int i = 0; camera.screen_window && i < 4; ++i)
    require(std::isfinite((*camera.screen_window)[i]), "screen window");
  require(camera.shutter_open <= camera.shutter_close, "shutter closes before it opens");
}

void require_scene_contract(const Scene& scene) {
  Uses meshes(scene.meshes.size()), materials(scene.materials.size()), masks(scene.masks.size());
  Uses textures(scene.textures.size());
  Uses objects(scene.objects.size()), animations(scene.animations.size()), tracks(scene.motion.tracks.size());
  const auto require_animation_number = [&](uint32_t number) {
    if (number != kNotAnimated) animations.add(number, "animation number");
  };
  const auto require_shape = [&](const Shape& shape) {
    meshes.add(shape.mesh, "mesh number");
    materials.add(shape.material, "material number");
    require(is_affine_invertible(shape.parent_from_mesh), "shape transform");
    require_animation_number(shape.animation);
  };
  for (const Mesh& mesh : scene.meshes) {
    require_mesh_contract(mesh);
    require(!mesh.triangles.empty(), "mesh without triangles in a scene");
  }
  for (const Shape& shape : scene.shapes) require_shape(shape);
  for (const Object& object : scene.objects) {
    require(!object.shapes.empty(), "object without shapes");
    for (const Shape& shape : object.shapes) require_shape(shape);
  }
  for (const Instance& instance : scene.instances) {
    objects.add(instance.object, "object number");
    require(is_affine_invertible(DAffine(instance.world_from_object)), "instance transform");
  }
  for (const Material& material : scene.materials)
    require_material(material, masks, textures), require_shading(material.shading);
  for (const Light& light : scene.lights) require_light(light, scene);
  for (const EnvironmentMap& map : scene.environment_maps) require_map(map);
  for (const AlbedoTexture& texture : scene.textures) require_texture(texture);
  for (const AlphaMask& mask : scene.masks) require_mask(mask);
  for (const Camera& camera : scene.cameras) {
    require_camera(camera);
    require_animation_number(camera.animation);
  }
  require(std::isfinite(scene.time), "time of the scene");
  for (const AnimatedTransform& animation : scene.animations) require_animation(animation);
  for (size_t i = 0; i < scene.animated_instances.size(); ++i) {
    const AnimatedInstance& moving = scene.animated_instances[i];
    require(moving.instance < scene.instances.size(), "number of an animated instance");
    require(i == 0 || scene.animated_instances[i - 1].instance < moving.instance, "order of the animated instances");
    require(moving.animation != kNotAnimated, "animated instance without an animation");
    require_animation_number(moving.animation);
  }
  for (size_t i = 0; i < scene.motion.instances.size(); ++i) {
    const InstanceMotion& moving = scene.motion.instances[i];
    const size_t count = scene.shapes.size() + scene.instances.size();
    require(moving.instance >= scene.shapes.size() && moving.instance < count, "number of a moving instance");
    require(i == 0 || scene.motion.instances[i - 1].instance < moving.instance, "order of the moving instances");
    tracks.add(moving.track, "track number");
    require_track(scene.motion.tracks[moving.track], 2);
    if (moving.inner_track == kNoTrack) continue;
    tracks.add(moving.inner_track, "inner track number");
    require_track(scene.motion.tracks[moving.inner_track], 1);
  }
  for (const CameraMotion& moving : scene.motion.cameras) {
    require(moving.camera < scene.cameras.size(), "number of a moving camera");
    tracks.add(moving.track, "track number");
    require_track(scene.motion.tracks[moving.track], 2);
  }
  require(meshes.all() && materials.all() && masks.all() && textures.all() && objects.all() && animations.all() &&
              tracks.all(),
          "something unused was kept");
}

uint64_t stored_shapes(const Scene& scene) {
  uint64_t count = scene.shapes.size();
  for (const Object& object : scene.objects) count += object.shapes.size();
  return count;
}

void append(std::string& to, const std::string& text) { to.append(text).push_back('\0'); }

template <class T>
void append_bytes(std::string& to, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class T>
void append_all(std::string& to, const std::vector<T>& values) {
  append_bytes(to, values.size());
  for (const T& value : values) append_bytes(to, value);
}

void append_shapes(std::string& to, const std::vector<Shape>& shapes) {
  append_bytes(to, shapes.size());
  for (const Shape& shape : shapes) {
    append_bytes(to, shape.mesh);
    append_bytes(to, shape.material);
    append_bytes(to, shape.reverse_orientation);
    append_bytes(to, shape.animation);
    append_bytes(to, shape.parent_from_mesh);
  }
}

void append_scene(std::string& to, const Scene& scene) {
  for (const Mesh& mesh : scene.meshes) {
    append(to, mesh.name);
    append_all(to, mesh.positions);
    append_all(to, mesh.normals);
    append_all(to, mesh.uvs);
    append_all(to, mesh.triangles);
  }
  for (const Material& material : scene.materials) {
    append(to, material.name);
    append_bytes(to, material.flags);
    append_bytes(to, material.albedo);
    append_bytes(to, material.alpha_mask);
    append_bytes(to, material.shadow_alpha_mask);
    append_bytes(to, material.albedo_texture);
  }
  for (const AlphaMask& mask : scene.masks) {
    append_bytes(to, mask.width);
    append_bytes(to, mask.height);
    append_bytes(to, mask.wrap);
    append_bytes(to, mask.uv_scale);
    append_bytes(to, mask.uv_offset);
    append_all(to, mask.words);
  }
  for (const AlbedoTexture& texture : scene.textures) {
    append(to, texture.name);
    append_bytes(to, texture.width);
    append_bytes(to, texture.height);
    append_bytes(to, texture.wrap);
    append_bytes(to, texture.uv_scale);
    append_bytes(to, texture.uv_offset);
    append_all(to, texture.rgb);
  }
  append_shapes(to, scene.shapes);
  for (const Object& object : scene.objects) {
    append(to, object.name);
    append_shapes(to, object.shapes);
  }
  append_all(to, scene.instances);
  for (const Camera& camera : scene.cameras) {
    append_bytes(to, camera.projection);
    append_bytes(to, camera.world_from_camera);
    append_bytes(to, camera.fov_degrees);
    append_bytes(to, camera.screen_window.value_or(glm::dvec4(0.0)));
    append_bytes(to, camera.width_px);
    append_bytes(to, camera.height_px);
    append(to, camera.film_name);
    append_bytes(to, camera.shutter_open);
    append_bytes(to, camera.shutter_close);
    append_bytes(to, camera.animation);
  }
  append_bytes(to, scene.time);
  append_all(to, scene.animations);
  append_all(to, scene.animated_instances);
  append_bytes(to, scene.dropped_triangles);
}

} // namespace

void require_mesh_contract(const Mesh& mesh) {
  const size_t vertices = mesh.positions.size();
  require(mesh.normals.empty() || mesh.normals.size() == vertices, "number of normals");
  require(mesh.uvs.empty() || mesh.uvs.size() == vertices, "number of texture coordinates");
  for (const Vec3 p : mesh.positions) require(is_finite(p), "position not finite");
  for (const Vec3 n : mesh.normals)
    require(std::abs(glm::dot(n, n) - 1.0f) < 1e-5f, "normal not of unit length"); // a few rounding errors
  for (const Triangle& t : mesh.triangles) {
    require(std::max({t.x, t.y, t.z}) < vertices, "vertex index out of range");
    require(t.x != t.y && t.y != t.z && t.z != t.x, "triangle repeats an index");
  }
}

void require_import_contract(const ImportResult& result, const Diagnostics& diagnostics) {
  const ImportStatistics& statistics = result.statistics;
  require_scene_contract(result.scene);
  require(statistics.triangles == unique_triangle_count(result.scene), "number of triangles");
  uint64_t directives = 0;
  for (const auto& [kind, count] : statistics.shapes) directives += count;
  const uint64_t accounted = stored_shapes(result.scene) + statistics.shapes_skipped + statistics.shapes_absent;
  require(accounted <= directives, "more shapes than Shape directives");
  require(statistics.files_read >= 1, "number of files");
  const bool silent = diagnostics.entries().empty();
  require(!silent || (accounted == directives && statistics.shapes_absent == 0), "shapes left out in silence");
  require(!silent || result.scene.dropped_triangles == 0, "triangles dropped in silence");
  require(statistics.shapes_skipped == 0 || diagnostics.count(Severity::kError) > 0, "shapes skipped without an error");
  require(statistics.textures_missing == 0 || diagnostics.count(Severity::kError) > 0, "texture missing in silence");
  for (const Diagnostic& diagnostic : diagnostics.entries())
    require(!diagnostic.message.empty() && diagnostic.count > 0, "empty diagnostic");
}

std::string fingerprint(const ImportResult& result, const Diagnostics& diagnostics) {
  std::string bytes;
  append_scene(bytes, result.scene);
  const ImportStatistics& s = result.statistics;
  for (const uint64_t value : {s.directives, s.files_read, s.bytes_read, s.shapes_skipped, s.shapes_absent,
                               s.light_sources, s.area_lights, s.textures_found, s.textures_missing, s.triangles})
    append_bytes(bytes, value);
  for (const auto& [kind, count] : s.shapes) {
    append(bytes, kind);
    append_bytes(bytes, count);
  }
  for (const Diagnostic& diagnostic : diagnostics.entries()) append(bytes, to_string(diagnostic));
  return bytes;
}

} // namespace packtrace::fuzz
