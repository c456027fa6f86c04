#include "runtime/layered/layered_picture.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/base/with_file.h"

namespace packtrace {
namespace {

/// Bytes per pixel of the converted layers, the denoiser and the encoded outputs.
constexpr uint64_t kPixelBytes = 420;

using Channels = std::vector<std::vector<float>>;

Channels floats_of(const ExrPicture& file, const std::vector<std::string>& channels) {
  Channels values;
  for (const std::string& channel : channels) values.push_back(file.floats(channel));
  return values;
}

bool is_surface(float depth, float far_depth) { return depth > 0.0f && depth < far_depth; } // false for NaN

/// Turns stored depths into depths along the camera's axis, 0 for background.
void convert_depth(const LayerConventions& conventions, ImageSize size, std::vector<float>& depth,
                   LayerCounts& counts) {
  counts.not_finite_depth =
      static_cast<uint64_t>(std::ranges::count_if(depth, [](float z) { return !std::isfinite(z); }));
  counts.negative_depth = std::ranges::none_of(depth, [](float z) { return z > 0.0f; }) &&
                          std::ranges::any_of(depth, [](float z) { return z < 0.0f; });
  const float sign = counts.negative_depth ? -1.0f : 1.0f;
  const double half_side = std::min(size.width, size.height) * 0.5;
  const double pixel = conventions.ray_distance
                           ? std::tan(*conventions.fov_degrees * std::numbers::pi / 360.0) / half_side
                           : 0.0; // side of a pixel at depth 1
  for (uint32_t y = 0; y < size.height; ++y) {
    const double dy = (y + 0.5 - size.height * 0.5) * pixel;
    for (uint32_t x = 0; x < size.width; ++x) {
      float& z = depth[size_t{y} * size.width + x];
      z *= sign;
      const bool surface = is_surface(z, conventions.far_depth);
      if (!surface) z = 0.0f;
      if (!surface || !conventions.ray_distance) continue;
      const double dx = (x + 0.5 - size.width * 0.5) * pixel;
      z = static_cast<float>(static_cast<double>(z) / std::sqrt(1.0 + dx * dx + dy * dy));
    }
  }
}

void convert_ao(const LayerConventions& conventions, const std::vector<float>& view_z, std::vector<float>& ao,
                LayerCounts& counts) {
  constexpr float kRounding = 1e-3f;
  for (size_t i = 0; i < ao.size(); ++i) {
    const bool surface = view_z[i] > 0.0f;
    const bool finite = std::isfinite(ao[i]);
    // Filters with negative lobes leave small negative values; -1 and the like mean that there is none.
    const bool sample = surface && finite && ao[i] > -0.5f;
    counts.without_sample += surface && !sample;
    counts.not_finite_ao += surface && !finite;
    counts.clamped_ao += sample && ao[i] > 1.0f + kRounding;
    const float value = std::clamp(ao[i], 0.0f, 1.0f);
    ao[i] = !sample ? kInvalidAo : conventions.inverted_ao ? 1.0f - value : value;
  }
}

void convert_normals(const LayerConventions& conventions, const Channels& xyz, GBuffer& g, LayerCounts& counts) {
  g.normal.resize(g.size.pixels());
  for (size_t i = 0; i < g.normal.size(); ++i) {
    Vec3 n(xyz[0][i], xyz[1][i], xyz[2][i]);
    if (conventions.unsigned_normals) n = 2.0f * n - 1.0f;
    const float length = glm::length(n);
    constexpr float kShortest = 1e-3f;
    const bool good = length > kShortest && std::isfinite(length);
    // Unit normals keep their bits, so that rendered layers are denoised as if they had not been written.
    constexpr float kUnit = 1e-3f;
    g.normal[i] = !good ? Vec3(0) : std::abs(length - 1.0f) <= kUnit ? n : n / length;
    counts.without_normal += g.view_z[i] > 0.0f && !good;
  }
}

void convert_motion(const LayerConventions& conventions, const PictureChannels& channels, const Channels& xy,
                    GBuffer& g, LayerCounts& counts) {
  g.motion_px.assign(g.size.pixels(), Vec2(0));
  if (xy.empty()) return;
  const Vec2 scale = conventions.motion_scale.value_or(channels.blender_motion ? Vec2(-1, 1) : Vec2(1, 1));
  for (size_t i = 0; i < g.motion_px.size(); ++i) {
    if (!(g.view_z[i] > 0.0f)) continue;
    g.motion_px[i] = scale * Vec2(xy[0][i], xy[1][i]);
    counts.not_finite_motion += !std::isfinite(g.motion_px[i].x) || !std::isfinite(g.motion_px[i].y);
  }
}

void convert_ids(const ExrPicture& file, const PictureChannels& channels, GBuffer& g) {
  if (channels.has(LayerRole::kId))
    g.instance = file.words(channels.of(LayerRole::kId).front());
  else
    g.instance.assign(g.size.pixels(), 0);
  for (size_t i = 0; i < g.instance.size(); ++i)
    if (!(g.view_z[i] > 0.0f)) g.instance[i] = kNoInstance;
}

/// Converts all layers of a decoded file.
void convert(const LayerConventions& conventions, LayeredPicture& picture) {
  const PictureChannels& channels = picture.channels;
  const ExrPicture& file = picture.file;
  const auto scalars = [&](LayerRole role) { return file.floats(channels.of(role).front()); };
  GBuffer& g = picture.gbuffer;
  g.size = picture.ao.size = file.size();
  g.view_z = scalars(LayerRole::kDepth);
  convert_depth(conventions, g.size, g.view_z, picture.counts);
  picture.counts.surfaces = static_cast<uint64_t>(std::ranges::count_if(g.view_z, [](float z) { return z > 0.0f; }));
  picture.ao.ao = scalars(LayerRole::kAo);
  convert_ao(conventions, g.view_z, picture.ao.ao, picture.counts);
  convert_normals(conventions, floats_of(file, channels.of(LayerRole::kNormal)), g, picture.counts);
  convert_motion(conventions, channels, floats_of(file, channels.of(LayerRole::kMotion)), g, picture.counts);
  convert_ids(file, channels, g);
  if (channels.has(LayerRole::kPreviousDepth)) {
    g.previous_z = scalars(LayerRole::kPreviousDepth);
    for (float& z : g.previous_z)
      if (!is_surface(z, conventions.far_depth)) z = 0.0f;
  }
  picture.has_hit_distance = channels.has(LayerRole::kHitDistance);
  picture.ao.hit_distance =
      picture.has_hit_distance ? scalars(LayerRole::kHitDistance) : std::vector<float>(g.size.pixels());
  if (!channels.has(LayerRole::kAlbedo)) return;
  const Channels rgb = floats_of(file, channels.of(LayerRole::kAlbedo));
  g.albedo.resize(g.size.pixels());
  for (size_t i = 0; i < g.albedo.size(); ++i) g.albedo[i] = Vec3(rgb[0][i], rgb[1][i], rgb[2][i]);
}

std::vector<std::string> channels_to_decode(const ExrInfo& info, const PictureChannels& channels, bool all) {
  std::vector<std::string> names;
  if (all) {
    for (const ExrLayer& layer : info.layers)
      for (const ExrChannel& channel : layer.channels) names.push_back(channel.name);
    return names;
  }
  for (const std::vector<std::string>& role : channels.by_role) names.insert(names.end(), role.begin(), role.end());
  return names;
}

/// Whether `render` has denoised the layer "ao", so that only "ao_raw" has the noise that can be estimated.
bool is_denoised(const ExrInfo& info) {
  const auto found = info.attributes.find(kDenoisedAttribute);
  return found != info.attributes.end() && found->second == ExrAttribute(1);
}

} // namespace

void LayerConventions::validate() const {
  if (fov_degrees && !(*fov_degrees > 0.0 && *fov_degrees < 180.0))
    throw Error(ErrorKind::kUsage, "--fov must be between 0 and 180 degrees");
  if (ray_distance && !fov_degrees)
    throw Error(ErrorKind::kUsage, "--depth-kind distance requires --fov, the camera's field of view in degrees");
  if (!(far_depth > 0.0f)) throw Error(ErrorKind::kUsage, "--far must be above 0");
  if (motion_scale && !(std::isfinite(motion_scale->x) && std::isfinite(motion_scale->y)))
    throw Error(ErrorKind::kUsage, "--motion-scale must be finite");
}

LayeredPicture read_layered_picture(const std::filesystem::path& path, const LayeredReading& reading,
                                    const MemoryBudget& budget) {
  const std::string name = path.string();
  MemoryReservation memory(budget);
  std::error_code unknown; // read_file_bytes() reports the problem
  if (const uint64_t size = std::filesystem::file_size(path, unknown); !unknown)
    with_file(path, [&] { memory.resize(size, "the file"); });
  const std::vector<std::byte> bytes = read_file_bytes(path);
  const ExrInfo info = exr_info(bytes, name);
  const bool raw_ao = reading.raw_ao || is_denoised(info);
  PictureChannels channels = find_picture_channels(info, reading.layers, raw_ao, name);
  const std::vector<std::string> wanted = channels_to_decode(info, channels, reading.all_channels);
  const uint64_t pixel_bytes = kPixelBytes + wanted.size() * 2 * sizeof(float);
  with_file(path, [&] { memory.resize(memory.bytes() + info.size.pixels() * pixel_bytes, "the picture"); });
  LayeredPicture picture{std::move(channels), ExrPicture(bytes, name, wanted), {}, {}, false, {}, std::move(memory)};
  convert(reading.conventions, picture);
  return picture;
}

} // namespace packtrace
