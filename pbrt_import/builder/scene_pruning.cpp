#include "pbrt_import/builder/scene_pruning.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace packtrace {
namespace {

/// Keeps the used elements in order, drops the others and returns the new index of each element.
template <class Element>
std::vector<uint32_t> keep_used(std::vector<Element>& elements, const std::vector<uint8_t>& used) {
  std::vector<uint32_t> numbers(elements.size(), kDropped);
  uint32_t count = 0;
  for (size_t i = 0; i < elements.size(); ++i) {
    if (!used[i]) continue;
    numbers[i] = count;
    if (count != i) elements[count] = std::move(elements[i]);
    ++count;
  }
  elements.erase(elements.begin() + count, elements.end());
  return numbers;
}

void drop_unused_animations(Scene& scene) {
  if (scene.animations.empty()) return;
  const auto for_each_user = [&](auto function) {
    const auto visit = [&](auto& things) {
      for (auto& thing : things)
        if (thing.animation != kNotAnimated) function(thing.animation);
    };
    visit(scene.shapes);
    for (Object& object : scene.objects) visit(object.shapes);
    visit(scene.animated_instances);
    visit(scene.cameras);
  };
  std::vector<uint8_t> used(scene.animations.size(), 0);
  for_each_user([&](uint32_t animation) { used[animation] = 1; });
  const std::vector<uint32_t> numbers = keep_used(scene.animations, used);
  for_each_user([&](uint32_t& animation) { animation = numbers[animation]; });
}

} // namespace

std::vector<uint32_t> drop_unused_objects(Scene& scene, InstanceResiduals& residuals, bool keep_unplaced,
                                          const std::function<void(uint32_t object)>& unused) {
  std::vector<uint8_t> shown(scene.objects.size(), keep_unplaced ? 1 : 0);
  // Most scenes show every object early, so that few of many instances are visited.
  size_t hidden = keep_unplaced ? 0 : shown.size();
  for (size_t i = 0; i < scene.instances.size() && hidden > 0; ++i) {
    uint8_t& object = shown[scene.instances[i].object];
    hidden -= object == 0;
    object = 1;
  }
  for (uint32_t i = 0; i < scene.objects.size(); ++i) {
    if (!shown[i] && !scene.objects[i].shapes.empty()) unused(i);
    if (scene.objects[i].shapes.empty()) shown[i] = 0;
  }
  if (std::find(shown.begin(), shown.end(), 0) == shown.end()) return {};
  std::vector<uint8_t> kept(scene.instances.size());
  for (size_t i = 0; i < kept.size(); ++i) kept[i] = shown[scene.instances[i].object];
  const std::vector<uint32_t> instance_numbers = keep_used(scene.instances, kept);
  residuals.keep(kept);
  std::erase_if(scene.animated_instances, [&](const AnimatedInstance& animated) { return !kept[animated.instance]; });
  for (AnimatedInstance& animated : scene.animated_instances) animated.instance = instance_numbers[animated.instance];
  const std::vector<uint32_t> numbers = keep_used(scene.objects, shown);
  for (Instance& instance : scene.instances) instance.object = numbers[instance.object];
  return instance_numbers;
}

std::vector<uint32_t> drop_unused_parts(Scene& scene) {
  std::vector<uint8_t> meshes(scene.meshes.size()), materials(scene.materials.size()), masks(scene.masks.size());
  for_each_shape(scene, [&](const Shape& shape) { meshes[shape.mesh] = materials[shape.material] = 1; });
  const std::vector<uint32_t> mesh_numbers = keep_used(scene.meshes, meshes);
  const std::vector<uint32_t> material_numbers = keep_used(scene.materials, materials);
  for_each_shape(scene, [&](Shape& shape) {
    shape.mesh = mesh_numbers[shape.mesh];
    shape.material = material_numbers[shape.material];
  });
  const auto for_each_mask = [&](auto function) {
    for (Material& material : scene.materials)
      for (uint32_t* const mask : {&material.alpha_mask, &material.shadow_alpha_mask})
        if (*mask != kNoMask) function(*mask);
  };
  for_each_mask([&](uint32_t mask) { masks[mask] = 1; });
  const std::vector<uint32_t> mask_numbers = keep_used(scene.masks, masks);
  for_each_mask([&](uint32_t& mask) { mask = mask_numbers[mask]; });
  std::vector<uint8_t> textures(scene.textures.size());
  for (const Material& material : scene.materials)
    if (material.albedo_texture != kNoTexture) textures[material.albedo_texture] = 1;
  const std::vector<uint32_t> texture_numbers = keep_used(scene.textures, textures);
  for (Material& material : scene.materials)
    if (material.albedo_texture != kNoTexture) material.albedo_texture = texture_numbers[material.albedo_texture];
  drop_unused_animations(scene);
  return mesh_numbers;
}

} // namespace packtrace
