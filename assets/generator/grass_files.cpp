#include "assets/generator/grass_files.h"

#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "assets/generator/placement.h"
#include "assets/generator/ply_output.h"
#include "assets/generator/png_output.h"

namespace packtrace::scenegen {

std::string grass_name(const GrassConfig& config, const GrassVariant& variant) {
  if (config.tile_patches == 1) return fmt::format("grass_{}", variant.lod);
  return fmt::format("grass_{}_{}", variant.lod, variant.row * config.tile_patches + variant.column);
}

std::string write_grass_frames(const GrassField& field, const GrassVariant& variant, uint32_t frames,
                               const OutputConfig& output) {
  const std::vector<GrassBlade> blades = make_grass_blades(field, variant.column, variant.row, variant.lod);
  Mesh mesh;
  mesh.positions.resize(blades.size() * kBladeVertices);
  mesh.uvs.resize(mesh.positions.size());
  mesh.triangles.resize(blades.size() * kBladeTriangles);
  write_grass_triangles(mesh.triangles);
  write_grass_uvs(blades, mesh.uvs);
  const std::string stem = "geometry/" + grass_name(field.config, variant);
  const uint32_t count = field.config.lod_wind[variant.lod] > 0.0 ? frames : 1;
  for (uint32_t frame = 0; frame < count; ++frame) {
    const WindMoment moment = wind_moment(field.wind, static_cast<double>(frame) / frames);
    write_grass_positions(blades, moment, mesh.positions);
    BufferedFile file(output.folder / fmt::format("{}_{:04}.ply", stem, frame), output.overwrite);
    write_ply(file, mesh);
    file.close();
    mesh.uvs.clear();
  }
  return stem + "_0000.ply";
}

void write_grass_levels(std::string_view name, const GrassConfig& config,
                        std::span<const std::array<std::string, kGrassLods>> chains, const OutputConfig& output) {
  std::string text = "{\"chains\": [";
  for (size_t i = 0; i < chains.size(); ++i)
    text += fmt::format("{}\n  {{\"objects\": [\"{}\"], \"distances\": [{}]}}", i > 0 ? "," : "",
                        fmt::join(chains[i], "\", \""), fmt::join(config.lod_distances, ", "));
  BufferedFile file(output.folder / name, output.overwrite);
  file.write(text + "\n]}\n");
  file.close();
}

void write_grass_texture(std::string_view name, double straw, const OutputConfig& output) {
  constexpr uint32_t kColours = 32, kHeights = 16;
  const DVec3 dark(58, 110, 38), light(160, 192, 72), dry(224, 202, 118); // sRGB values at the tip
  std::vector<uint8_t> texels;
  for (uint32_t row = 0; row < kHeights; ++row) {
    const double height = 1.0 - (row + 0.5) / kHeights;
    for (uint32_t column = 0; column < kColours; ++column) {
      const double u = (column + 0.5) / kColours;
      const DVec3 green = glm::mix(dark, light, smooth_step(0.0, 1.0, u));
      const DVec3 tip = glm::mix(green, dry, 0.85 * smooth_step(1.0 - straw, 1.1 - 0.8 * straw, u));
      const DVec3 colour = tip * mix(0.52, 1.06, smooth_step(-0.1, 1.0, height));
      for (int channel = 0; channel < 3; ++channel)
        texels.push_back(static_cast<uint8_t>(std::min(255.0, std::floor(colour[channel] + 0.5))));
    }
  }
  BufferedFile file(output.folder / name, output.overwrite);
  write_png(file, kColours, kHeights, 3, texels);
  file.close();
}

} // namespace packtrace::scenegen
