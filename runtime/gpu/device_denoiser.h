#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/gpu/gpu_config.h"
#include "runtime/gpu/records/gpu_records.h"

namespace packtrace::gpu {

class DeviceAo;
class DeviceView;

/// The channels of a frame that the denoiser reads, one entry per pixel, rows top to bottom: GBuffer and AoFrame.
struct DenoiserFrame {
  std::span<const float> view_z;
  std::span<const float> normal; ///< three per pixel
  std::span<const uint32_t> instance;
  std::span<const float> motion_px;   ///< two per pixel
  std::span<const float> previous_z;  ///< may be empty
  std::span<const float> max_history; ///< may be empty
  std::span<const float> ao;
  const DeviceAo* ao_on_device = nullptr;     ///< in place of `ao`
  const DeviceView* view_on_device = nullptr; ///< has the values of all channels above but max_history, if it is set
};

/// Destination of the result, one entry per pixel. Empty spans are not read back.
struct DenoiserResult {
  std::span<float> ao, variance, tspp;
};

/// A completed dispatch.
struct DenoiserDispatch {
  const char* name;
  double ms;                ///< on the device
  uint32_t bytes_per_pixel; ///< that it reads and writes for any image
};

/// The passes of the default denoiser on a device, where its history stays. Not for several threads at once.
class DeviceDenoiser {
public:
  /// Settings that pipelines are specialised for.
  struct Passes {
    uint32_t window_radius;    ///< FluxConfig::window / 2
    uint32_t normal_squarings; ///< of FluxConfig::reprojection_normal_power
    uint32_t filter_passes;    ///< FluxConfig::passes
  };

  /// Shares the device with a scene of the same configuration. Throws as Device::open() does.
  DeviceDenoiser(const GpuConfig& device, const Passes& passes);
  ~DeviceDenoiser();

  /// Discards the history and allocates buffers. Throws Error(kLimitExceeded), and as Buffer does.
  void resize(uint32_t width, uint32_t height);

  /// Adds a frame to the history. Returns its dispatches, or an empty list on CPU devices and devices without
  /// timestamps.
  /// @param terms of the frame; terms.flags have kHasHistory unless the history is to be discarded
  std::vector<DenoiserDispatch> add(const DenoiseRecord& terms, const DenoiserFrame& frame);
  /// Filters a copy of the history.
  /// @param terms of the last frame
  std::vector<DenoiserDispatch> filter(const DenoiseRecord& terms, const DenoiserResult& result);

  /// Guides and history as bytes.
  std::vector<std::byte> save() const;
  /// Throws Error(kInput) unless these are bytes of this size.
  void restore(std::span<const std::byte> bytes);
  /// Bytes on the device that are held between frames, without inputs and results.
  uint64_t state_bytes() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace packtrace::gpu
