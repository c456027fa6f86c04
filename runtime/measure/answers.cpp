#include "runtime/measure/answers.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "runtime/measure/report.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;

std::string bytes_text(double bytes) {
  if (bytes >= 1e6) return fmt::format("{:.2f} MB", bytes * 1e-6);
  return bytes >= 1e3 ? fmt::format("{:.1f} kB", bytes * 1e-3) : fmt::format("{:.0f} bytes", bytes);
}

double at(const Json& point, const char* path) { return number_at(point, path).value_or(0.0); }
std::string text_at(const Json& point, const char* name) { return point.at(name).get<std::string>(); }

Json figure(const std::string& name, double value, const char* unit) {
  return {{"name", name}, {"value", value}, {"unit", unit}};
}

Json answer(const char* question, std::string text, Json command, Json figures) {
  return {{"question", question},
          {"text", std::move(text)},
          {"command", std::move(command)},
          {"figures", std::move(figures)}};
}

/// The points of a report that are compared on equal terms.
struct Points {
  std::vector<const Json*> all;
  const Json* standard = nullptr;

  explicit Points(const Json& report) {
    const auto spp = report.at("/settings/spp"_json_pointer).get<uint32_t>();
    for (const Json& point : report.at("points")) {
      if (!on_equal_terms(point, spp) || !number_at(point, "ao.mae")) continue;
      all.push_back(&point);
      if (point.at("id") == report.at("default_id")) standard = &point;
    }
  }

  /// The best point within the error; null if there is none.
  const Json* best(double max_error, const char* path, bool largest) const {
    const Json* best = nullptr;
    for (const Json* point : all) {
      if (at(*point, "ao.mae") > max_error) continue;
      if (!best || (largest ? at(*point, path) > at(*best, path) : at(*point, path) < at(*best, path))) best = point;
    }
    return best;
  }

  const Json* find(const std::string& id) const {
    const auto found = std::ranges::find_if(all, [&](const Json* p) { return p->at("id") == id; });
    return found == all.end() ? nullptr : *found;
  }
};

/// A warning for pictures without occlusion, whose error means nothing; otherwise empty. Precedes the answers.
std::string caution(const Json& report) {
  if (at(report.at("reference").at("noise_floor"), "mae") > 0.0) return {};
  return "The pictures show no occlusion, so its error says nothing; choose another --camera. ";
}

Json smallest(const Points& points, double max_error, const std::string& caution) {
  constexpr const char* kQuestion = "What is the smallest file, the fastest or the least memory within my error?";
  const Json* small = points.best(max_error, "bytes.file", false);
  if (!small)
    return answer(kQuestion, fmt::format("No measured point has a mean AO error of at most {:.3g}.", max_error),
                  nullptr, Json::array());
  const Json& fast = *points.best(max_error, "mrays_per_s.ao", true);
  const Json& lean = *points.best(max_error, "resident_bytes", false);
  return answer(
      kQuestion,
      caution +
          fmt::format(
              "Within a mean AO error of {:.3g}, the smallest file has {} ({:.2f} bytes per triangle, error {:.2g}): "
              "{}. The fastest traces {:.1f} million AO rays per second: {}. The least memory while tracing is {}: "
              "{}.",
              max_error, bytes_text(at(*small, "bytes.file")), at(*small, "bytes.per_triangle"), at(*small, "ao.mae"),
              text_at(*small, "label"), at(fast, "mrays_per_s.ao"), text_at(fast, "label"),
              bytes_text(at(lean, "resident_bytes")), text_at(lean, "label")),
      small->at("commands").at("bake"),
      {figure("smallest file", at(*small, "bytes.file"), "bytes"), figure("its AO error", at(*small, "ao.mae"), "MAE"),
       figure("fastest", at(fast, "mrays_per_s.ao"), "Mrays/s"),
       figure("least memory", at(lean, "resident_bytes"), "bytes")});
}

