#include "assets/generator/displaced_mesh.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "assets/generator/noise.h"
#include "assets/generator/placement.h"
#include "assets/generator/ply_output.h"
#include "assets/generator/primitives.h"
#include "pbrt_import/base/error.h"

namespace packtrace::scenegen {
namespace {

constexpr double kRingRadius = 10.0, kTubeRadius = 3.4;
constexpr const char* kMeshComment =
    "# One unique mesh of as many triangles as the generator was asked for: a ring of eroded rock.\n"
    "# To be seen: crevices dark, ridges light, at every scale. Made by packtrace_scenegen mesh.\n\n";

struct Vertex {
  Vec3 position, normal;
};

/// The ring's surface at u (around the ring) and v (around the tube), both in turns.
DVec3 ring_point(double u, double v, uint64_t seed, uint32_t octaves) {
  const auto [su, cu] = sin_cos(2.0 * kPi * u);
  const auto [sv, cv] = sin_cos(2.0 * kPi * v);
  const DVec3 spine(kRingRadius * cu, 0.0, kRingRadius * su), out(cv * cu, sv, cv * su);
  const DVec3 base = spine + out * kTubeRadius;
  const double hills = fractal_noise(base * 0.28, seed, 3);
  const double ridges = 1.0 - std::abs(fractal_noise(base * 0.9, seed + 1, octaves));
  return spine + out * (kTubeRadius * (1.0 + 0.3 * hills + 0.32 * (ridges - 0.75)));
}

class Ring {
public:
  explicit Ring(const DisplacedMeshConfig& config) : seed_(config.seed) {
    around_ =
        std::max<uint64_t>(5, static_cast<uint64_t>(std::ceil(std::sqrt(static_cast<double>(config.triangles) * 1.4))));
    across_ = std::max<uint64_t>(5, (config.triangles + 2 * around_ - 1) / (2 * around_));
    // Detail down to about two cells: finer detail would be noise, coarser detail would leave large meshes smooth.
    octaves_ = 3;
    while (octaves_ < 12 && (1ull << (octaves_ + 3)) < across_) ++octaves_;
  }
  uint64_t vertex_count() const { return around_ * across_; }
  uint64_t triangle_count() const { return 2 * vertex_count(); }

  void write(BufferedFile& file) const {
    write_ply_header(file, {vertex_count(), triangle_count(), true, false, false});
    const uint64_t batch = std::max<uint64_t>(1, (1u << 18) / across_);
    std::vector<Vertex> vertices;
    for (uint64_t begin = 0; begin < around_; begin += batch) {
      const uint64_t end = std::min(around_, begin + batch);
      vertices.resize((end - begin) * across_);
      tbb::parallel_for(begin, end, [&](uint64_t row) { fill_row(row, vertices.data() + (row - begin) * across_); });
      file.write({reinterpret_cast<const char*>(vertices.data()), vertices.size() * sizeof(Vertex)});
    }
    for (uint64_t row = 0; row < around_; ++row) {
      for (uint64_t k = 0; k < across_; ++k) {
        const uint64_t next_row = (row + 1) % around_, next = (k + 1) % across_;
        const auto a = static_cast<uint32_t>(row * across_ + k), b = static_cast<uint32_t>(row * across_ + next);
        const auto c = static_cast<uint32_t>(next_row * across_ + next),
                   d = static_cast<uint32_t>(next_row * across_ + k);
        write_ply_triangle(file, {a, b, c});
        write_ply_triangle(file, {a, c, d});
      }
    }
  }

private:
  void fill_row(uint64_t row, Vertex* out) const {
    const double du = 0.5 / static_cast<double>(around_), dv = 0.5 / static_cast<double>(across_);
    for (uint64_t k = 0; k < across_; ++k) {
      const double u = static_cast<double>(row) / static_cast<double>(around_),
                   v = static_cast<double>(k) / static_cast<double>(across_);
      const DVec3 p = ring_point(u, v, seed_, octaves_);
      const DVec3 along_u = ring_point(u + du, v, seed_, octaves_) - p,
                  along_v = ring_point(u, v + dv, seed_, octaves_) - p;
      out[k] = {Vec3(p), Vec3(glm::normalize(glm::cross(along_v, along_u)))};
    }
  }

  uint64_t seed_ = 0, around_ = 0, across_ = 0;
  uint32_t octaves_ = 3;
};

} // namespace

SceneTotals generate_displaced_mesh(const DisplacedMeshConfig& config, const OutputConfig& output) {
  if (config.triangles < 100 || config.triangles > 2'000'000'000) {
    throw Error(ErrorKind::kUsage, fmt::format("--triangles {}: a mesh takes 100 to 2000000000", config.triangles));
  }
  SceneWriter writer(output, "mesh", kMeshComment, {{-3.0, 13.0, -21.0}, {0.0, -1.0, -1.0}, 44.0, 1280, 720});
  writer.material("rock", {0.62f, 0.48f, 0.36f});
  writer.material("plain", {0.55f, 0.56f, 0.55f});
  Model plain;
  add_quad(plain.flat("plain"), {-60, -2.6, -60}, {-60, -2.6, 60}, {60, -2.6, 60}, {60, -2.6, -60});
  writer.model("plain", plain);
  writer.world_shape("plain");
  const Ring ring(config);
  BufferedFile file(output.folder / "geometry/ring.ply", output.overwrite);
  ring.write(file);
  file.close();
  writer.world_file("geometry/ring.ply", "rock", ring.triangle_count());
  return writer.finish();
}

} // namespace packtrace::scenegen
