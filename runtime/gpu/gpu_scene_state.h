#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "runtime/gpu/device/buffer.h"
#include "runtime/gpu/device/kernel.h"
#include "runtime/gpu/device/staged_buffer.h"
#include "runtime/gpu/gpu_scene.h"
#include "runtime/gpu/structures/ray_structures.h"

namespace packtrace::gpu {

inline constexpr uint32_t kSceneBindings = 9; ///< buffers of a scene, bound to 0, 1, ...

/// A kernel that traces rays: compute, and as ray generation shader.
struct RayKernelCode {
  std::span<const uint32_t> compute, rays;
};

/// Buffers and kernels of a scene on its device.
struct GpuScene::State {
  std::shared_ptr<Device> device;
  bool exact = false;
  Buffer nodes, clusters, payload, trees, exact_vertices, masks;
  StagedBuffer placements, top_nodes, scene;
  std::vector<std::byte> placed_materials;   ///< the words of `masks` that belong to placements
  std::unique_ptr<RayStructures> structures; ///< null unless the driver traverses
  std::unique_ptr<Kernel> closest, any;
  std::vector<uint32_t> constants; ///< of all kernels: scene.glsl
  uint32_t top_levels = 0;         ///< that the kernels have room for
  bool many_placements = false;    ///< whether the kernels traverse a tree over placements
  bool masked = false;             ///< whether some hits depend on masks
  size_t node_count = 0;
  uint64_t placed = 0;         ///< times that buffers of placements were replaced
  uint64_t uploaded_bytes = 0; ///< of placements and what depends on them, by the last replacement
  // Of the queries, under the mutex:
  std::mutex mutex;
  Buffer rays, results;
  /// Of the next dispatch of nearest and any hits; the speed of the first ones is not known.
  uint32_t rays_at_once[2] = {8192, 8192};

  void upload_all(const SceneTables& t);
  void upload_placements(const SceneTables& t);
  bool replace_buffers(const SceneTables& t);
  void upload_materials(const SceneTables& t);
  void set_constants(const SceneTables& t);
  void make_kernels();
  void prepare_nodes(size_t count);
  /// A kernel that reads the scene, with its buffers bound.
  std::unique_ptr<Kernel> make_kernel(std::span<const uint32_t> spirv, uint32_t bindings, size_t push_bytes) const;
  /// The same of a kernel that traces rays.
  std::unique_ptr<Kernel> make_ray_kernel(const RayKernelCode& code, uint32_t bindings, size_t push_bytes) const;
  void bind_scene(Kernel& kernel) const;
  std::array<const Buffer*, kSceneBindings> scene_buffers() const {
    return {&nodes, &clusters,       &payload, &placements.device(), &top_nodes.device(),
            &trees, &exact_vertices, &masks,   &scene.device()};
  }
  void make_room(uint64_t ray_count, uint64_t result_bytes);
  template <typename Take>
  void trace(Kernel& kernel, uint32_t& at_once, std::span<const packed::KernelRay> all, uint32_t ray_class,
             uint32_t result_bytes, const std::function<void()>& between, const Take& take);
};

} // namespace packtrace::gpu
