#include "tests/benchmarks/import_inputs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "assets/generator/buffered_file.h"
#include "assets/generator/ply_output.h"
#include "assets/generator/random.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;
using scenegen::BufferedFile;
using scenegen::Random;

constexpr uint64_t kGeneratorVersion = 1; ///< part of the folders' names; raise it whenever the bytes change
constexpr uint64_t kUseSeed = 1'000'000;  ///< distinct from the seeds of the grids

/// A number in [0, count) for the i-th use; neighbouring uses get distant numbers.
uint64_t shuffled(uint32_t i, uint64_t count) { return i * uint64_t{7919} % count; }

/// A bumpy height field of columns x rows quads; triangle t belongs to quad t / 2.
struct Grid {
  uint32_t columns = 1, rows = 1;
  uint64_t seed = 0;

  uint32_t vertex_count() const { return (columns + 1) * (rows + 1); }
  uint32_t triangle_count() const { return 2 * columns * rows; }

  Triangle triangle(uint32_t t) const {
    const uint32_t quad = t / 2, a = quad / columns * (columns + 1) + quad % columns, d = a + columns + 2;
    return t % 2 == 0 ? Triangle(a, a + 1, d) : Triangle(a, d, d - 1);
  }
  Vec3 position(uint32_t v) const {
    Random random(3 * seed, v);
    return {static_cast<float>(v % (columns + 1) + random.uniform(0, 0.5)), static_cast<float>(random.uniform(-1, 1)),
            static_cast<float>(v / (columns + 1) + random.uniform(0, 0.5))};
  }
  Vec3 normal(uint32_t v) const {
    Random random(3 * seed + 1, v);
    const double x = random.uniform(-1, 1), y = random.uniform(0.1, 1), z = random.uniform(-1, 1);
    const double length = std::sqrt(x * x + y * y + z * z);
    return {static_cast<float>(x / length), static_cast<float>(y / length), static_cast<float>(z / length)};
  }
  Vec2 uv(uint32_t v) const {
    Random random(3 * seed + 2, v);
    return {static_cast<float>(random.uniform()), static_cast<float>(random.uniform())};
  }
};

/// Calls write(index, text) for each index and writes the text to the file.
template <class Write>
void write_each(BufferedFile& file, uint64_t count, Write write) {
  std::string text;
  for (uint64_t i = 0; i < count; ++i) {
    text.clear();
    write(static_cast<uint32_t>(i), std::back_inserter(text));
    file.write(text);
  }
}

/// Writes a trianglemesh with normals and UVs; floats have nine significant digits, which identify them.
void write_mesh(BufferedFile& file, const Grid& grid) {
  file.write("Shape \"trianglemesh\" \"integer indices\" [\n");
  write_each(file, grid.triangle_count(), [&](uint32_t i, auto out) {
    const Triangle t = grid.triangle(i);
    fmt::format_to(out, "{} {} {}\n", t.x, t.y, t.z);
  });
  file.write("] \"point P\" [\n");
  const auto vec3 = [](auto out, const Vec3& v) { fmt::format_to(out, "{:.9g} {:.9g} {:.9g}\n", v.x, v.y, v.z); };
  write_each(file, grid.vertex_count(), [&](uint32_t v, auto out) { vec3(out, grid.position(v)); });
  file.write("] \"normal N\" [\n");
  write_each(file, grid.vertex_count(), [&](uint32_t v, auto out) { vec3(out, grid.normal(v)); });
  file.write("] \"float uv\" [\n");
  write_each(file, grid.vertex_count(), [&](uint32_t v, auto out) {
    const Vec2 uv = grid.uv(v);
    fmt::format_to(out, "{:.9g} {:.9g}\n", uv.x, uv.y);
  });
  file.write("]\n");
}

constexpr std::string_view kMainFile = "scene.pbrt";

/// The main file, with the text before the first shape and at the end.
class SceneFile : public BufferedFile {
public:
  explicit SceneFile(const fs::path& folder) : BufferedFile(folder / kMainFile, true) {
    write("LookAt 0 5 -10 0 0 0 0 1 0\nCamera \"perspective\" \"float fov\" 45\nWorldBegin\n");
  }
  void end() {
    write("WorldEnd\n");
    close();
  }
};

constexpr std::string_view kTriangle = "Shape \"trianglemesh\" \"integer indices\" [0 1 2] "
                                       "\"point P\" [0 0 0 1 0 0 0 1 0]\n";

/// Counts that an import must find.
struct Counts {
  uint64_t triangles = 0;
  uint64_t instances = 0;
};

uint64_t scaled(uint64_t count, double scale) {
  return std::max<uint64_t>(1, static_cast<uint64_t>(std::llround(static_cast<double>(count) * scale)));
}