Json loss_by_bits(const Points& points, const Json& report) {
  std::string text;
  Json figures = Json::array();
  std::vector<const Json*> by_bits;
  for (const Json* point : points.all)
    if (point->at("group") == "positions") by_bits.push_back(point);
  for (const Json* point : by_bits) {
    const double bits = at(*point, "knobs.positions.value");
    figures.push_back(figure(fmt::format("{} bits", bits), at(*point, "ao.mae"), "MAE"));
    text += fmt::format("{}{} bits: {:.2g}", text.empty() ? "Mean AO error at " : ", ", bits, at(*point, "ao.mae"));
  }
  if (text.empty()) return answer("What do I lose at N bits, and where?", "Not measured.", nullptr, figures);
  text += ".";
  for (const Json& tile : report.at("tiles"))
    if (tile.at("point_id") != report.at("default_id") && tile.at("geometry").is_string()) {
      text += fmt::format(" The worst place of {} is in {}, around pixel ({}, {}).", text_at(tile, "point_id"),
                          text_at(tile, "geometry"), at(tile, "x") + at(tile, "width") / 2,
                          at(tile, "y") + at(tile, "height") / 2);
      break;
    }
  return answer("What do I lose at N bits, and where?", text, by_bits.front()->at("commands").at("bake"), figures);
}

std::map<std::string, double> streams_of(const Json& point) {
  std::map<std::string, double> streams;
  for (const Json& stream : point.at("/bytes/streams"_json_pointer))
    streams[text_at(stream, "name")] = at(stream, "bytes");
  return streams;
}

Json next_stream(const Points& points, double max_error) {
  constexpr const char* kQuestion = "Which stream is worth cutting next?";
  const Json& standard = *points.standard;
  const double total = at(standard, "bytes.file");
  const Json& streams = standard.at("/bytes/streams"_json_pointer);
  std::string text = "The default file is";
  Json figures = Json::array();
  for (size_t i = 0; i < std::min<size_t>(3, streams.size()); ++i) {
    const double share = 100.0 * at(streams[i], "bytes") / total;
    text += fmt::format("{} {:.0f} % {}", i ? "," : "", share, text_at(streams[i], "name"));
    figures.push_back(figure(text_at(streams[i], "name"), share, "%"));
  }
  const Json* cut = nullptr; // largest saving by one factor that keeps the codec, so that streams are comparable
  for (const Json* point : points.all) {
    if (point->at("group") == "product" || point->at("group") == "codec" || at(*point, "ao.mae") > max_error) continue;
    if (at(*point, "bytes.file") < (cut ? at(*cut, "bytes.file") : total)) cut = point;
  }
  if (!cut) return answer(kQuestion, text + ". No single option makes it smaller within the error.", nullptr, figures);
  const std::map<std::string, double> before = streams_of(standard), after = streams_of(*cut);
  std::pair<std::string, double> most;
  for (const auto& [name, bytes] : before) {
    const auto left = after.find(name);
    const double saved = bytes - (left == after.end() ? 0.0 : left->second);
    if (saved > most.second) most = {name, saved};
  }
  const double saved = total - at(*cut, "bytes.file");
  text +=
      fmt::format(". The largest saving of one option is {} ({}), {} of it in {}: {} instead of the default; the mean "
                  "AO error goes from {:.2g} to {:.2g}.",
                  bytes_text(saved), fmt::format("{:.0f} %", 100.0 * saved / total), bytes_text(most.second),
                  most.first, text_at(*cut, "label"), at(standard, "ao.mae"), at(*cut, "ao.mae"));
  figures.push_back(figure("saved", saved, "bytes"));
  return answer(kQuestion, text, cut->at("commands").at("bake"), figures);
}

