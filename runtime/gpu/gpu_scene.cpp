#include "runtime/gpu/gpu_scene.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "pbrt_import/base/error.h"
#include "runtime/gpu/gpu_scene_state.h"
#include "runtime/gpu/shaders/spirv.h"
#include "runtime/gpu/top_nodes.h"

namespace packtrace::gpu {
namespace {

constexpr uint32_t kRaysBinding = kSceneBindings, kResultsBinding = kSceneBindings + 1, kBindings = kSceneBindings + 2;
constexpr uint32_t kGroupSize = Kernel::kGroupThreads;
constexpr uint32_t kLeafCorners = 48;             ///< most corners of a leaf, which a subgroup decodes together
constexpr uint32_t kMaxRays = 65535 * kGroupSize; ///< of a dispatch
constexpr uint64_t kPayloadPadding = 16;          ///< kernels read three words from a field's first on

template <typename T>
Buffer upload_span(const std::shared_ptr<Device>& device, std::span<const T> records, const char* what,
                   uint64_t extra_bytes = 0) {
  return upload(device, std::as_bytes(records), what, extra_bytes);
}

/// Levels of nodes of the tree over placements.
uint32_t levels_of(std::span<const packed::TopNode> nodes) {
  std::vector<uint32_t> level(nodes.size(), 1);
  uint32_t most = 0;
  for (size_t i = 0; i < nodes.size(); ++i) { // children follow their parents
    most = std::max(most, level[i]);
    for (uint32_t slots = nodes[i].slots; slots != 0; slots &= slots - 1)
      if (const uint32_t child = nodes[i].child[std::countr_zero(slots)]; (child & packed::kTopLeaf) == 0)
        level[child] = level[i] + 1;
  }
  return most;
}

/// Number of rays of the next dispatch, from the time of the last.
uint32_t next_rays(uint32_t last, double last_ms, double wanted_ms) {
  const double factor = std::clamp(wanted_ms / std::max(last_ms, 1e-3), 0.25, 4.0);
  const double rays = std::clamp(factor * last, double{kGroupSize}, double{kMaxRays});
  return static_cast<uint32_t>(rays) / kGroupSize * kGroupSize;
}

} // namespace

void GpuScene::State::upload_all(const SceneTables& t) {
  nodes = upload_span(device, t.nodes, "nodes");
  clusters = upload_span(device, t.clusters, "clusters");
  payload = upload_span(device, t.payload, "clusters' bits", kPayloadPadding);
  trees = upload_span(device, t.trees, "trees");
  exact_vertices = upload_span(device, t.exact_vertices, "exact vertices");
  upload_placements(t);
}

/// Makes larger buffers for placements and what depends on them, if they need them. The old ones stay if there is no
/// room for all new ones. Returns whether some were replaced.
bool GpuScene::State::replace_buffers(const SceneTables& t) {
  const uint64_t placement_bytes = (t.placements.size() + 1) * sizeof(packed::TracePlacement);
  const uint64_t top_node_bytes = t.top_nodes.size() * sizeof(TopNodeRecord);
  if (scene.bytes() != 0 && placement_bytes <= placements.bytes() && top_node_bytes <= top_nodes.bytes() &&
      t.masks.size_bytes() <= masks.bytes())
    return false;
  StagedBuffer new_placements(device, placement_bytes, "placements"),
      new_top_nodes(device, top_node_bytes, "the tree over placements"),
      new_scene(device, sizeof(SceneRecord), "the scene's record");
  if (masks.bytes() == 0 || t.masks.size_bytes() > masks.bytes()) {
    masks = upload_span(device, t.masks, "masks");
    placed_materials.clear();
  }
  placements = std::move(new_placements), top_nodes = std::move(new_top_nodes), scene = std::move(new_scene);
  return true;
}

/// The placements' materials are the last words of the masks; there are as many as placements that are not flat.
void GpuScene::State::upload_materials(const SceneTables& t) {
  if (t.masks.empty()) return;
  const std::span<const std::byte> words = std::as_bytes(t.masks.subspan(t.scene.material_word));
  if (std::ranges::equal(words, placed_materials)) return;
  update(device, masks, sizeof(uint32_t) * uint64_t{t.scene.material_word}, words);
  placed_materials.assign(words.begin(), words.end());
  uploaded_bytes += words.size();
}

/// Uploads the placements that changed and what depends on them.
void GpuScene::State::upload_placements(const SceneTables& t) {
  const bool replaced = replace_buffers(t);
  uploaded_bytes = 0;
  std::vector<packed::TracePlacement> all(t.placements.begin(), t.placements.end());
  all.push_back(t.top);
  const std::vector<TopNodeRecord> top = pack_top_nodes(t.top_nodes);
  Commands commands;
  uploaded_bytes += placements.write_changes(commands, std::as_bytes(std::span(all)), sizeof all[0]);
  uploaded_bytes += top_nodes.write_changes(commands, std::as_bytes(std::span(top)), sizeof top[0]);
  uploaded_bytes += scene.write_changes(commands, std::as_bytes(std::span(&t.scene, 1)), sizeof t.scene);
  if (uploaded_bytes > 0) device->run(commands);
  upload_materials(t);
  if (!replaced) return;
  for (Kernel* kernel : {closest.get(), any.get()})
    if (kernel != nullptr) bind_scene(*kernel);
  ++placed;
}

void GpuScene::State::set_constants(const SceneTables& t) {
  const auto any_tree = [&](uint32_t flags) {
    return std::ranges::any_of(t.trees, [&](const TreeRecord& tree) { return (tree.flags & flags) != 0; }) ? 1u : 0u;
  };
  const uint32_t levels = levels_of(t.top_nodes);
  const DeviceTraits& traits = device->traits();
  constants = {exact ? 1u : 0u,
               traits.fused_doubles ? 1u : 0u,
               levels + t.tree_levels + 1,
               t.top_nodes.empty() ? 0u : 1u,
               any_tree(kFineTree | kInexactDifferences),
               any_tree(kGraded),
               t.masks.empty() ? 0u : 1u,
               t.exact_vertices.empty() ? 0u : 1u,
               traits.half_bytes ? 1u : 0u,
               std::max(4u, (kLeafCorners + traits.subgroup_size - 1) / traits.subgroup_size)};
  top_levels = levels, many_placements = !t.top_nodes.empty(), masked = !t.masks.empty();
}

void GpuScene::State::make_kernels() {
  auto new_closest =
      make_ray_kernel({spirv::trace_closest(), spirv::trace_closest_rays()}, kBindings, sizeof(SpanRecord));
  any = make_ray_kernel({spirv::trace_any(), spirv::trace_any_rays()}, kBindings, sizeof(SpanRecord));
  closest = std::move(new_closest);
}

std::unique_ptr<Kernel> GpuScene::State::make_kernel(std::span<const uint32_t> spirv, uint32_t bindings,
                                                     size_t push_bytes) const {
  auto kernel = std::make_unique<Kernel>(device, spirv, constants, bindings, static_cast<uint32_t>(push_bytes));
  bind_scene(*kernel);
  return kernel;
}

std::unique_ptr<Kernel> GpuScene::State::make_ray_kernel(const RayKernelCode& code, uint32_t bindings,
                                                         size_t push_bytes) const {
  if (!structures) return make_kernel(code.compute, bindings, push_bytes);
  const HitShaders hits{spirv::closest_hit(), spirv::any_hit(), spirv::miss()};
  auto kernel =
      std::make_unique<Kernel>(device, code.rays, hits, constants, bindings, static_cast<uint32_t>(push_bytes));
  bind_scene(*kernel);
  return kernel;
}

void GpuScene::State::bind_scene(Kernel& kernel) const {
  const auto all = scene_buffers();
  for (uint32_t i = 0; i < kSceneBindings; ++i) kernel.bind(i, *all[i]);
  if (kernel.traces_structures()) structures->bind(kernel);
}

/// Fills in what the queue kernel reads of leaf nodes.
void GpuScene::State::prepare_nodes(size_t count) {
  const std::unique_ptr<Kernel> kernel = make_kernel(spirv::prepare(), kSceneBindings, sizeof(SpanRecord));
  for (size_t first = 0; first < count; first += kMaxRays) {
    const SpanRecord span{static_cast<uint32_t>(first),
                          static_cast<uint32_t>(std::min<size_t>(count - first, kMaxRays)), 0, 0};
    device->run(*kernel, std::as_bytes(std::span(&span, 1)), (span.count + kGroupSize - 1) / kGroupSize);
  }
  node_count = count;
}

/// Makes room for a dispatch's rays and results, for both kernels.
void GpuScene::State::make_room(uint64_t ray_count, uint64_t result_bytes) {
  if (rays.bytes() < ray_count * sizeof(packed::KernelRay)) {
    rays = Buffer();
    rays = Buffer(device, ray_count * sizeof(packed::KernelRay), BufferPlace::kHost, "rays");
  }
  if (results.bytes() < result_bytes) {
    results = Buffer();
    results = Buffer(device, result_bytes, BufferPlace::kHost, "hits");
  }
  for (Kernel* kernel : {closest.get(), any.get()}) {
    kernel->bind(kRaysBinding, rays);
    kernel->bind(kResultsBinding, results);
  }
}

/// @param take function of the first ray, the number of rays and their results
template <typename Take>
void GpuScene::State::trace(Kernel& kernel, uint32_t& at_once, std::span<const packed::KernelRay> all,
                            uint32_t ray_class, uint32_t result_bytes, const std::function<void()>& between,
                            const Take& take) {
  const std::lock_guard lock(mutex);
  for (size_t first = 0; first < all.size();) {
    if (between) between();
    const auto count = static_cast<uint32_t>(std::min<size_t>(all.size() - first, at_once));
    try {
      make_room(count, uint64_t{count} * result_bytes);
    } catch (const Error& error) { // fewer rays at once, if there is no room for so many
      if (error.kind() != ErrorKind::kLimitExceeded || count <= kGroupSize) throw;
      at_once = count / 2;
      continue;
    }
    std::memcpy(rays.data(), all.data() + first, count * sizeof(packed::KernelRay));
    const SpanRecord span{0, count, ray_class, 0};
    const double ms = device->run(kernel, std::as_bytes(std::span(&span, 1)), (count + kGroupSize - 1) / kGroupSize);
    take(first, count, results.data());
    first += count;
    if (count == at_once || ms > device->config().dispatch_ms)
      at_once = next_rays(count, ms, device->config().dispatch_ms);
  }
}

GpuScene::GpuScene(const GpuConfig& config, const SceneTables& tables) : state_(std::make_unique<State>()) {
  state_->device = Device::share(config);
  state_->exact = config.arithmetic == GpuArithmetic::kExact || !state_->device->traits().fused_floats;
  state_->upload_all(tables);
  state_->set_constants(tables);
  if (config.structures == GpuStructures::kDriver) return; // use_structures() and place_structures() do the rest
  state_->make_kernels();
  state_->prepare_nodes(tables.nodes.size());
}

GpuScene::~GpuScene() = default;

void GpuScene::use_structures(std::shared_ptr<StructureMemory> memory, std::span<const RangeRecord> ranges) {
  state_->structures = std::make_unique<RayStructures>(*this, std::move(memory), ranges);
}

RayStructures* GpuScene::structures() const { return state_->structures.get(); }

void GpuScene::place_structures(std::span<const packed::TracePlacement> placements, std::span<const BottomLevel> levels,
                                std::span<const uint64_t> structures) const {
  const std::lock_guard lock(state_->mutex);
  state_->structures->place(placements, levels, structures);
  if (state_->closest)
    for (Kernel* kernel : {state_->closest.get(), state_->any.get()}) state_->bind_scene(*kernel);
  else
    state_->make_kernels();
  ++state_->placed;
}

void GpuScene::replace_placements(const SceneTables& tables) {
  const std::lock_guard lock(state_->mutex);
  state_->upload_placements(tables);
  if (state_->structures) return; // place_structures() follows
  if (levels_of(tables.top_nodes) > state_->top_levels || tables.top_nodes.empty() == state_->many_placements) {
    state_->set_constants(tables);
    state_->make_kernels();
  }
}

void GpuScene::closest(std::span<const packed::KernelRay> rays, uint32_t ray_class, std::span<packed::KernelHit> hits,
                       const std::function<void()>& between) const {
  state_->trace(*state_->closest, state_->rays_at_once[0], rays, ray_class, sizeof(packed::KernelHit), between,
                [&](size_t first, uint32_t count, const std::byte* results) {
                  std::memcpy(hits.data() + first, results, count * sizeof(packed::KernelHit));
                });
}

void GpuScene::any(std::span<const packed::KernelRay> rays, uint32_t ray_class, std::span<uint8_t> occluded) const {
  state_->trace(*state_->any, state_->rays_at_once[1], rays, ray_class, sizeof(uint32_t), {},
                [&](size_t first, uint32_t count, const std::byte* results) {
                  for (uint32_t i = 0; i < count; ++i)
                    occluded[first + i] = static_cast<uint8_t>(results[i * sizeof(uint32_t)]);
                });
}

void GpuScene::release_rays() const {
  const std::lock_guard lock(state_->mutex);
  state_->rays = Buffer(), state_->results = Buffer();
}

uint64_t GpuScene::uploaded_bytes() const { return state_->uploaded_bytes; }

std::string GpuScene::device_name() const { return state_->device->name(); }
uint32_t GpuScene::subgroup_size() const { return state_->device->traits().subgroup_size; }
bool GpuScene::emulates_floats() const { return state_->exact; }

uint64_t GpuScene::bytes() const {
  const State& s = *state_;
  uint64_t bytes = s.rays.bytes() + s.results.bytes();
  for (const Buffer* buffer : s.scene_buffers()) bytes += buffer->bytes();
  if (s.structures) bytes += s.structures->bytes();
  return bytes;
}

std::vector<std::string> GpuScene::validation_messages() const { return state_->device->validation_messages(); }
bool GpuScene::validates() const { return state_->device->validates(); }

} // namespace packtrace::gpu
