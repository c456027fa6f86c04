#include "runtime/gpu/device_denoiser.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "pbrt_import/base/error.h"
#include "runtime/gpu/device/kernel.h"
#include "runtime/gpu/device/staged_buffer.h"
#include "runtime/gpu/device_ao.h"
#include "runtime/gpu/device_view.h"
#include "runtime/gpu/shaders/spirv.h"

namespace packtrace::gpu {
namespace {

/// What a frame leaves to the next one.
struct Past {
  Buffer guides, history, rest; ///< rest: moments and trends
};
// Per pixel.
constexpr uint32_t kGuideBytes = 16, kHistoryBytes = 8, kRestBytes = 8, kSampleBytes = 8, kPairBytes = 12,
                   kNoisyBytes = 4, kResultBytes = 4;

/// Begins saved histories, and changes with the layout of what follows.
constexpr std::array<std::byte, 8> kSavedLayout = {std::byte{'g'}, std::byte{'p'}, std::byte{'u'}, std::byte{'d'},
                                                   std::byte{'n'}, std::byte{'0'}, std::byte{'0'}, std::byte{'2'}};

/// Bytes per pixel that the history's kernel reads and writes.
uint32_t history_bytes(uint32_t flags) {
  uint32_t bytes = 4 + 2 * (kHistoryBytes + kRestBytes) + kSampleBytes; // with the samples
  if ((flags & kHasLimits) != 0) bytes += 4;
  if ((flags & kKeepGuides) != 0) return bytes + kGuideBytes;
  bytes += 20 + kGuideBytes; // depth, normal and instance become a guide
  if ((flags & kFollowMotion) == 0) return bytes;
  return bytes + kGuideBytes + 8 + ((flags & kHasPreviousZ) != 0 ? 4 : 0); // the guide before, and motion
}

/// Pixels of a group. Kernels that read many neighbours have larger ones.
constexpr uint32_t kGroupWidth = 32, kGroupHeight = 8, kTileHeight = 16;
constexpr std::array<uint32_t, 4> kSteps = {1, 2, 4, 1}; // of the filter's passes

uint32_t groups(uint32_t pixels, uint32_t of_group) { return (pixels + of_group - 1) / of_group; }

std::span<const uint32_t> pass_code(uint32_t pass) {
  if (pass == 0) return spirv::denoise_pass_first();
  return kSteps[pass] == 1   ? spirv::denoise_pass_1()
         : kSteps[pass] == 2 ? spirv::denoise_pass_2()
                             : spirv::denoise_pass_4();
}

/// Throws Error(kUnsupported) if the kernels' groups are too large for the device.
void require_limits(const Device& device) {
  constexpr uint32_t kThreads = 1024, kSharedBytes = 32768;
  const VkPhysicalDeviceLimits& limits = device.limits();
  if (limits.maxComputeWorkGroupInvocations < kThreads || limits.maxComputeSharedMemorySize < kSharedBytes)
    throw Error(ErrorKind::kUnsupported,
                "backend gpu: the denoiser needs groups of " + std::to_string(kThreads) + " threads with " +
                    std::to_string(kSharedBytes) + " bytes of shared memory, but " + device.name() + " has " +
                    std::to_string(limits.maxComputeWorkGroupInvocations) + " and " +
                    std::to_string(limits.maxComputeSharedMemorySize) + "; use --backend packed, or --denoiser off");
}

constexpr const char* kPassNames[] = {"pass 1", "pass 2", "pass 3", "pass 4"};

} // namespace

struct DeviceDenoiser::State {
  std::shared_ptr<Device> device;
  uint32_t width = 0, height = 0;
  StagedBuffer view_z, normal, instance, motion, previous_z, limits, ao, result;
  std::array<Past, 2> past;
  uint32_t now = 0; ///< of `past`
  Buffer samples, pair_guides, changes;
  std::array<Buffer, 2> noisy; ///< read and written by the filter's passes in turn
  std::unique_ptr<Kernel> compare, history, correct, guides, variance, finish;
  std::vector<std::unique_ptr<Kernel>> filter_passes;
  Commands commands;
  std::vector<DenoiserDispatch> dispatches; ///< in `commands`

