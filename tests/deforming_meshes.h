#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "pbrt_import/scene/mesh_sequence.h"
#include "pbrt_import/scene/scene.h"

/// Meshes of one topology that move, for tests and benchmarks of deforming geometry.
namespace packtrace::test {

/// A mesh that moves with time.
class DeformingMesh {
public:
  virtual ~DeformingMesh() = default;
  /// Positions of all vertices at a time in seconds.
  virtual std::vector<Vec3> positions(double time) const = 0;
  const std::vector<Triangle>& triangles() const { return triangles_; }
  Mesh mesh(double time) const {
    Mesh result;
    result.name = "deforming";
    result.positions = positions(time);
    result.triangles = triangles_;
    return result;
  }

protected:
  std::vector<Triangle> triangles_;
};

/// n x n quads of cloth over [0,1]^2 that hang from the line y = 1 and flap in the wind.
class Cloth final : public DeformingMesh {
public:
  explicit Cloth(uint32_t n) : n_(n) {
    for (uint32_t y = 0; y < n; ++y)
      for (uint32_t x = 0; x < n; ++x) {
        const uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 1, d = c + 1;
        triangles_.emplace_back(a, b, d);
        triangles_.emplace_back(a, d, c);
      }
  }

  std::vector<Vec3> positions(double t) const override {
    std::vector<Vec3> result;
    for (uint32_t y = 0; y <= n_; ++y)
      for (uint32_t x = 0; x <= n_; ++x) {
        const double u = double(x) / n_, v = double(y) / n_, free = 1.0 - v;
        const double wave =
            0.12 * free * std::sin(9.0 * u + 5.0 * v - 4.0 * t) + 0.05 * free * std::sin(23.0 * u - 7.0 * t);
        result.emplace_back(u + 0.03 * free * std::sin(3.0 * t + 4.0 * v), v + 0.02 * free * std::cos(2.0 * t), wave);
      }
    return result;
  }

private:
  uint32_t n_;
};

/// A meadow over [0,1]^2 of blades of five triangles and seven vertices each, which bend in gusts along x.
class Grass final : public DeformingMesh {
public:
  explicit Grass(uint32_t blades, uint32_t seed = 1) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> along(0.0, 1.0);
    // Sequenced: argument order is unspecified.
    for (uint32_t i = 0; i < blades; ++i) {
      Blade blade;
      blade.x = along(generator), blade.z = along(generator), blade.turn = 6.2831853 * along(generator);
      blade.height = 0.02 + 0.02 * along(generator), blade.phase = along(generator);
      blades_.push_back(blade);
      const uint32_t v = 7 * i;
      for (uint32_t level = 0; level < 2; ++level) {
        triangles_.emplace_back(v + 2 * level, v + 2 * level + 1, v + 2 * level + 3);
        triangles_.emplace_back(v + 2 * level, v + 2 * level + 3, v + 2 * level + 2);
      }
      triangles_.emplace_back(v + 4, v + 5, v + 6);
    }
  }

  std::vector<Vec3> positions(double t) const override {
    std::vector<Vec3> result;
    result.reserve(7 * blades_.size());
    for (const Blade& blade : blades_) {
      const double gust = std::sin(14.0 * blade.x + 5.0 * blade.z - 2.5 * t) + 0.5 * std::sin(31.0 * blade.z - 4.0 * t),
                   lean = 0.35 + 0.3 * gust + 0.1 * std::sin(9.0 * t + 6.0 * blade.phase);
      for (uint32_t i = 0; i < 7; ++i) {
        const double level = (i / 2) / 3.0, side = i == 6 ? 0.0 : (i % 2 == 0 ? -0.5 : 0.5);
        const double width = 0.06 * blade.height * (1.0 - 0.6 * level) * side, bend = lean * level;
        result.emplace_back(blade.x + width * std::cos(blade.turn) + blade.height * level * std::sin(bend),
                            blade.height * level * std::cos(bend), blade.z + width * std::sin(blade.turn));
      }
    }
    return result;
  }

private:
  struct Blade {
    double x, z, turn, height, phase;
  };
  std::vector<Blade> blades_;
};

/// Frames in memory.
class GivenFrames final : public MeshFrames {
public:
  explicit GivenFrames(std::vector<std::vector<Vec3>> frames) : frames_(std::move(frames)) {}
  uint32_t count() const override { return static_cast<uint32_t>(frames_.size()); }
  std::vector<Vec3> positions(uint32_t frame) const override { return frames_[frame]; }
  std::string name(uint32_t frame) const override { return "frame " + std::to_string(frame); }

private:
  std::vector<std::vector<Vec3>> frames_;
};

/// Frames of a mesh at 24 per second.
inline std::vector<std::vector<Vec3>> sampled(const DeformingMesh& mesh, uint32_t count) {
  std::vector<std::vector<Vec3>> frames;
  for (uint32_t i = 0; i < count; ++i) frames.push_back(mesh.positions(i / 24.0));
  return frames;
}

} // namespace packtrace::test
