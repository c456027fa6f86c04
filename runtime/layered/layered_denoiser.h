#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "runtime/denoise/denoiser.h"
#include "runtime/frame/mean_layers.h"
#include "runtime/frame/rendered_image.h"
#include "runtime/layered/layered_picture.h"
#include "runtime/layered/picture_overlap.h"

namespace packtrace {

/// How the pictures of a sequence are denoised.
struct LayeredConfig {
  LayeredReading reading;
  DenoiserConfig denoiser;
  bool denoise = true;
  /// All pictures show one view whose camera rays are jittered within their pixels: histories stay in their pixels
  /// (HistorySource::kPixel).
  bool still = false;
  bool stratified = false;  ///< AoFrame::stratified of all pictures
  uint32_t samples = 1;     ///< AoFrame::samples of all pictures; 1 if `still`
  bool view_layers = false; ///< fill the views of RenderedImage
};

/// Why the history restarts at a picture.
enum class HistoryStart : uint8_t {
  kContinued, ///< it has one
  kFirst,     ///< there is no picture before it
  kCut,       ///< requested by the caller
  kNewSize,   ///< the picture before it has another size
  kNewScene,  ///< less than a tenth of its surfaces are in the picture before it (shared_surfaces())
};

/// A denoised picture.
struct LayeredResult {
  explicit LayeredResult(LayeredPicture&& read) : picture(std::move(read)) {}

  LayeredPicture picture;
  RenderedImage image; ///< albedo and shaded are empty without a layer for albedo; LOD layers are empty
  HistoryStart start = HistoryStart::kContinued;
  std::optional<double> shared; ///< shared_surfaces(), where the history could continue
  double mean_history = 0.0;    ///< mean over surfaces of the pictures of history behind them
  double read_s = 0.0, denoise_s = 0.0;
};

/// Denoises pictures of layers from any renderer, one after another.
class LayeredDenoiser {
public:
  /// Throws Error(kUsage) for a configuration out of range.
  LayeredDenoiser(const LayeredConfig& config, const MemoryBudget& budget);

  /// Reads and denoises the next picture. Throws like read_layered_picture().
  /// @param cut discard the history
  /// @return the result, valid until the next call
  const LayeredResult& next(const std::filesystem::path& file, bool cut);

private:
  HistoryStart history_start(bool cut);
  void add_to_history();
  void write_image();
  void write_views(const DenoisedAo* denoised);

  LayeredConfig config_;
  MemoryBudget budget_;
  AoDenoiser denoiser_;
  MeanLayers means_;
  GBuffer guides_;
  std::optional<PictureSurfaces> previous_;
  std::optional<LayeredResult> result_;
};

/// Encodes a copy of the picture's file in which the denoised AO replaces the noisy one, in the channels, the type and
/// the convention of the file. Background keeps its values.
/// @param added further layers; they replace channels of the same name
/// Throws like ExrPicture::encode().
std::vector<std::byte> encode_denoised_copy(const LayeredResult& result, const LayerConventions& conventions,
                                            std::span<const Layer> added);

} // namespace packtrace