  bool is_here(const DeviceAo* picture) const { return picture != nullptr && picture->device() == device; }
  uint64_t pixels() const { return uint64_t{width} * height; }
  void dispatch(const char* name, Kernel& kernel, const DenoiseRecord& terms, uint32_t tile_height, uint32_t bytes);
  std::vector<DenoiserDispatch> run();
  void release();
  void allocate(uint32_t new_width, uint32_t new_height);
  /// Forgets the commands of a call that threw.
  void forget() { commands = Commands(), dispatches.clear(); }
  void upload(const DenoiseRecord& terms, const DenoiserFrame& frame);
  void find_changes(const DenoiseRecord& terms);
  void bind(Kernel& kernel, std::initializer_list<const Buffer*> buffers) {
    uint32_t binding = 0;
    for (const Buffer* buffer : buffers) kernel.bind(binding++, *buffer);
  }
};

DeviceDenoiser::DeviceDenoiser(const GpuConfig& device, const Passes& passes) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.device = Device::share(device);
  require_limits(*s.device);
  const DeviceTraits& traits = s.device->traits();
  const uint32_t exact = device.arithmetic == GpuArithmetic::kExact || !traits.fused_floats ? 1 : 0,
                 fused = traits.fused_doubles ? 1 : 0;
  /// @param constant of the kernel itself, after those of arithmetic.glsl
  const auto kernel = [&](std::span<const uint32_t> spirv, uint32_t constant, uint32_t bindings) {
    const uint32_t constants[] = {exact, fused, constant};
    return std::make_unique<Kernel>(s.device, spirv, constants, bindings, sizeof(DenoiseRecord));
  };
  s.compare = kernel(spirv::denoise_compare(), 0, 6);
  s.history = kernel(spirv::denoise_history(), passes.normal_squarings, 15);
  s.correct = kernel(spirv::denoise_correct(), passes.window_radius, 3);
  s.guides = kernel(spirv::denoise_guides(), 0, 3);
  s.variance = kernel(spirv::denoise_variance(), 0, 7);
  if (passes.filter_passes == 0) s.finish = kernel(spirv::denoise_finish(), 0, 3);
  for (uint32_t i = 0; i < passes.filter_passes; ++i) s.filter_passes.push_back(kernel(pass_code(i), 0, 5));
}

DeviceDenoiser::~DeviceDenoiser() = default;

void DeviceDenoiser::resize(uint32_t width, uint32_t height) {
  State& s = *state_;
  s.release(); // before the new buffers need its memory
  try {
    s.allocate(width, height);
  } catch (...) {
    s.release();
    throw;
  }
}

void DeviceDenoiser::State::release() {
  width = height = now = 0;
  for (StagedBuffer* buffer : {&view_z, &normal, &instance, &motion, &previous_z, &limits, &ao, &result})
    *buffer = StagedBuffer();
  past = {}, noisy = {};
  for (Buffer* buffer : {&samples, &pair_guides, &changes}) *buffer = Buffer();
}

void DeviceDenoiser::State::allocate(uint32_t new_width, uint32_t new_height) {
  width = new_width, height = new_height;
  const uint64_t n = pixels();
  const auto staged = [&](StagedBuffer& buffer, uint64_t bytes, const char* what) {
    buffer = StagedBuffer(device, bytes, what);
  };
  staged(view_z, 4 * n, "depths"), staged(normal, 12 * n, "normals"), staged(instance, 4 * n, "instances");
  staged(motion, 8 * n, "motion"), staged(previous_z, 4 * n, "previous depths");
  staged(limits, 4 * n, "limits of histories"), staged(ao, 4 * n, "samples");
  staged(result, 3 * kResultBytes * n, "the denoiser's result");
  const auto on_device = [&](Buffer& buffer, uint64_t bytes, const char* what) {
    buffer = Buffer();
    buffer = Buffer(device, bytes, BufferPlace::kDevice, what);
  };
  for (Past& frame : past) {
    on_device(frame.guides, kGuideBytes * n, "guides"), on_device(frame.history, kHistoryBytes * n, "the history");
    on_device(frame.rest, kRestBytes * n, "moments and trends");
  }
  on_device(samples, kSampleBytes * n, "changes of samples"), on_device(pair_guides, kPairBytes * n, "guide weights");
  on_device(changes, 8, "flags");
  for (Buffer& buffer : noisy) on_device(buffer, kNoisyBytes * n, "the filter's values");
}

/// @param bytes DenoiserDispatch::bytes_per_pixel
void DeviceDenoiser::State::dispatch(const char* name, Kernel& kernel, const DenoiseRecord& terms, uint32_t tile_height,
                                     uint32_t bytes) {
  dispatches.push_back({name, 0.0, bytes});
  commands.dispatch(kernel, std::as_bytes(std::span(&terms, 1)), groups(width, kGroupWidth),
                    groups(height, tile_height));
}

