#include "runtime/measure/knobs.h"

#include <array>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace packtrace {
namespace {

constexpr std::array<const char*, 5> kGridOptions{"", "--position-bits", "--grid-step", "--grid-step-abs",
                                                  "--grid-step-edge"};
constexpr std::array<const char*, 5> kGridNames{"default", "bits", "relative", "absolute", "edge"};

void add(Words& words, const char* option, const std::string& value, std::string_view otherwise) {
  if (value != otherwise) words.insert(words.end(), {option, value});
}

std::string quoted(const std::string& word) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=:,+@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string result = "'";
  for (const char c : word) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

} // namespace

std::string number_text(double value) { return fmt::format("{}", value); }

Words words_of(const BakeKnobs& knobs) {
  Words words;
  if (knobs.grid != GridKind::kDefault)
    words = {kGridOptions[static_cast<size_t>(knobs.grid)], number_text(knobs.grid_value)};
  add(words, "--normals", knobs.normals, "auto");
  if (knobs.normal_error) words.insert(words.end(), {"--normal-error", number_text(*knobs.normal_error)});
  add(words, "--for", knobs.purpose, "ao");
  add(words, "--uvs", knobs.uvs, "auto");
  add(words, "--textures", knobs.textures, "");
  add(words, "--lod", knobs.lod, "off");
  add(words, "--trees", knobs.trees, "on");
  add(words, "--codec", knobs.codec, "none");
  return words;
}

Words words_of(const RenderKnobs& knobs) {
  Words words{"--frames", std::to_string(knobs.frames), "--spp", std::to_string(knobs.spp)};
  if (!knobs.denoise) words.emplace_back("--no-denoise");
  if (knobs.lod_error_px) words.insert(words.end(), {"--lod-error", number_text(*knobs.lod_error_px)});
  add(words, "--backend", knobs.backend, "packed");
  add(words, "--ao-resolution", knobs.ao_resolution, "full");
  return words;
}

nlohmann::json to_json(const BakeKnobs& bake, const RenderKnobs& render) {
  using Json = nlohmann::json;
  return {{"positions",
           {{"kind", kGridNames[static_cast<size_t>(bake.grid)]},
            {"value", bake.grid == GridKind::kDefault ? Json() : Json(bake.grid_value)}}},
          {"normals", bake.normals},
          {"normal_error_degrees", bake.normal_error ? Json(*bake.normal_error) : Json()},
          {"uvs", bake.uvs},
          {"textures", bake.textures.empty() ? (bake.purpose == "shading" ? "auto" : "none") : bake.textures},
          {"codec", bake.codec},
          {"trees", bake.trees},
          {"lod", bake.lod},
          {"purpose", bake.purpose},
          {"spp", render.spp},
          {"frames", render.frames},
          {"denoise", render.denoise},
          {"lod_error_px", render.lod_error_px ? Json(*render.lod_error_px) : Json()},
          {"backend", render.backend},
          {"ao_resolution", render.ao_resolution}};
}

std::string shell_command(const Words& words) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : " ") + quoted(word);
  return line;
}

} // namespace packtrace
