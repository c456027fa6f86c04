#include "runtime/commands/denoise/denoise_report.h"

#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/render/denoiser_options.h"
#include "runtime/commands/render/render_report.h"

namespace packtrace {
namespace {

/// Number of pictures up to which denoise_json() lists each.
constexpr size_t kMaxListed = 10'000;

/// By HistoryStart.
constexpr std::array<const char*, 5> kStarts{"none", "first", "cut", "new_size", "new_scene"};

nlohmann::json channels_json(const PictureChannels& channels) {
  nlohmann::json json = nlohmann::json::object();
  for (size_t i = 0; i < kLayerRoleCount; ++i) json[layer_roles()[i].name] = channels.by_role[i];
  return json;
}

nlohmann::json row_json(const DenoisedRow& row) {
  const LayerCounts& c = row.counts;
  return {{"picture", row.input.number},
          {"input", row.input.file},
          {"width", row.size.width},
          {"height", row.size.height},
          {"surfaces", c.surfaces},
          {"without_sample", c.without_sample},
          {"not_finite", {{"ao", c.not_finite_ao}, {"depth", c.not_finite_depth}, {"motion", c.not_finite_motion}}},
          {"without_normal", c.without_normal},
          {"above_1", c.clamped_ao},
          {"history_start",
           row.start == HistoryStart::kContinued ? nlohmann::json() : kStarts[static_cast<size_t>(row.start)]},
          {"shared", row.shared ? nlohmann::json(*row.shared) : nlohmann::json()},
          {"history", row.mean_history},
          {"mean_ao", row.mean_ao},
          {"seconds", {{"read", row.read_s}, {"denoise", row.denoise_s}, {"write", row.write_s}}}};
}

} // namespace

DenoisedRow::DenoisedRow(const NumberedInput& picture, const LayeredResult& result)
    : input(picture), size(result.image.size), channels(result.picture.channels), counts(result.picture.counts),
      start(result.start), shared(result.shared), mean_history(result.mean_history),
      mean_ao(mean_of_valid(result.image.ao)), read_s(result.read_s), denoise_s(result.denoise_s) {}

nlohmann::json denoise_json(const std::vector<DenoisedRow>& rows, const LayeredConfig& config,
                            const std::vector<std::string>& files) {
  nlohmann::json list = nlohmann::json::array();
  double read_s = 0.0, denoise_s = 0.0, write_s = 0.0;
  uint64_t starts = 0;
  for (const DenoisedRow& row : rows) {
    if (list.size() < kMaxListed) list.push_back(row_json(row));
    read_s += row.read_s, denoise_s += row.denoise_s, write_s += row.write_s;
    starts += row.start != HistoryStart::kContinued;
  }
  const DenoisedRow& last = rows.back();
  return {{"verb", "denoise"},
          {"input", rows.front().input.file},
          {"files", files},
          {"pictures", rows.size()},
          {"width", last.size.width},
          {"height", last.size.height},
          {"denoiser", denoiser_json(config.denoise, config.denoiser)},
          {"still", config.still},
          {"stratified", config.stratified},
          {"samples", config.samples},
          {"channels", channels_json(last.channels)},
          {"shots", starts},
          {"history", last.mean_history},
          {"mean_ao", last.mean_ao},
          {"seconds", {{"read", read_s}, {"denoise", denoise_s}, {"write", write_s}}},
          {"peak_rss_bytes", peak_rss_bytes()},
          {"list", list}};
}

std::string denoise_text(const nlohmann::json& r, bool details) {
  const auto pictures = r.at("pictures").get<uint64_t>();
  std::string text =
      fmt::format("{}x{} pixels, {} picture{}, mean ao {:.4f}, {:.1f} pictures of history in the last\n",
                  r.at("width").get<int>(), r.at("height").get<int>(), pictures, pictures == 1 ? "" : "s",
                  r.at("mean_ao").get<double>(), r.at("history").get<double>());
  for (const auto& [name, channels] : r.at("channels").items()) {
    if (!details) break;
    std::string joined;
    for (const auto& channel : channels) joined += (joined.empty() ? "" : ", ") + channel.get<std::string>();
    text += fmt::format("  {:<16}{}\n", name, joined.empty() ? "-" : joined);
  }
  for (const char* const name : {"read", "denoise", "write"}) {
    const double seconds = r.at("seconds").at(name).get<double>();
    text += fmt::format("  {:<9} {:8.3f} s   {:.1f} ms per picture\n", name, seconds,
                        seconds * 1e3 / static_cast<double>(pictures));
  }
  return text;
}

std::vector<std::string> picture_warnings(const DenoisedRow& row, bool sequence, bool still) {
  const LayerCounts& c = row.counts;
  std::vector<std::string> warnings;
  const auto count = [&](uint64_t pixels, const char* what) {
    if (pixels > 0) warnings.push_back(fmt::format("{} pixel{} {}", pixels, pixels == 1 ? "" : "s", what));
  };
  if (c.surfaces == 0) warnings.push_back("all depths are background");
  count(c.not_finite_ao, "without a sample: the occlusion is not finite");
  count(c.clamped_ao, "with occlusion above 1, taken as 1");
  count(c.without_normal, "without a normal, not denoised");
  count(c.not_finite_motion, "without history: the motion is not finite");
  if (c.negative_depth) warnings.push_back("depths are negative; their signs were changed");
  if (row.start == HistoryStart::kNewSize)
    warnings.push_back("another size than the picture before; history begins anew");
  if (row.start == HistoryStart::kNewScene)
    warnings.push_back("hardly anything of it was in the picture before; history begins anew");
  if (sequence && !still && row.start == HistoryStart::kFirst && !row.channels.has(LayerRole::kMotion))
    warnings.push_back("there is no layer for motion (--motion), so only surfaces that keep their pixels have history");
  return warnings;
}

} // namespace packtrace