/// Runs the commands and forgets them.
std::vector<DenoiserDispatch> DeviceDenoiser::State::run() {
  std::vector<DenoiserDispatch> done = std::exchange(dispatches, {});
  const std::vector<double> ms = device->run(std::exchange(commands, {}));
  done.resize(ms.size());
  for (size_t i = 0; i < ms.size(); ++i) done[i].ms = ms[i];
  return done;
}

/// Uploads what the history's kernel reads.
void DeviceDenoiser::State::upload(const DenoiseRecord& terms, const DenoiserFrame& frame) {
  const DeviceView* here = frame.view_on_device;
  if (here != nullptr && (!here->has_surfaces() || here->device() != device)) here = nullptr;
  /// @param plane of a picture on the device
  const auto take = [&](StagedBuffer& buffer, const auto& channel, uint32_t plane) {
    if (here != nullptr)
      commands.copy(here->planes().device(), buffer.device(), plane * sizeof(float) * pixels(), 0,
                    channel.size_bytes());
    else
      buffer.write(commands, std::as_bytes(channel));
  };
  if ((terms.flags & kKeepGuides) == 0) {
    take(view_z, frame.view_z, kViewZPlane);
    take(normal, frame.normal, kNormalPlane);
    take(instance, frame.instance, kInstancePlane);
  }
  if ((terms.flags & kFollowMotion) != 0) {
    take(motion, frame.motion_px, kMotionPlane);
    take(previous_z, frame.previous_z, kPreviousZPlane);
  }
  limits.write(commands, std::as_bytes(frame.max_history));
  if (frame.ao_on_device == nullptr) {
    ao.write(commands, std::as_bytes(frame.ao));
  } else if (!is_here(frame.ao_on_device)) {
    std::vector<float> values(frame.ao_on_device->pixels()), distances(values.size());
    frame.ao_on_device->read(values, distances);
    ao.write(commands, std::as_bytes(std::span(values)));
  }
}

/// Writes two words: whether something moved in this frame, and whether a guide changed since the pair guides were
/// made.
void DeviceDenoiser::State::find_changes(const DenoiseRecord& terms) {
  const bool first = (terms.flags & kHasHistory) == 0, follows = (terms.flags & kFollowMotion) != 0;
  commands.fill(changes, 0, 1, first ? 1 : 0);
  if (first || (!follows && (terms.flags & kKeepGuides) == 0)) commands.fill(changes, 1, 1, 1);
  if (first || !follows) return;
  bind(*compare,
       {&view_z.device(), &normal.device(), &instance.device(), &motion.device(), &past[now].guides, &changes});
  dispatches.push_back({"compare", 0.0, 0}); // it ends early
  commands.dispatch(*compare, std::as_bytes(std::span(&terms, 1)), std::min(groups(width * height, 256), 1024u), 1);
}

std::vector<DenoiserDispatch> DeviceDenoiser::add(const DenoiseRecord& terms, const DenoiserFrame& frame) {
  State& s = *state_;
  s.forget();
  const uint32_t next = (terms.flags & kFollowMotion) != 0 ? s.now ^ 1 : s.now;
  const Past &before = s.past[s.now], &now = s.past[next];
  s.upload(terms, frame);
  s.find_changes(terms);
  s.bind(*s.history,
         {&s.view_z.device(), &s.normal.device(), &s.instance.device(), &s.motion.device(), &s.previous_z.device(),
          &s.limits.device(), s.is_here(frame.ao_on_device) ? &frame.ao_on_device->values() : &s.ao.device(),
          &s.changes, &before.guides, &now.guides, &before.history, &now.history, &before.rest, &now.rest, &s.samples});
  s.dispatch("history", *s.history, terms, kGroupHeight, history_bytes(terms.flags));
  if ((terms.flags & (kFollowMotion | kKeepGuides)) != 0) { // histories of jittered pixels are plain means
    s.bind(*s.correct, {&s.samples, &now.history, &now.rest});
    s.dispatch("correct", *s.correct, terms, kTileHeight, kSampleBytes);
  }
  std::vector<DenoiserDispatch> times = s.run();
  s.now = next;
  return times;
}