Json above_noise(const Points& points, const Json& report) {
  const Json& standard = *points.standard;
  const double error = at(standard, "ao.mae"), ratio = at(standard, "ao.noise_ratio");
  const double noise = at(report.at("reference").at("noise_floor"), "mae");
  const double spp = at(report.at("settings"), "spp");
  std::string text =
      noise > 0.0 ? fmt::format("{}: the default's mean AO error of {:.2g} is {:.2g} times the difference of two float "
                                "images with {} samples per pixel and different seeds ({:.2g}).",
                                ratio > 1.0 ? "Yes" : "No", error, ratio, spp, noise)
      : error > 0.0
          ? fmt::format("Yes: the default's mean AO error is {:.2g}, and there is no noise: two float images with {} "
                        "samples per pixel and different seeds are equal.",
                        error, spp)
          : fmt::format(
                "No: the default has no AO error. There is no noise either: two float images with {} samples per "
                "pixel and different seeds are equal.",
                spp);
  Json figures{figure("error", error, "MAE"), figure("noise", noise, "MAE")};
  if (noise > 0.0) figures.push_back(figure("ratio", ratio, ""));
  size_t above = 0;
  for (const Json* point : points.all) above += at(*point, "ao.mae") > noise;
  text += fmt::format(" {} of {} points are above it.", above, points.all.size());
  if (const Json& curve = report.at("convergence"); !curve.empty()) {
    const Json& last = curve.back();
    text += fmt::format(" After {} denoised frames of 1 sample the error is {:.2g}.", at(last, "frames"),
                        at(last, "denoised.mae"));
    figures.push_back(figure("denoised frames", at(last, "denoised.mae"), "MAE"));
  }
  return answer("Is the error above sampling noise?", text, nullptr, figures);
}

/// Rate of occlusion rays over the default's. Embree's rates beside both points, if measured, cancel what else the
/// machine did.
double relative_speed(const Json& point, const Json& standard) {
  const std::optional<double> ratio = number_at(point, "speed_ratio.ao"), base = number_at(standard, "speed_ratio.ao");
  if (ratio && base && *base > 0.0) return *ratio / *base;
  return at(point, "mrays_per_s.ao") / at(standard, "mrays_per_s.ao");
}

Json costs(const Points& points) {
  const Json& standard = *points.standard;
  std::string text;
  Json figures = Json::array();
  double noise = 0.0; // codecs are decoded to the same bytes
  for (const char* id : {"fast", "small", "trees-off", "lod-all"}) {
    const Json* point = points.find(id);
    if (!point) continue;
    const double bytes = 100.0 * (at(*point, "bytes.file") / at(standard, "bytes.file") - 1.0);
    const double first = at(*point, "seconds.first_ray") - at(standard, "seconds.first_ray");
    const double speed = 100.0 * (relative_speed(*point, standard) - 1.0);
    const std::string label = text_at(*point, "label");
    text += fmt::format("{}{}: {:+.0f} % bytes, {:+.0f} ms until the first ray, {:+.0f} % AO rays per second",
                        text.empty() ? "Against the default, " : "; ", label, bytes, first * 1e3, speed);
    figures.push_back(figure(label + ", bytes", bytes, "%"));
    figures.push_back(figure(label + ", first ray", first, "s"));
    figures.push_back(figure(label + ", AO rays", speed, "%"));
    if (point->at("group") == "codec") noise = std::max(noise, std::abs(speed));
  }
  if (noise > 0.0) {
    text +=
        fmt::format(". All codecs are traced as the same bytes, so rates are uncertain by at least {:.0f} %", noise);
    figures.push_back(figure("uncertainty of rates", noise, "%"));
  }
  return answer("What do codec, trees and levels cost in bytes, loading and rays a second?",
                text.empty() ? "Not measured." : text + ".", nullptr, figures);
}

} // namespace

nlohmann::json answer_questions(const nlohmann::json& report, double max_error) {
  const Points points(report);
  if (!points.standard) return Json::array();
  return {smallest(points, max_error, caution(report)), loss_by_bits(points, report), next_stream(points, max_error),
          above_noise(points, report), costs(points)};
}

} // namespace packtrace
