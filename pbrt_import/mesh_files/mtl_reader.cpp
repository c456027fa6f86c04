#include "pbrt_import/mesh_files/mtl_reader.h"

#include <algorithm>
#include <cmath>
#include <system_error>

#include "pbrt_import/mesh_files/text_lines.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

/// Reads the statements of one file.
class MtlReader {
public:
  MtlReader(std::string_view text, uint32_t file, const std::filesystem::path& folder, Reporter& reporter)
      : lines_(text), file_(file), folder_(folder), reporter_(reporter) {}

  std::vector<MtlMaterial> read() {
    while (lines_.next()) {
      reporter_.next_directive();
      read_statement(lines_.word().text);
    }
    return std::move(materials_);
  }

private:
  Place place(uint32_t column = 1) const { return {file_, lines_.number(), column}; }

  void read_statement(std::string_view keyword) {
    if (keyword == "newmtl") return begin_material();
    if (materials_.empty())
      return reporter_.error(place(), in_quotes(keyword) + " before the first newmtl; it is ignored");
    MtlMaterial& material = materials_.back();
    if (keyword == "Kd") return read_colour("Kd", [&](Vec3 colour) { material.diffuse = colour; });
    if (keyword == "Ks") return read_colour("Ks", [&](Vec3 colour) { material.specular = colour; });
    if (keyword == "Ke") return read_colour("Ke", [&](Vec3 colour) { material.emission = colour; });
    if (keyword == "Ns") return read_number("Ns", [&](float value) { material.shininess = std::max(value, 0.0f); });
    if (keyword == "d") return read_number("d", [&](float value) { material.opacity = value; });
    if (keyword == "Tr") return read_number("Tr", [&](float value) { material.opacity = 1.0f - value; });
    if (keyword == "Ni") return read_number("Ni", [&](float value) { material.refraction = value; });
    if (keyword == "Pr") return read_number("Pr", [&](float value) { material.roughness = value; });
    if (keyword == "Pm") return read_number("Pm", [&](float value) { material.metallic = value; });
    if (keyword == "illum")
      return read_number("illum", [&](float value) { material.illumination = static_cast<int>(value); });
    if (keyword == "map_Kd") return read_map(material.diffuse_map);
    if (keyword == "map_d") return read_map(material.opacity_map);
    if (keyword == "map_Bump" || keyword == "map_bump" || keyword == "bump" || keyword == "norm")
      return read_map(material.normal_map);
    for (const std::string_view meaningless : {"Ka", "map_Ka", "sharpness", "map_aat"}) // of ambient light and filters
      if (keyword == meaningless) return;
    reporter_.warning(place(), in_quotes(keyword) + " is left out");
  }

  void begin_material() {
    MtlMaterial& material = materials_.emplace_back();
    material.place = place();
    material.name = lines_.rest();
    if (material.name.empty()) reporter_.error(place(), "newmtl without a name");
  }

  template <class Set>
  void read_number(std::string_view keyword, const Set& set) {
    if (keyword == "d") {
      const LineWord halo = read_option();
      if (!halo.text.empty() && halo.text != "-halo")
        return reporter_.error(place(halo.column), "unknown option " + in_quotes(halo.text) + " of d; it is ignored");
    }
    const std::optional<float> value = lines_.number_word();
    if (!value || !std::isfinite(*value) || std::abs(*value) > 1e9f)
      return reporter_.error(place(), std::string(keyword) + " takes a number; it is ignored");
    set(*value);
  }

  template <class Set>
  void read_colour(std::string_view keyword, const Set& set) {
    const std::optional<float> red = lines_.number_word();
    if (!red) {
      const std::string_view kind = lines_.word().text;
      if (kind == "spectral" || kind == "xyz")
        return reporter_.warning(place(), std::string(keyword) + " " + std::string(kind) +
                                              " is not supported; the default is used");
      return reporter_.error(place(), std::string(keyword) + " takes numbers; it is ignored");
    }
    const std::optional<float> green = lines_.number_word(), blue = green ? lines_.number_word() : std::nullopt;
    const Vec3 colour = blue ? Vec3(*red, *green, *blue) : Vec3(*red);
    if ((green && !blue) || !is_finite(colour) || glm::any(glm::lessThan(colour, Vec3(0.0f))))
      return reporter_.error(place(), std::string(keyword) + " takes one or three numbers that are not negative; it is "
                                                             "ignored");
    set(colour);
  }

  /// Reads the next word if it is an option: a minus that does not begin a number.
  LineWord read_option() {
    const std::string_view text = lines_.peek().text;
    const bool option = text.size() >= 2 && text[0] == '-' && text[1] != '.' && (text[1] < '0' || text[1] > '9');
    return option ? lines_.word() : LineWord{};
  }

  Vec2 read_vector(Vec2 fallback) {
    Vec2 value = fallback;
    for (int i = 0; i < 3; ++i) { // the third number belongs to the unused w
      const std::optional<float> number = lines_.number_word();
      if (!number) break;
      if (i < 2 && std::isfinite(*number)) value[i] = *number;
    }
    return value;
  }

  void report_option(const LineWord& option) {
    reporter_.warning(place(option.column), "the option " + in_quotes(option.text) + " of a texture is left out");
  }

  void read_map(MtlMap& map) {
    map = MtlMap{};
    map.place = place();
    for (LineWord option = read_option(); !option.text.empty(); option = read_option()) {
      if (option.text == "-s") {
        map.scale = read_vector(Vec2(1.0f));
      } else if (option.text == "-o" || option.text == "-t") {
        const Vec2 offset = read_vector(Vec2(0.0f));
        if (option.text == "-o")
          map.offset = offset;
        else
          report_option(option); // turbulence
      } else if (option.text == "-clamp") {
        map.clamp = lines_.word().text == "on";
      } else if (option.text == "-mm") {
        lines_.number_word(), lines_.number_word();
        report_option(option);
      } else {
        const LineWord value = lines_.word(); // -blendu, -blendv, -bm, -boost, -cc, -texres and -type take one word
        if (option.text == "-imfchan" && value.text != "l") report_option(option);
      }
    }
    const std::string_view name = lines_.rest();
    if (name.empty()) return reporter_.error(place(), "a texture without a file name; it is ignored");
    map.file = resolve_named_file(name, folder_);
  }

  TextLines lines_;
  uint32_t file_;
  const std::filesystem::path& folder_;
  Reporter& reporter_;
  std::vector<MtlMaterial> materials_;
};

} // namespace

std::filesystem::path resolve_named_file(std::string_view name, const std::filesystem::path& folder) {
  std::filesystem::path path = folder / name;
  std::error_code error;
  if (name.find('\\') == std::string_view::npos || std::filesystem::exists(path, error)) return path;
  std::string slashes(name);
  std::ranges::replace(slashes, '\\', '/');
  return folder / slashes;
}

std::vector<MtlMaterial> read_mtl(std::string_view text, uint32_t file, const std::filesystem::path& folder,
                                  Reporter& reporter) {
  return MtlReader(text, file, folder, reporter).read();
}

} // namespace packtrace
