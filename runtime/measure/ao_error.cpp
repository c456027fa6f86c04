#include "runtime/measure/ao_error.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "runtime/image/exr.h"
#include "runtime/image/metrics.h"
#include "runtime/measure/histogram.h"

namespace packtrace {
namespace {

nlohmann::json finite(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

} // namespace

AoImage read_ao(const std::filesystem::path& file) {
  AoImage ao{read_exr(file, "ao"), {}};
  ao.valid.reserve(ao.image.data.size());
  for (float& value : ao.image.data) {
    ao.valid.push_back(value >= 0.0f);
    if (value < 0.0f) value = 0.0f;
  }
  return ao;
}

std::vector<float> error_map(const AoImage& test, const AoImage& reference) {
  std::vector<float> errors(test.valid.size());
  for (size_t i = 0; i < errors.size(); ++i)
    errors[i] = test.valid[i] != reference.valid[i] ? 1.0f
                : test.valid[i] != 0                ? std::abs(test.image.data[i] - reference.image.data[i])
                                                    : 0.0f;
  return errors;
}

nlohmann::json ao_error(const AoImage& test, const AoImage& reference) {
  if (test.image.size != reference.image.size || test.image.channels != 1 || reference.image.channels != 1)
    throw Error(ErrorKind::kInput, "the ambient occlusion images to compare differ in size");
  std::vector<uint8_t> both(test.valid.size());
  uint64_t compared = 0, mismatched = 0;
  for (size_t i = 0; i < both.size(); ++i) {
    both[i] = test.valid[i] & reference.valid[i];
    compared += both[i];
    mismatched += test.valid[i] != reference.valid[i];
  }
  nlohmann::json json{{"mae", nullptr},
                      {"rmse", nullptr},
                      {"p99", nullptr},
                      {"psnr_db", nullptr},
                      {"ssim", nullptr},
                      {"flip", nullptr},
                      {"noise_ratio", nullptr},
                      {"mismatched_pixels", mismatched},
                      {"compared_pixels", compared}};
  if (compared == 0) return json;
  const MetricOptions how{both, false};
  json["mae"] = finite(mae(test.image, reference.image, how).value);
  json["rmse"] = finite(rmse(test.image, reference.image, how).value);
  json["p99"] = finite(p99(test.image, reference.image, how).value);
  json["psnr_db"] = finite(psnr(test.image, reference.image, how).value);
  json["flip"] = finite(flip(test.image, reference.image, how).value);
  const ImageSize size = test.image.size;
  try {
    if (std::min(size.width, size.height) >= kSsimWindow)
      json["ssim"] = finite(ssim(test.image, reference.image, how).value);
  } catch (const Error&) { // all pixels with a value lie in the border that SSIM leaves out
  }
  return json;
}

std::vector<ErrorTile> worst_tiles(const std::vector<float>& errors, ImageSize size, uint32_t side, size_t count) {
  std::vector<ErrorTile> tiles;
  for (uint32_t y = 0; y < size.height; y += side)
    for (uint32_t x = 0; x < size.width; x += side) {
      ErrorTile tile{x, y, std::min(side, size.width - x), std::min(side, size.height - y)};
      double sum = 0.0;
      for (uint32_t j = y; j < y + tile.height; ++j)
        for (uint32_t i = x; i < x + tile.width; ++i) {
          const double error = errors[size_t{j} * size.width + i];
          sum += error;
          tile.max = std::max(tile.max, error);
        }
      tile.mae = sum / (static_cast<double>(tile.width) * tile.height);
      if (tile.mae > 0.0) tiles.push_back(tile);
    }
  std::ranges::stable_sort(tiles, [](const ErrorTile& a, const ErrorTile& b) { return a.mae > b.mae; });
  if (tiles.size() > count) tiles.resize(count);
  return tiles;
}

} // namespace packtrace
