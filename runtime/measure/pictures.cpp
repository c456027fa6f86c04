#include "runtime/measure/pictures.h"

#include <algorithm>
#include <span>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/output_file.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/image/false_color.h"
#include "runtime/image/png.h"

namespace packtrace {
namespace {

constexpr uint32_t kEnlarged = 4; ///< pixels of a crop per pixel of the picture
constexpr size_t kTilesPerPoint = 6;

/// Display values of an AO image; pixels without a value are light blue, which no occlusion is.
Image display(const AoImage& ao) {
  Image picture(ao.image.size, 3);
  for (size_t i = 0; i < ao.valid.size(); ++i) {
    const float grey = srgb_from_linear(ao.image.data[i]);
    const Vec3 color = ao.valid[i] ? Vec3(grey) : Vec3(0.80f, 0.87f, 0.93f);
    for (size_t c = 0; c < 3; ++c) picture.data[3 * i + c] = color[static_cast<int>(c)];
  }
  return picture;
}

Image crop(const Image& picture, const ErrorTile& tile) {
  Image enlarged({tile.width * kEnlarged, tile.height * kEnlarged}, picture.channels);
  for (uint32_t y = 0; y < enlarged.size.height; ++y)
    for (uint32_t x = 0; x < enlarged.size.width; ++x)
      std::ranges::copy(picture.pixel(tile.x + x / kEnlarged, tile.y + y / kEnlarged), enlarged.pixel(x, y).begin());
  return enlarged;
}

/// Writes a picture and returns its path relative to the folder.
std::string write(const MeasureFolder& folder, const std::string& name, const Image& picture) {
  const std::string path = "pictures/" + name + ".png";
  OutputFile output(folder / path, true);
  output.write(encode_png(picture, PngTransfer::kRaw));
  output.commit();
  return path;
}

/// The instance that the float picture shows at the pixel of a tile with the largest error, of those that show one;
/// kNoInstance if none does.
uint32_t worst_instance(const ErrorTile& tile, const std::vector<float>& errors, const std::vector<uint32_t>& instances,
                        uint32_t width) {
  uint32_t worst = kNoInstance;
  float largest = -1.0f;
  for (uint32_t y = tile.y; y < tile.y + tile.height; ++y)
    for (uint32_t x = tile.x; x < tile.x + tile.width; ++x) {
      const size_t pixel = size_t{y} * width + x;
      if (instances[pixel] != kNoInstance && errors[pixel] > largest) largest = errors[pixel], worst = instances[pixel];
    }
  return worst;
}

/// A round number above which at most one pixel in a hundred of those with an error lies.
float white_of(const std::vector<float>& errors) {
  std::vector<float> positive;
  std::ranges::copy_if(errors, std::back_inserter(positive), [](float e) { return e > 0.0f; });
  if (positive.empty()) return 0.01f;
  const auto rank = positive.begin() + static_cast<std::ptrdiff_t>((positive.size() - 1) * 99 / 100);
  std::ranges::nth_element(positive, rank);
  for (const float white : {0.001f, 0.002f, 0.005f, 0.01f, 0.02f, 0.05f, 0.1f, 0.2f, 0.5f})
    if (*rank <= white) return white;
  return 1.0f;
}

} // namespace

nlohmann::json write_pictures(const std::vector<PicturedPoint>& points, const AoImage& reference,
                              const std::vector<uint32_t>& instances, const std::vector<std::string>& instance_names,
                              uint32_t tile_px, const MeasureFolder& folder) {
  using Json = nlohmann::json;
  Json pictures = Json::array(), tiles = Json::array();
  const Image float_picture = display(reference);
  const std::string float_path = write(folder, "float", float_picture);
  const ImageSize size = reference.image.size;
  for (const PicturedPoint& point : points) {
    const std::vector<float> errors = error_map(point.ao, reference);
    const float white = white_of(errors);
    const Image packed = display(point.ao), heat = heat_map(size, errors, white);
    pictures.push_back({{"id", point.id},
                        {"title", point.title},
                        {"width", size.width},
                        {"height", size.height},
                        {"float", float_path},
                        {"packed", write(folder, point.id, packed)},
                        {"difference", write(folder, point.id + "_difference", heat)},
                        {"difference_white", static_cast<double>(white)}});
    size_t number = 0;
    for (const ErrorTile& tile : worst_tiles(errors, size, tile_px, kTilesPerPoint)) {
      const std::string name = fmt::format("{}_tile{}", point.id, number++);
      const uint32_t instance = worst_instance(tile, errors, instances, size.width);
      tiles.push_back({{"point_id", point.id},
                       {"x", tile.x},
                       {"y", tile.y},
                       {"width", tile.width},
                       {"height", tile.height},
                       {"mae", tile.mae},
                       {"max", tile.max},
                       {"geometry", instance < instance_names.size() ? Json(instance_names[instance]) : Json()},
                       {"float", write(folder, name + "_float", crop(float_picture, tile))},
                       {"packed", write(folder, name + "_packed", crop(packed, tile))},
                       {"difference", write(folder, name + "_difference", crop(heat, tile))}});
    }
  }
  return {{"pictures", pictures}, {"tiles", tiles}};
}

} // namespace packtrace