std::vector<DenoiserDispatch> DeviceDenoiser::filter(const DenoiseRecord& terms, const DenoiserResult& result) {
  State& s = *state_;
  s.forget();
  const Past& now = s.past[s.now];
  s.bind(*s.guides, {&now.guides, &s.changes, &s.pair_guides});
  s.dispatch("guides", *s.guides, terms, kTileHeight, kGuideBytes + kPairBytes);
  s.commands.fill(s.changes, 1, 1, 0);
  s.bind(*s.variance,
         {&now.history, &now.rest, &now.guides, &s.pair_guides, &s.changes, &s.noisy[0], &s.result.device()});
  s.dispatch("variance", *s.variance, terms, kGroupHeight,
             kHistoryBytes + kRestBytes + kNoisyBytes + kResultBytes +
                 ((terms.flags & kFollowMotion) != 0 ? 0 : kGuideBytes));
  if (s.finish) {
    s.bind(*s.finish, {&s.noisy[0], &now.history, &s.result.device()});
    s.dispatch("finish", *s.finish, terms, kGroupHeight, kNoisyBytes + kHistoryBytes + 2 * kResultBytes);
  }
  for (size_t i = 0; i < s.filter_passes.size(); ++i) {
    Kernel& pass = *s.filter_passes[i];
    s.bind(pass, {&s.noisy[i % 2], &s.noisy[(i + 1) % 2], &s.pair_guides, &now.history, &s.result.device()});
    DenoiseRecord of_pass = terms;
    const bool last = i + 1 == s.filter_passes.size();
    if (last) of_pass.flags |= kLastPass;
    s.dispatch(kPassNames[i], pass, of_pass, kTileHeight,
               kNoisyBytes + kPairBytes / 3 + (i == 0 || last ? kHistoryBytes : 0) +
                   (last ? 2 * kResultBytes : kNoisyBytes));
  }
  const std::span<float> planes[] = {result.ao, result.variance, result.tspp};
  for (size_t i = 0; i < std::size(planes); ++i)
    if (!planes[i].empty())
      s.commands.copy(s.result.device(), s.result.host(), i * planes[i].size_bytes(), planes[i].size_bytes());
  std::vector<DenoiserDispatch> times = s.run();
  for (size_t i = 0; i < std::size(planes); ++i)
    copy_in_parts(reinterpret_cast<std::byte*>(planes[i].data()), s.result.host().data() + i * planes[i].size_bytes(),
                  planes[i].size_bytes());
  return times;
}

std::vector<std::byte> DeviceDenoiser::save() const {
  const State& s = *state_;
  const Past& now = s.past[s.now];
  const uint64_t n = s.pixels();
  std::vector<std::byte> bytes(kSavedLayout.size() + (kGuideBytes + kHistoryBytes + kRestBytes) * n);
  std::ranges::copy(kSavedLayout, bytes.begin());
  std::span<std::byte> rest = std::span(bytes).subspan(kSavedLayout.size());
  for (const auto& [buffer, size] :
       {std::pair{&now.guides, kGuideBytes}, {&now.history, kHistoryBytes}, {&now.rest, kRestBytes}}) {
    download(s.device, *buffer, 0, rest.first(size * n));
    rest = rest.subspan(size * n);
  }
  return bytes;
}

void DeviceDenoiser::restore(std::span<const std::byte> bytes) {
  State& s = *state_;
  const Past& now = s.past[s.now];
  const uint64_t n = s.pixels();
  if (bytes.size() < kSavedLayout.size() || !std::ranges::equal(bytes.first(kSavedLayout.size()), kSavedLayout))
    throw Error(ErrorKind::kInput,
                "denoiser: the saved history is of another backend or version of packtrace; render the frames again");
  bytes = bytes.subspan(kSavedLayout.size());
  if (bytes.size() != (kGuideBytes + kHistoryBytes + kRestBytes) * n)
    throw Error(ErrorKind::kInput, "denoiser: the saved history has another size");
  for (const auto& [buffer, size] :
       {std::pair{&now.guides, kGuideBytes}, {&now.history, kHistoryBytes}, {&now.rest, kRestBytes}}) {
    update(s.device, *buffer, 0, bytes.first(size * n));
    bytes = bytes.subspan(size * n);
  }
  s.device->fill(s.changes, 1);
}

uint64_t DeviceDenoiser::state_bytes() const {
  return (2 * (kGuideBytes + kHistoryBytes + kRestBytes) + kPairBytes) * state_->pixels();
}

} // namespace packtrace::gpu
