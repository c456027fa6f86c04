#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace packtrace {

using Words = std::vector<std::string>;

/// How the position grid of a point is chosen; the options of bake.
enum class GridKind : uint8_t { kDefault, kBits, kRelative, kAbsolute, kEdge };

/// Options of bake that a measurement varies, by their names on the command line. Defaults are those of bake.
struct BakeKnobs {
  GridKind grid = GridKind::kDefault;
  double grid_value = 0.0; ///< bits, fraction of the diagonal, world units, or fraction of the median edge
  std::string normals = "auto";
  std::optional<double> normal_error; ///< degrees; with normals auto
  std::string uvs = "auto";
  std::string textures; ///< empty: the default of the purpose
  std::string codec = "none";
  std::string trees = "on";
  std::string lod = "off";
  std::string purpose = "ao";
  bool operator==(const BakeKnobs&) const = default;
};

/// Options of render that a measurement varies.
struct RenderKnobs {
  uint32_t spp = 1, frames = 1;
  bool denoise = false;
  std::optional<double> lod_error_px;
  std::string backend = "packed";
  std::string ao_resolution = "full";
  bool operator==(const RenderKnobs&) const = default;
};

/// Options of bake and render for the knobs, without those that have their default value.
Words words_of(const BakeKnobs& knobs);
Words words_of(const RenderKnobs& knobs);

/// Value of "knobs" in a report (docs/measure.md).
nlohmann::json to_json(const BakeKnobs& bake, const RenderKnobs& render);

/// The shortest text that reads back as the same number.
std::string number_text(double value);

/// A command line that a POSIX shell splits into the same words.
std::string shell_command(const Words& words);

} // namespace packtrace
