#include "runtime/measure/html_report.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/output_file.h"
#include "runtime/image/png.h"
#include "runtime/measure/report_page.h"

namespace packtrace {
namespace {

using nlohmann::json;

constexpr int kSignificantDigits = 6;
/// Share of the size that data may take as long as details can be left out; pictures get the rest.
constexpr double kDataShare = 0.6;

std::string base64(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t count = std::min<size_t>(3, bytes.size() - i);
    uint32_t bits = 0;
    for (size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < count ? std::to_integer<uint32_t>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// Value for Content-Security-Policy. @param hash hexadecimal
std::string sha256_source(std::string_view hash) {
  std::vector<std::byte> bytes;
  for (size_t i = 0; i + 1 < hash.size(); i += 2) {
    uint8_t byte = 0;
    std::from_chars(hash.data() + i, hash.data() + i + 2, byte, 16);
    bytes.push_back(std::byte{byte});
  }
  return "'sha256-" + base64(bytes) + "'";
}

/// JSON that may stand in a script element: no character ends it, whatever the strings hold.
std::string script_json(const json& document) {
  const std::string text = document.dump(-1, ' ', false, json::error_handler_t::replace);
  std::string escaped;
  escaped.reserve(text.size() + text.size() / 64);
  for (const char c : text) {
    // These characters occur in strings only.
    if (c == '<' || c == '>' || c == '&')
      fmt::format_to(std::back_inserter(escaped), "\\u{:04x}", static_cast<unsigned>(c));
    else
      escaped += c;
  }
  return escaped;
}

/// Text of an element. Bytes that are not UTF-8 become U+FFFD.
std::string html_text(const std::string& text) {
  const std::string valid =
      json::parse(json(text).dump(-1, ' ', false, json::error_handler_t::replace)).get<std::string>();
  std::string escaped;
  for (const char c : valid) {
    if (c == '<' || c == '>' || c == '&' || c == '"' || c == '\'')
      fmt::format_to(std::back_inserter(escaped), "&#{};", static_cast<unsigned>(c));
    else
      escaped += c;
  }
  return escaped;
}

/// Rounds all floats to what the page can show, which shortens their text.
void round_numbers(json& value) {
  if (value.is_number_float()) {
    const double number = value.get<double>();
    if (std::isfinite(number)) value = std::stod(fmt::format("{:.{}g}", number, kSignificantDigits));
  } else if (value.is_structured()) {
    for (json& element : value) round_numbers(element);
  }
}

json at(const json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && found != object.end() ? *found : json();
}

bool truthy(const json& value) { return value.is_boolean() && value.get<bool>(); }

/// Whether a point is the default or on a Pareto front.
bool on_front(const json& point) {
  const json flags = at(point, "flags");
  return truthy(at(flags, "default")) || !at(flags, "fronts").empty();
}

/// A way to shorten the data. `left_out` describes what the page then lacks.
struct Cut {
  const char* left_out;
  void (*apply)(json& points);
};

void erase_key(json& points, const char* key, bool of_fronts_too) {
  for (json& point : points)
    if (point.is_object() && (of_fronts_too ? !truthy(at(at(point, "flags"), "default")) : !on_front(point)))
      point.erase(key);
}

constexpr std::array<Cut, 5> kCuts{{
    {"worst geometries of points that are on no front", [](json& p) { erase_key(p, "worst_geometries", false); }},
    {"histograms of points that are on no front", [](json& p) { erase_key(p, "histograms", false); }},
    {"worst geometries of all points but the default", [](json& p) { erase_key(p, "worst_geometries", true); }},
    {"histograms of all points but the default", [](json& p) { erase_key(p, "histograms", true); }},
    {"points that are on no front",
     [](json& p) {
       json kept = json::array();
       std::ranges::copy_if(p, std::back_inserter(kept), on_front);
       p = std::move(kept);
     }},
}};

/// Shortens the points until the text has at most `max_bytes`, if that suffices. Returns what was left out.
std::vector<std::string> cut_data(json& document, size_t max_bytes) {
  std::vector<std::string> left_out;
  if (!at(document, "points").is_array()) return left_out;
  for (const Cut& cut : kCuts) {
    if (script_json(document).size() <= max_bytes) break;
    cut.apply(document["points"]);
    left_out.emplace_back(cut.left_out);
  }
  return left_out;
}

/// Paths of all pictures, the most important first: the first whole picture, the worst tiles, the other pictures.
std::vector<std::string> picture_paths(const json& report) {
  std::vector<std::string> paths;
  std::set<std::string> seen;
  const auto add = [&](const json& picture) {
    for (const char* key : {"float", "packed", "difference"})
      if (const json path = at(picture, key); path.is_string() && seen.insert(path.get<std::string>()).second)
        paths.push_back(path.get<std::string>());
  };
  const json pictures = at(report, "pictures"), tiles = at(report, "tiles");
  if (pictures.is_array() && !pictures.empty()) add(pictures.front());
  if (tiles.is_array()) std::ranges::for_each(tiles, add);
  if (pictures.is_array()) std::ranges::for_each(pictures, add);
  return paths;
}

std::optional<std::vector<std::byte>> read_picture(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
  if (!file || !bytes.starts_with(kSignature)) return std::nullopt;
  const auto data = std::as_bytes(std::span(bytes));
  return std::vector<std::byte>(data.begin(), data.end());
}

/// Averages blocks of 2^halvings pixels squared; partial blocks at the right and bottom average their pixels. Pictures
/// are averaged as they are encoded, which suffices for previews. Returns the bytes unchanged if they do not shrink.
std::vector<std::byte> reduced_png(const std::vector<std::byte>& bytes, const std::string& name, uint32_t halvings) {
  const Image image = decode_png(bytes, name, PngTransfer::kRaw);
  const uint32_t block = 1u << halvings;
  Image smaller({(image.size.width + block - 1) / block, (image.size.height + block - 1) / block}, image.channels);
  for (uint32_t y = 0; y < smaller.size.height; ++y)
    for (uint32_t x = 0; x < smaller.size.width; ++x) {
      float count = 0.0f;
      for (uint32_t v = y * block; v < std::min(image.size.height, (y + 1) * block); ++v)
        for (uint32_t u = x * block; u < std::min(image.size.width, (x + 1) * block); ++u, ++count)
          for (uint32_t c = 0; c < image.channels; ++c) smaller.pixel(x, y)[c] += image.pixel(u, v)[c];
      for (float& sample : smaller.pixel(x, y)) sample /= count;
    }
  std::vector<std::byte> encoded = encode_png(smaller, PngTransfer::kRaw);
  return encoded.size() < bytes.size() ? std::move(encoded) : bytes;
}

struct Pictures {
  json uris = json::object(); ///< data: URI of each path
  size_t bytes = 0;           ///< of the JSON text, roughly
  uint32_t halvings = 0;
  std::vector<std::string> missing; ///< paths that do not fit, cannot be read, or are no PNG files
};

Pictures load_pictures(const std::vector<std::string>& paths, const std::filesystem::path& folder, uint32_t halvings) {
  Pictures pictures;
  pictures.halvings = halvings;
  for (const std::string& path : paths) {
    std::optional<std::vector<std::byte>> bytes = read_picture(folder / path);
    try {
      if (bytes && halvings > 0) bytes = reduced_png(*bytes, path, halvings);
    } catch (const Error&) {
      bytes.reset(); // a damaged file
    }
    if (!bytes) {
      pictures.missing.push_back(path);
      continue;
    }
    std::string uri = "data:image/png;base64," + base64(*bytes);
    pictures.bytes += uri.size() + 2 * path.size() + 8;
    pictures.uris[path] = std::move(uri);
  }
  return pictures;
}

/// Pictures of at most `max_bytes`, reduced or left out as needed.
Pictures fit_pictures(const std::vector<std::string>& paths, const std::filesystem::path& folder, size_t max_bytes) {
  Pictures pictures;
  for (const uint32_t halvings : {0u, 1u, 2u}) {
    pictures = load_pictures(paths, folder, halvings);
    if (pictures.bytes <= max_bytes) return pictures;
  }
  for (size_t i = paths.size(); i-- > 0 && pictures.bytes > max_bytes;) {
    const auto found = pictures.uris.find(paths[i]);
    if (found == pictures.uris.end()) continue;
    pictures.bytes -= std::min(pictures.bytes, found->get_ref<const std::string&>().size() + 2 * paths[i].size() + 8);
    pictures.uris.erase(found);
    pictures.missing.push_back(paths[i]);
  }
  return pictures;
}

/// Replaces {{name}} by its value. Values are not searched for placeholders.
std::string fill(std::string_view page, const std::map<std::string_view, std::string_view>& values) {
  std::string filled;
  while (!page.empty()) {
    const size_t begin = page.find("{{"), end = page.find("}}", begin);
    filled += page.substr(0, begin);
    if (begin == page.npos || end == page.npos) break;
    filled += values.at(page.substr(begin + 2, end - begin - 2));
    page.remove_prefix(end + 2);
  }
  return filled;
}

std::string page_with(const json& document) {
  namespace page = report_page;
  const json name = at(at(document, "scene"), "name");
  const std::string title = html_text(name.is_string() ? name.get<std::string>() : "scene"),
                    style_source = sha256_source(page::kStyleSha256),
                    script_source = sha256_source(page::kScriptSha256), data = script_json(document);
  return fill(page::kTemplate, {{"title", title},
                                {"style_source", style_source},
                                {"script_source", script_source},
                                {"style", page::kStyle},
                                {"script", page::kScript},
                                {"data", data}});
}

} // namespace

std::string html_report(const json& report, const std::filesystem::path& folder, size_t max_bytes) {
  json document = report;
  round_numbers(document);
  const size_t page_bytes = page_with(json::object()).size() + 1000; // and the text about missing parts
  const size_t data_bytes = max_bytes > page_bytes ? max_bytes - page_bytes : 0;
  const std::vector<std::string> left_out =
      cut_data(document, static_cast<size_t>(static_cast<double>(data_bytes) * kDataShare));

  const size_t used = page_bytes + script_json(document).size();
  const Pictures pictures = fit_pictures(picture_paths(report), folder, max_bytes > used ? max_bytes - used : 0);
  document["embedded"] = {{"pictures", pictures.uris},
                          {"pictures_missing", pictures.missing.size()},
                          {"picture_scale", 1.0 / (1u << pictures.halvings)},
                          {"data_left_out", left_out},
                          {"max_bytes", max_bytes}};
  std::string page = page_with(document);
  if (page.size() > max_bytes)
    throw Error(ErrorKind::kLimitExceeded,
                fmt::format("report.html: {} bytes exceed the limit of {}", page.size(), max_bytes));
  return page;
}

void write_html_report(const json& report_json, const std::filesystem::path& pictures,
                       const std::filesystem::path& out) {
  OutputFile file(out, true);
  const std::string text = html_report(report_json, pictures);
  file.write(std::as_bytes(std::span(text)));
  file.commit();
}

} // namespace packtrace