Counts write_meshes(const fs::path& folder, double scale) {
  const uint64_t count = scaled(3024, scale);
  constexpr Grid kGrid{8, 62};
  SceneFile file(folder);
  for (uint64_t i = 0; i < count; ++i) write_mesh(file, {kGrid.columns, kGrid.rows, i});
  file.end();
  return {count * kGrid.triangle_count(), 0};
}

Counts write_one_mesh(const fs::path& folder, double scale) {
  const auto side = [&](double full) {
    return static_cast<uint32_t>(std::max(1.0, std::round(full * std::sqrt(scale))));
  };
  const Grid grid{side(1225), side(1240)};
  SceneFile file(folder);
  write_mesh(file, grid);
  file.end();
  return {grid.triangle_count(), 0};
}

Counts write_instances(const fs::path& folder, double scale) {
  constexpr uint32_t kObjects = 10;
  constexpr Grid kGrid{20, 25};
  // The importer leaves out objects without a use.
  const uint64_t count = std::max<uint64_t>(scaled(200'000, scale), kObjects);
  SceneFile file(folder);
  for (uint32_t i = 0; i < kObjects; ++i) {
    file.write(fmt::format("ObjectBegin \"tree_{}\"\n", i));
    write_mesh(file, {kGrid.columns, kGrid.rows, i});
    file.write("ObjectEnd\n");
  }
  write_each(file, count, [](uint32_t i, auto out) {
    Random random(kUseSeed, i);
    out = fmt::format_to(out, "AttributeBegin\n  ConcatTransform [");
    for (uint32_t column = 0; column < 3; ++column) {
      for (uint32_t row = 0; row < 3; ++row) // diagonally dominant, so never singular
        out = fmt::format_to(out, "{:.4f} ", row == column ? random.uniform(1, 1.5) : random.uniform(-0.4, 0.4));
      out = fmt::format_to(out, "0 ");
    }
    const double x = random.uniform(-999, 999), y = random.uniform(-99, 99), z = random.uniform(-999, 999);
    fmt::format_to(out, "{:.4f} {:.4f} {:.4f} 1]\n  ObjectInstance \"tree_{}\"\nAttributeEnd\n", x, y, z, i % kObjects);
  });
  file.end();
  return {uint64_t{kObjects} * kGrid.triangle_count(), count};
}

void write_ply_grid(const fs::path& path, const Grid& grid) {
  BufferedFile file(path, true);
  scenegen::write_ply_header(file, {grid.vertex_count(), grid.triangle_count(), true, true});
  for (uint32_t v = 0; v < grid.vertex_count(); ++v) {
    file.write_value(grid.position(v));
    file.write_value(grid.normal(v));
    file.write_value(grid.uv(v));
  }
  for (uint32_t t = 0; t < grid.triangle_count(); ++t) scenegen::write_ply_triangle(file, grid.triangle(t));
  file.close();
}

Counts write_ply_files(const fs::path& folder, double scale) {
  const uint64_t count = scaled(271, scale);
  constexpr Grid kGrid{10, 290};
  SceneFile file(folder);
  for (uint64_t i = 0; i < count; ++i) {
    const std::string name = fmt::format("mesh{:03}.ply", i);
    write_ply_grid(folder / name, {kGrid.columns, kGrid.rows, i});
    file.write(fmt::format("Shape \"plymesh\" \"string filename\" \"{}\"\n", name));
  }
  file.end();
  return {count * kGrid.triangle_count(), 0};
}

Counts write_objects(const fs::path& folder, double scale) {
  const uint64_t count = scaled(5000, scale), uses = scaled(100'000, scale);
  SceneFile file(folder);
  write_each(file, count, [](uint32_t i, auto out) {
    fmt::format_to(out, "ObjectBegin \"object_{}\"\n{}ObjectEnd\n", i, kTriangle);
  });
  write_each(file, uses, [&](uint32_t i, auto out) {
    Random random(kUseSeed, i);
    const double x = random.uniform(-99, 99), y = random.uniform(-99, 99), z = random.uniform(-99, 99);
    fmt::format_to(out,
                   "AttributeBegin\n  Translate {:.4f} {:.4f} {:.4f}\n  ObjectInstance \"object_{}\"\nAttributeEnd\n",
                   x, y, z, shuffled(i, count));
  });
  file.end();
  return {count, uses};
}

/// Instances of one triangle with the shortest text: what an instance costs apart from its numbers.
Counts write_placements(const fs::path& folder, double scale) {
  const uint64_t count = scaled(1'000'000, scale);
  SceneFile file(folder);
  file.write(fmt::format("ObjectBegin \"t\"\n{}ObjectEnd\n", kTriangle));
  write_each(file, count, [](uint32_t, auto out) { fmt::format_to(out, "Translate 1 0 0\nObjectInstance \"t\"\n"); });
  file.end();
  return {1, count};
}

Counts write_tiny_meshes(const fs::path& folder, double scale) {
  const uint64_t count = scaled(600, scale);
  constexpr Grid kGrid{5, 5};
  SceneFile file(folder);
  for (uint64_t i = 0; i < count; ++i) write_mesh(file, {kGrid.columns, kGrid.rows, i});
  file.end();
  return {count * kGrid.triangle_count(), 0};
}

Counts write_materials(const fs::path& folder, double scale) {
  const uint64_t count = scaled(5000, scale), uses = scaled(100'000, scale);
  SceneFile file(folder);
  write_each(file, count, [](uint32_t i, auto out) {
    Random random(kUseSeed, i);
    const double r = random.uniform(), g = random.uniform(), b = random.uniform();
    fmt::format_to(out,
                   "MakeNamedMaterial \"material_{}\" \"string type\" \"matte\" \"rgb Kd\" [{:.4f} {:.4f} {:.4f}]\n", i,
                   r, g, b);
  });
  write_each(file, uses, [&](uint32_t i, auto out) {
    fmt::format_to(out, "NamedMaterial \"material_{}\"\n{}", shuffled(i, count), kTriangle);
  });
  file.end();
  return {uses, 0};
}

Counts write_includes(const fs::path& folder, double scale) {
  const uint64_t count = scaled(2000, scale);
  SceneFile file(folder);
  for (uint64_t i = 0; i < count; ++i) {
    const std::string name = fmt::format("part{:04}.pbrt", i);
    BufferedFile part(folder / name, true);
    part.write(fmt::format("AttributeBegin\nTranslate {} 0 0\n{}AttributeEnd\n", i, kTriangle));
    part.close();
    file.write(fmt::format("Include \"{}\"\n", name));
  }
  file.end();
  return {count, 0};
}

struct Recipe {
  std::string_view name;
  Counts (*write)(const fs::path& folder, double scale);
};
constexpr std::array kRecipes{
    Recipe{"meshes", write_meshes},     Recipe{"one-mesh", write_one_mesh},     Recipe{"instances", write_instances},
    Recipe{"ply", write_ply_files},     Recipe{"objects", write_objects},       Recipe{"materials", write_materials},
    Recipe{"includes", write_includes}, Recipe{"placements", write_placements}, Recipe{"tiny", write_tiny_meshes},
};
constexpr auto kNames = [] {
  std::array<std::string_view, kRecipes.size()> names;
  for (size_t i = 0; i < names.size(); ++i) names[i] = kRecipes[i].name;
  return names;
}();

/// Lists the relevant files in the main file's folder: PLY files if there are any, otherwise scene text.
void list_files(ImportInput& input) {
  std::vector<fs::path> text;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(input.main_file.parent_path())) {
    const fs::path extension = entry.path().extension();
    if (extension == ".ply") input.files.push_back(entry.path());
    if (extension == ".pbrt") text.push_back(entry.path());
  }
  input.binary = !input.files.empty();
  if (!input.binary) input.files = std::move(text);
  std::sort(input.files.begin(), input.files.end());
  for (const fs::path& file : input.files) input.bytes += fs::file_size(file);
}

} // namespace

std::span<const std::string_view> input_names() { return kNames; }

ImportInput existing_scene(std::string_view name, const fs::path& main_file) {
  ImportInput input;
  input.name = name;
  input.main_file = main_file;
  list_files(input);
  return input;
}

ImportInput make_input(std::string_view name, const fs::path& folder, double scale) {
  const auto recipe = std::find_if(kRecipes.begin(), kRecipes.end(), [&](const Recipe& r) { return r.name == name; });
  if (recipe == kRecipes.end()) throw Error(ErrorKind::kUsage, fmt::format("no input is named {}", name));
  if (!(scale > 0 && scale <= 1)) throw Error(ErrorKind::kUsage, fmt::format("scale {} is not within (0, 1]", scale));
  const fs::path own = folder / fmt::format("{}-{}-v{}", name, scale, kGeneratorVersion);
  const fs::path counts_file = own / "counts.txt"; // written last, so it implies that the rest is complete
  Counts counts;
  if (!(std::ifstream(counts_file) >> counts.triangles >> counts.instances)) {
    counts = recipe->write(own, scale);
    BufferedFile file(counts_file, true);
    file.write(fmt::format("{} {}\n", counts.triangles, counts.instances));
    file.close();
  }
  ImportInput input = existing_scene(name, own / kMainFile);
  input.triangles = counts.triangles;
  input.instances = counts.instances;
  return input;
}

} // namespace packtrace
