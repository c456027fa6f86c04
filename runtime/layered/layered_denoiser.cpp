#include "runtime/layered/layered_denoiser.h"

#include <algorithm>
#include <utility>

#include "runtime/frame/view_layers.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

/// Below this fraction of shared surfaces two pictures are of different views.
constexpr double kMinShared = 0.1;

/// The channels that hold the same occlusion: all colours of the layer.
std::vector<std::string> equal_channels(const ExrPicture& file, const std::string& channel) {
  std::vector<std::string> found{channel};
  const std::string layer = channel.substr(0, channel.size() - 1);
  const bool colour = channel.back() == 'R' && (layer.empty() || layer.back() == '.');
  for (const char* const other : {"G", "B"})
    if (colour && file.type(layer + other)) found.push_back(layer + other);
  return found;
}

} // namespace

LayeredDenoiser::LayeredDenoiser(const LayeredConfig& config, const MemoryBudget& budget)
    : config_(config), budget_(budget), denoiser_(config.denoiser) {
  config_.reading.conventions.validate();
}

const LayeredResult& LayeredDenoiser::next(const std::filesystem::path& file, bool cut) {
  result_.reset(); // frees its memory first
  const Stopwatch reading;
  result_.emplace(read_layered_picture(file, config_.reading, budget_));
  result_->read_s = reading.seconds();
  const Stopwatch denoising;
  result_->start = history_start(cut);
  if (result_->start != HistoryStart::kContinued) denoiser_.reset(), means_.clear();
  add_to_history();
  write_image();
  const GBuffer& g = result_->picture.gbuffer;
  previous_ = PictureSurfaces{g.size, g.view_z, g.normal};
  result_->denoise_s = denoising.seconds();
  return *result_;
}

HistoryStart LayeredDenoiser::history_start(bool cut) {
  const GBuffer& g = result_->picture.gbuffer;
  if (!previous_) return HistoryStart::kFirst;
  if (previous_->size != g.size) return HistoryStart::kNewSize;
  if (cut) return HistoryStart::kCut;
  result_->shared = shared_surfaces(*previous_, g);
  return *result_->shared < kMinShared && result_->picture.counts.surfaces > 0 ? HistoryStart::kNewScene
                                                                               : HistoryStart::kContinued;
}

void LayeredDenoiser::add_to_history() {
  LayeredPicture& picture = result_->picture;
  if (!config_.denoise) return;
  picture.ao.stratified = config_.stratified, picture.ao.samples = config_.samples;
  if (!config_.still) {
    denoiser_.add_frame(picture.gbuffer, picture.ao);
    return;
  }
  GBuffer& g = picture.gbuffer;
  std::ranges::fill(g.motion_px, Vec2(0));
  g.previous_z.clear();
  means_.add(g, {});
  means_.keep(g);
  if (result_->start != HistoryStart::kContinued) {
    denoiser_.add_frame(g, picture.ao);
    return;
  }
  means_.write_guides(g, guides_);
  denoiser_.add_frame(guides_, picture.ao, HistorySource::kPixel);
}

void LayeredDenoiser::write_image() {
  const LayeredPicture& picture = result_->picture;
  const GBuffer& g = picture.gbuffer;
  RenderedImage& image = result_->image;
  image.size = g.size;
  image.ao_raw = picture.ao.ao;
  image.depth = g.view_z, image.normal = g.normal, image.instance = g.instance;
  image.ao = image.ao_raw;
  const DenoisedAo* result = nullptr;
  if (config_.denoise) {
    const DenoisedAo& denoised = denoiser_.denoise();
    result = &denoised;
    image.ao = denoised.ao;
    double frames = 0.0;
    uint64_t surfaces = 0;
    for (size_t i = 0; i < denoised.ao.size(); ++i)
      if (denoised.ao[i] >= 0.0f) frames += static_cast<double>(denoised.tspp[i]), ++surfaces;
    result_->mean_history = surfaces > 0 ? frames / static_cast<double>(surfaces) : 0.0;
  }
  if (config_.view_layers) write_views(result);
  image.coverage.resize(image.ao.size());
  std::ranges::transform(image.ao, image.coverage.begin(), [](float ao) { return ao >= 0.0f ? 1.0f : 0.0f; });
  if (!picture.channels.has(LayerRole::kAlbedo)) return;
  image.albedo = g.albedo;
  image.shaded.resize(g.albedo.size());
  for (size_t i = 0; i < g.albedo.size(); ++i) image.shaded[i] = g.albedo[i] * std::max(image.ao[i], 0.0f);
}

void LayeredDenoiser::write_views(const DenoisedAo* denoised) {
  RenderedImage& image = result_->image;
  const GBuffer& g = result_->picture.gbuffer;
  image.motion = g.motion_px;
  image.previous_depth = g.previous_z.empty() ? g.view_z : g.previous_z;
  image.hit_distance = result_->picture.ao.hit_distance;
  image.local_variance = local_variance(result_->picture.ao);
  if (denoised == nullptr) return;
  image.variance = denoised->variance, image.history = denoised->tspp;
  image.disocclusion.resize(image.history.size());
  std::ranges::transform(image.history, image.ao, image.disocclusion.begin(),
                         [](float frames, float ao) { return ao >= 0.0f && frames <= 1.0f ? 1.0f : 0.0f; });
}

std::vector<std::byte> encode_denoised_copy(const LayeredResult& result, const LayerConventions& conventions,
                                            std::span<const Layer> added) {
  const ExrPicture& file = result.picture.file;
  const std::string& channel = result.picture.channels.of(LayerRole::kAo).front();
  std::vector<float> ao = file.floats(channel);
  for (size_t i = 0; i < ao.size(); ++i)
    if (const float denoised = result.image.ao[i]; denoised >= 0.0f)
      ao[i] = conventions.inverted_ao ? 1.0f - denoised : denoised;
  std::vector<Layer> layers;
  for (const std::string& name : equal_channels(file, channel))
    layers.push_back({name, {""}, std::span<const float>(ao), file.type(name) == ExrType::kHalf});
  layers.insert(layers.end(), added.begin(), added.end());
  return file.encode(layers);
}

} // namespace packtrace
