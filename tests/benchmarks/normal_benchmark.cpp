// Measures error and speed of each normal encoding; documented in docs/accuracy.md.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "compress/format/cluster/normal_codec.h"
#include "pbrt_import/base/error.h"
#include "runtime/stopwatch.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/packing_benchmark_machine.h"

namespace packtrace {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegreesPerRadian = 57.295779513082320877;
constexpr double kTurn = 6.283185307179586477;

/// Random generator per item, so that sets do not depend on threads or on their size.
/// Source: Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014, the finaliser of SplitMix64.
class ItemRandom {
public:
  ItemRandom(uint64_t set, uint64_t item) : state_((set << 56) + item * 16) {}

  uint64_t bits() {
    uint64_t z = ++state_ * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  double unit() { return static_cast<double>(bits() >> 11) * 0x1p-53; } ///< [0, 1)
  double sign() { return (bits() >> 63) != 0 ? -1.0 : 1.0; }
  double small() { return sign() * std::pow(10.0, -1.0 - 8.0 * unit()); } ///< +-1e-9..1e-1, uniform in the logarithm

private:
  uint64_t state_;
};

/// Rotates the axes, so that component 2 becomes any axis.
DVec3 turned(DVec3 v, uint64_t axis) {
  return axis % 3 == 0 ? v : axis % 3 == 1 ? DVec3(v.z, v.x, v.y) : DVec3(v.y, v.z, v.x);
}

DVec3 uniform_direction(ItemRandom random) {
  const double z = 2.0 * random.unit() - 1.0, phi = kTurn * random.unit(), r = std::sqrt(1.0 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

DVec3 near_axis(ItemRandom random) {
  const DVec3 v(random.small(), random.small(), random.sign());
  return turned(v, random.bits() >> 33);
}

DVec3 near_diagonal(ItemRandom random) {
  const double third = random.sign() > 0.0 ? random.sign() : 0.0; // a corner of the cube, or the middle of an edge
  const DVec3 v(random.sign() + random.small(), random.sign() + random.small(), third + random.small());
  return turned(v, random.bits() >> 33);
}

DVec3 near_equator(ItemRandom random) { // the equator of any axis, including the folds of the octahedron
  const double phi = kTurn * random.unit();
  const DVec3 v(std::cos(phi), std::sin(phi), random.small());
  return turned(v, random.bits() >> 33);
}

DVec3 near_chart_border(ItemRandom random) { // two components equal, the third at most as large
  const DVec3 v(random.sign() + random.small(), random.sign(), 2.0 * random.unit() - 1.0);
  return turned(v, random.bits() >> 33);
}

/// A direction between four neighbouring codes, far from the nearest one.
DVec3 between_codes(ItemRandom random, NormalEncoding encoding) {
  const NormalFormat& format = format_of(encoding);
  const auto corner = [&](uint32_t codes) { return static_cast<int32_t>(random.bits() % (codes - 2)); };
  const auto chart = static_cast<uint32_t>(random.bits() % format.charts);
  const int32_t x = corner(format.x_codes), y = corner(format.y_codes);
  DVec3 sum(0.0);
  for (int32_t i = 0; i < 4; ++i) sum += DVec3(decode_normal(encoding, NormalFields{chart, x + i / 2, y + i % 2}));
  return sum;
}

DVec3 direction(size_t set, uint64_t item, NormalEncoding encoding) {
  const ItemRandom random(set, item);
  switch (set) {
  case 0:
    return uniform_direction(random);
  case 1:
    return near_axis(random);
  case 2:
    return near_diagonal(random);
  case 3:
    return near_equator(random);
  case 4:
    return near_chart_border(random);
  default:
    return between_codes(random, encoding);
  }
}

constexpr std::array<const char*, 6> kSets{"uniform",  "near axes",          "near diagonals",
                                           "equators", "near chart borders", "between codes"};

/// Angle from the chord length, which stays accurate for small angles.
double error_degrees(NormalEncoding encoding, DVec3 n) {
  n = glm::normalize(n);
  const DVec3 decoded = glm::normalize(DVec3(decode_normal(encoding, encode_normal(encoding, n))));
  return 2.0 * std::asin(std::min(0.5 * glm::length(n - decoded), 1.0)) * kDegreesPerRadian;
}

Json measure_errors(NormalEncoding encoding, size_t set, size_t count) {
  std::vector<float> errors(count);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count), [&](const tbb::blocked_range<size_t>& range) {
    for (size_t i = range.begin(); i < range.end(); ++i)
      errors[i] = static_cast<float>(error_degrees(encoding, direction(set, i, encoding)));
  });
  double sum = 0.0;
  for (const float error : errors) sum += static_cast<double>(error);
  const auto rank = errors.begin() + static_cast<std::ptrdiff_t>((count - 1) * 99 / 100);
  std::nth_element(errors.begin(), rank, errors.end());
  const float p99 = *rank, max = *std::max_element(rank, errors.end());
  return {{"set", kSets[set]}, {"mean", sum / static_cast<double>(count)}, {"p99", p99}, {"max", max}};
}

/// Nanoseconds per normal on one thread, the minimum of many short runs.
Json measure_speed(NormalEncoding encoding) {
  constexpr size_t kCount = 1 << 13;
  std::vector<DVec3> normals(kCount);
  std::vector<uint32_t> codes(kCount);
  std::vector<NormalFields> fields(kCount);
  std::vector<Vec3> decoded(kCount);
  for (size_t i = 0; i < kCount; ++i) normals[i] = uniform_direction(ItemRandom(0, i));
  const auto least = [](const auto& work) {
    double best = std::numeric_limits<double>::infinity();
    for (int repeat = 0; repeat < 100; ++repeat) {
      const Stopwatch watch;
      for (size_t i = 0; i < kCount; ++i) work(i);
      best = std::min(best, watch.seconds());
    }
    return best * 1e9 / static_cast<double>(kCount);
  };
  const double encode_ns = least([&](size_t i) { codes[i] = encode_normal(encoding, normals[i]); });
  for (size_t i = 0; i < kCount; ++i) fields[i] = split_normal_code(encoding, codes[i]);
  const double decode_ns = least([&](size_t i) { decoded[i] = decode_normal(encoding, fields[i]); });
  double check = 0.0; // uses the results, so that the compiler cannot remove the work
  for (size_t i = 0; i < kCount; ++i) check += glm::dot(DVec3(decoded[i]), normals[i]);
  if (!(check > 0.99 * static_cast<double>(kCount))) throw std::runtime_error("normals do not come back");
  return {{"encode_ns", encode_ns}, {"decode_ns", decode_ns}};
}

/// Returns whether every measured error is within the format's bound.
bool measure_all(size_t count, Json& json) {
  bool kept = true;
  fmt::print("{} directions a set; degrees: mean / 99 % / max\n{:<9}", count, "");
  for (const char* set : kSets) fmt::print("{:<29}", set);
  fmt::print("encode, decode ns\n");
  for (size_t i = 0; i < kNormalFormats.size(); ++i) {
    const auto encoding = static_cast<NormalEncoding>(i);
    const NormalFormat& format = kNormalFormats[i];
    Json row{{"encoding", format.name}, {"bits", format.bits}, {"promised_max", format.max_error_degrees}};
    row["sets"] = Json::array();
    fmt::print("{:<9}", format.name);
    for (size_t set = 0; set < kSets.size(); ++set) {
      Json errors = measure_errors(encoding, set, count);
      fmt::print("{:<29}", fmt::format("{:.5f}/{:.5f}/{:.5f}", errors["mean"].get<double>(),
                                       errors["p99"].get<double>(), errors["max"].get<double>()));
      kept &= errors["max"].get<double>() <= format.max_error_degrees;
      row["sets"].push_back(std::move(errors));
    }
    row["speed"] = measure_speed(encoding);
    fmt::print("{:.1f}, {:.1f}\n", row["speed"]["encode_ns"].get<double>(), row["speed"]["decode_ns"].get<double>());
    json["encodings"].push_back(std::move(row));
  }
  return kept;
}

int run(int argc, char** argv) {
  size_t count = 10'000'000;
  std::filesystem::path json_file;
  BenchmarkOptions command_line{"Measures the error and the speed of each encoding of normals; see docs/accuracy.md."};
  command_line.add("--directions", count, "of each set").positive().show_default();
  command_line.add("--json", json_file, "writes all figures here");
  if (const std::optional<int> code = command_line.parse(argc, argv)) return *code;
  FiguresFile figures(json_file);
  Json json = describe_machine();
  json["directions"] = count;
  const bool kept = measure_all(count, json);
  figures.write(json);
  if (!kept) throw Error(ErrorKind::kLimitExceeded, "an error is larger than its format promises");
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("normal_benchmark", packtrace::run, argc, argv); }
