#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "compress/format/cluster/tangent_codec.h"
#include "compress/format/cluster/uv_codec.h"
#include "compress/format/textures/texture_encoder.h"
#include "pbrt_import/import_scene.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/compress/q_tangent.h"

/// Prints figures of docs/accuracy.md: errors of texture coordinates, tangents and textures. Fails if a documented
/// bound does not hold.
namespace packtrace {
namespace {

constexpr double kTexels = 4096.0, kDegrees = 57.295779513082320877;
bool g_kept = true;

void expect(bool ok, const char* what) {
  if (!ok) fmt::print("NOT KEPT: {}\n", what);
  g_kept = g_kept && ok;
}

using Generator = std::mt19937_64; // same numbers with every standard library
double uniform(Generator& g, double lo, double hi) { return lo + (hi - lo) * static_cast<double>(g() >> 11) * 0x1p-53; }

/// Largest error over floats of magnitude up to `most`, in texels of a 4096-texel texture; infinite if some cannot be
/// encoded.
double worst_uv(UvEncoding encoding, float most, size_t count) {
  Generator g(1);
  const int32_t exponent = choose_uv_exponent(static_cast<uint32_t>(kTexels), 1.0f, most);
  const UvDecoder decode(encoding, encoding == UvEncoding::kLattice ? exponent : 0);
  double worst = 0.0;
  for (size_t i = 0; i < count; ++i) {
    const auto uv = static_cast<float>(uniform(g, -double{most}, double{most}) * (i % 3 == 0   ? 1.0
                                                                                  : i % 3 == 1 ? 1e-2
                                                                                               : 1e-4));
    const std::optional<int32_t> code = encode_uv(encoding, uv, exponent);
    if (!code) return std::numeric_limits<double>::infinity();
    worst = std::max(worst, kTexels * std::abs(double{decode(*code)} - double{uv}));
  }
  return worst;
}

void print_uvs(size_t count) {
  constexpr std::array<float, 7> kMax{0.25f, 1.0f, 8.0f, 32.0f, 1000.0f, 1e4f, 7e4f};
  fmt::print("\nTexels of 4096, largest error for |u| up to\n| encoding |");
  for (const float most : kMax) fmt::print(" {:g} |", most);
  fmt::print("\n|---|---|---|---|---|---|---|---|\n");
  for (const UvEncoding encoding : {UvEncoding::kLattice, UvEncoding::kUnorm16, UvEncoding::kFp16}) {
    fmt::print("| {} |", kUvEncodingNames[static_cast<size_t>(encoding)]);
    for (const float most : kMax) {
      const double worst = worst_uv(encoding, most, count);
      fmt::print(" {:.3g} |", worst);
      if (encoding == UvEncoding::kLattice && most <= 16384.0f) expect(worst <= 1.0 / 32.0, "1/32 texel");
    }
    fmt::print("\n");
  }
}

double angle(DVec3 a, DVec3 b) { return 2.0 * std::asin(std::min(0.5 * glm::length(a - b), 1.0)) * kDegrees; }

DVec3 direction(Generator& g) {
  for (;;) {
    const DVec3 v(uniform(g, -1, 1), uniform(g, -1, 1), uniform(g, -1, 1));
    if (const double length = glm::length(v); length > 0.1 && length <= 1.0) return v / length;
  }
}

struct Errors {
  double sum = 0.0, worst = 0.0;
  void add(double e) { sum += e, worst = std::max(worst, e); }
};

void print_tangents(size_t count) {
  fmt::print("\n| tangents | bits | mean | max | with the normal, max |\n|---|---|---|---|---|\n");
  fmt::print("| from uv | 0 | - | - | - |\n");
  const auto n = static_cast<double>(count);
  for (const uint32_t bits : {5u, 7u, 8u, 11u, 15u}) {
    Generator g(2);
    Errors errors;
    for (size_t i = 0; i < count; ++i) {
      const double phi = uniform(g, 0.0, 6.283185307179586);
      const glm::dvec2 d(std::cos(phi), std::sin(phi)), back = decode_diamond(encode_diamond(d, bits), bits);
      errors.add(angle(DVec3(d, 0.0), DVec3(back, 0.0)));
    }
    fmt::print("| sign and diamond angle | 1 + {} | {:.3g}° | {:.3g}° | that of the normal |\n", bits, errors.sum / n,
               errors.worst);
    expect(errors.worst <= std::ldexp(2.0, 1 - static_cast<int>(bits)) * kDegrees, "diamond angle");
  }
  for (const uint32_t bits : {8u, 10u, 16u}) {
    Generator g(3);
    Errors tangents, normals;
    for (size_t i = 0; i < count; ++i) {
      test::TangentFrame frame;
      frame.normal = direction(g);
      frame.tangent = glm::normalize(glm::cross(frame.normal, direction(g)));
      frame.mirrored = i % 2 != 0;
      const test::TangentFrame back = test::decode_q_tangent(test::encode_q_tangent(frame, bits), bits);
      tangents.add(angle(back.tangent, frame.tangent)), normals.add(angle(back.normal, frame.normal));
    }
    fmt::print("| q-tangent, normal and all | 4 x {} | {:.3g}° | {:.3g}° | {:.3g}° |\n", bits, tangents.sum / n,
               tangents.worst, normals.worst);
  }
}

void print_textures(const std::string& scene) {
  ImportOptions options;
  options.keep_textures = true;
  Diagnostics diagnostics;
  Progress progress;
  const ImportResult imported = import_scene(scene, options, diagnostics, progress);
  fmt::print("\n| texture | texels | bc1, 4 bits | palette8, 8 bits | r2g4b2, 8 bits |\n|---|---|---|---|---|\n");
  for (const AlbedoTexture& texture : imported.scene.textures) {
    fmt::print("| {} | {} x {} |", texture.name, texture.width, texture.height);
    for (const TextureCodec codec : {TextureCodec::kBc1, TextureCodec::kPalette8, TextureCodec::kR2G4B2})
      fmt::print(" {:.1f} |", encode_texture(texture, codec, 0.0).psnr_db);
    fmt::print("\n");
  }
  expect(!imported.scene.textures.empty(), "a scene with textures");
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) {
  packtrace::BenchmarkOptions command_line("Errors of texture coordinates, tangents and textures by encoding");
  size_t count = 1'000'000;
  std::string scene = PACKTRACE_SOURCE_DIR "/assets/textured/textured.pbrt";
  command_line.add("--count", count, "Coordinates and frames a row");
  command_line.add("--textures-of", scene, "A pbrt scene");
  if (const auto code = command_line.parse(argc, argv)) return *code;
  packtrace::print_uvs(count);
  packtrace::print_tangents(count);
  packtrace::print_textures(scene);
  return packtrace::g_kept ? 0 : 1;
}
