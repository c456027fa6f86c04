#include "runtime/measure/matrix.h"

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>

namespace packtrace {
namespace {

class Matrix {
public:
  explicit Matrix(uint32_t spp) { default_.render.spp = spp; }

  /// Adds a point that differs from the default in what `change` sets. A point with known options is not added again.
  template <class Change>
  void add(std::string group, std::string id, std::string label, const Change& change) {
    MeasurePoint point = default_;
    point.group = std::move(group), point.id = std::move(id), point.label = std::move(label);
    change(point);
    const auto same = [&](const MeasurePoint& p) { return p.bake == point.bake && p.render == point.render; };
    if (std::ranges::none_of(points_, same)) points_.push_back(std::move(point));
  }

  std::vector<MeasurePoint> take() {
    std::vector<MeasurePoint> sorted; // a file is baked once for all points that trace it
    for (const MeasurePoint& first : points_) {
      const auto same = [&](const MeasurePoint& p) { return p.bake == first.bake; };
      if (std::ranges::any_of(sorted, same)) continue;
      std::ranges::copy_if(points_, std::back_inserter(sorted), same);
    }
    return sorted;
  }

private:
  MeasurePoint default_;
  std::vector<MeasurePoint> points_;
};

void set_grid(MeasurePoint& point, GridKind kind, double value) {
  point.bake.grid = kind;
  point.bake.grid_value = value;
}

std::vector<uint32_t> position_bits(MatrixMode mode) {
  if (mode == MatrixMode::kQuick) return {10, 14, 18};
  if (mode == MatrixMode::kDefault) return {8, 10, 12, 14, 16, 18, 20, 22};
  std::vector<uint32_t> bits;
  for (uint32_t b = 8; b <= 22; ++b) bits.push_back(b);
  return bits;
}

void add_positions(Matrix& matrix, MatrixMode mode, const MatrixScene& scene) {
  for (const uint32_t bits : position_bits(mode))
    matrix.add("positions", fmt::format("bits-{}", bits), fmt::format("{} bits per coordinate", bits),
               [&](MeasurePoint& p) { set_grid(p, GridKind::kBits, bits); });
  if (mode == MatrixMode::kQuick) return;
  const auto grid = [&](GridKind kind, const char* name, double value, const char* unit) {
    matrix.add("grid-step", fmt::format("{}-{}", name, value), fmt::format("grid step {} {}", value, unit),
               [&](MeasurePoint& p) { set_grid(p, kind, value); });
  };
  for (const double value : {1e-6, 1e-5, 1e-4}) grid(GridKind::kRelative, "relative", value, "of the diagonal");
  for (const double parts : {512.0, 32.0, 8.0})
    matrix.add("grid-step", fmt::format("edge-{}", 1.0 / parts),
               fmt::format("grid step 1/{} of the median edge", parts),
               [&](MeasurePoint& p) { set_grid(p, GridKind::kEdge, 1.0 / parts); });
  if (mode == MatrixMode::kDefault) return;
  for (const double share : {1e-5, 1e-4}) { // rounded to two digits, so that the command is readable
    const double value = std::stod(fmt::format("{:.1e}", share * scene.diagonal));
    grid(GridKind::kAbsolute, "absolute", value, "world units");
  }
}

void add_streams(Matrix& matrix, MatrixMode mode, const MatrixScene& scene) {
  const std::vector<const char*> normals =
      mode == MatrixMode::kFull    ? std::vector<const char*>{"axis16", "oct16", "oct20", "axis24", "oct24", "axis32"}
      : mode == MatrixMode::kQuick ? std::vector<const char*>{"axis16"}
                                   : std::vector<const char*>{"axis16", "oct20", "axis32"};
  for (const char* name : normals)
    matrix.add("normals", name, fmt::format("normals {}", name), [&](MeasurePoint& p) { p.bake.normals = name; });
  for (const char* codec : {"fast", "small"})
    if (mode != MatrixMode::kQuick || codec == std::string("small"))
      matrix.add("codec", codec, fmt::format("codec {}", codec), [&](MeasurePoint& p) { p.bake.codec = codec; });
  matrix.add("trees", "trees-off", "no stored trees", [](MeasurePoint& p) { p.bake.trees = "off"; });
  if (mode == MatrixMode::kQuick || !scene.has_uvs) return;
  matrix.add("textures", "shading", "for shading", [](MeasurePoint& p) { p.bake.purpose = "shading"; });
  if (mode == MatrixMode::kDefault) return;
  for (const char* uvs : {"unorm16", "fp16"})
    matrix.add("uv", uvs, fmt::format("for shading, uvs {}", uvs), [&](MeasurePoint& p) {
      p.bake.purpose = "shading";
      p.bake.uvs = uvs;
    });
  matrix.add("textures", "textures-none", "for shading, no textures", [](MeasurePoint& p) {
    p.bake.purpose = "shading";
    p.bake.textures = "none";
  });
}

void add_levels(Matrix& matrix, MatrixMode mode) {
  if (mode == MatrixMode::kFull)
    matrix.add("lod", "lod-instanced", "levels for instanced geometries",
               [](MeasurePoint& p) { p.bake.lod = "instanced"; });
  matrix.add("lod", "lod-all", "levels for all geometries", [](MeasurePoint& p) { p.bake.lod = "all"; });
  for (const double error_px : lod_errors(mode))
    if (error_px > 0.0)
      matrix.add("lod-error", fmt::format("lod-error-{}", error_px),
                 fmt::format("levels, {} pixel{}", error_px, error_px == 1.0 ? "" : "s"), [&](MeasurePoint& p) {
                   p.bake.lod = "all";
                   p.render.lod_error_px = error_px;
                 });
}

void add_rendering(Matrix& matrix, MatrixMode mode) {
  if (mode == MatrixMode::kQuick) return;
  for (const uint32_t spp : {1u, 4u, 16u})
    matrix.add("spp", fmt::format("spp-{}", spp), fmt::format("{} sample{} per pixel", spp, spp == 1 ? "" : "s"),
               [&](MeasurePoint& p) { p.render.spp = spp; });
  for (const uint32_t frames : {8u, 32u})
    matrix.add("denoise", fmt::format("frames-{}_denoised", frames), fmt::format("{} frames, denoised", frames),
               [&](MeasurePoint& p) { p.render.spp = 1, p.render.frames = frames, p.render.denoise = true; });
  matrix.add("resolution", "quarter", "occlusion at quarter resolution",
             [](MeasurePoint& p) { p.render.ao_resolution = "quarter"; });
  matrix.add("resolution", "frames-32_denoised_quarter", "32 frames, denoised, quarter resolution",
             [](MeasurePoint& p) {
               p.render.spp = 1, p.render.frames = 32, p.render.denoise = true, p.render.ao_resolution = "quarter";
             });
  matrix.add("backend", "embree", "backend embree", [](MeasurePoint& p) { p.render.backend = "embree"; });
}

void add_product(Matrix& matrix, MatrixMode mode) {
  const bool full = mode == MatrixMode::kFull, quick = mode == MatrixMode::kQuick;
  if (!quick)
    matrix.add("product", "small_trees-off", "codec small, no trees",
               [](MeasurePoint& p) { p.bake.codec = "small", p.bake.trees = "off"; });
  const std::vector<uint32_t> bits = quick  ? std::vector<uint32_t>{14}
                                     : full ? std::vector<uint32_t>{10, 12, 14, 16, 18, 20}
                                            : std::vector<uint32_t>{12, 14, 16, 18};
  const std::vector<std::string> normals = full    ? std::vector<std::string>{"auto", "axis16", "oct20"}
                                           : quick ? std::vector<std::string>{"auto"}
                                                   : std::vector<std::string>{"auto", "axis16"};
  const std::vector<std::string> codecs =
      full ? std::vector<std::string>{"none", "fast", "small"} : std::vector<std::string>{"small"};
  for (const uint32_t b : bits)
    for (const std::string& n : normals)
      for (const std::string& codec : codecs)
        for (const char* trees : {"on", "off"}) {
          if (!full && trees == std::string("off") && (n != "auto" || quick)) continue;
          const bool without = trees == std::string("off");
          matrix.add("product", fmt::format("bits-{}_{}_{}{}", b, n, codec, without ? "_trees-off" : ""),
                     fmt::format("{} bits, normals {}, codec {}{}", b, n, codec, without ? ", no trees" : ""),
                     [&](MeasurePoint& p) {
                       set_grid(p, GridKind::kBits, b);
                       p.bake.normals = n, p.bake.codec = codec, p.bake.trees = trees;
                     });
        }
}

} // namespace

std::vector<MeasurePoint> make_matrix(MatrixMode mode, const MatrixScene& scene, uint32_t spp) {
  Matrix matrix(spp);
  matrix.add("default", "default", "default", [](MeasurePoint&) {});
  add_rendering(matrix, mode);
  add_positions(matrix, mode, scene);
  add_streams(matrix, mode, scene);
  add_levels(matrix, mode);
  add_product(matrix, mode);
  return matrix.take();
}

std::vector<uint32_t> convergence_frames(MatrixMode mode) {
  if (mode == MatrixMode::kQuick) return {1, 4, 16};
  if (mode == MatrixMode::kDefault) return {1, 2, 4, 8, 16, 32};
  return {1, 2, 4, 8, 16, 32, 64, 128};
}

std::vector<uint32_t> resolution_samples(MatrixMode mode) {
  if (mode == MatrixMode::kQuick) return {4};
  if (mode == MatrixMode::kDefault) return {1, 4, 16};
  return {1, 4, 16, 64};
}

std::vector<double> lod_errors(MatrixMode mode) {
  if (mode == MatrixMode::kQuick) return {0, 1};
  if (mode == MatrixMode::kDefault) return {0, 0.5, 1, 2, 4};
  return {0, 0.25, 0.5, 1, 2, 4, 8};
}

} // namespace packtrace
