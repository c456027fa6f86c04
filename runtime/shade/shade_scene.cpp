#include "runtime/shade/shade_scene.h"

#include <algorithm>
#include <array>
#include <map>
#include <tuple>

#include <tbb/parallel_for.h>

namespace packtrace {

ShadeScene::ShadeScene(const SceneSource& source, const std::optional<MemoryBudget>& memory)
    : lights_(source), textures_(source, memory) {
  using Floats = std::array<float, 3>;
  using Key = std::tuple<ShadingBits, float, float, Floats, Floats, Floats>;
  const auto key = [](Vec3 v) { return Floats{v.x, v.y, v.z}; };
  std::map<Key, uint32_t> numbers;
  std::vector<SurfaceShading> distinct;
  // Camera rays follow light through partly opaque surfaces. They miss shadow masks and invisible surfaces, so beside
  // these such surfaces block all light.
  const bool only_for_occlusion = std::ranges::any_of(source.materials(), [](const Material& material) {
    return (material.flags & (kShadowAlphaMask | kInvisible)) != 0;
  });
  const Glass partial = only_for_occlusion ? Glass::kClear : Glass::kPartial;
  for (const Material& material : source.materials()) {
    const SurfaceShading& s = material.shading;
    if (s.transmits()) glass_ = std::max(glass_, occludes(material.flags) ? partial : Glass::kClear);
    const auto [it, inserted] =
        numbers.try_emplace({s.fresnel(), s.eta, s.roughness, key(s.specular), key(s.metal_eta), key(s.metal_k)},
                            static_cast<uint32_t>(distinct.size()));
    if (inserted) distinct.push_back(s);
    albedo_of_.push_back(it->second);
  }
  albedos_.resize(distinct.size());
  tbb::parallel_for(size_t{0}, distinct.size(), [&](size_t i) { albedos_[i] = DirectionalAlbedo(distinct[i]); });
}

} // namespace packtrace
