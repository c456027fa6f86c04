#include "runtime/measure/surface_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>

#include <nlohmann/json.hpp>
#include <tbb/parallel_for.h>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/angle.h"
#include "pbrt_import/scene/bounds.h"
#include "runtime/measure/nearest_surface.h"

namespace packtrace {
namespace {

constexpr uint64_t kMinSamples = 16;

/// Two geometries that are compared under one transform each.
struct Pair {
  uint32_t source_geometry = 0, packed_geometry = 0;
  uint32_t instance = 0; ///< the one with the largest transform
  double scale = 0.0;
  uint64_t count = 0;
};

std::vector<Pair> pairs_of(const SceneSource& source, const SceneSource& packed) {
  if (source.instances().size() != packed.instances().size())
    throw Error(ErrorKind::kInput, "the file was not baked from this scene: it has " +
                                       std::to_string(packed.instances().size()) + " instances instead of " +
                                       std::to_string(source.instances().size()));
  std::map<std::pair<uint32_t, uint32_t>, Pair> pairs;
  for (uint32_t i = 0; i < source.instances().size(); ++i) {
    const PlacedGeometry& s = source.instances()[i];
    const uint32_t p = packed.instances()[i].geometry;
    Pair& pair = pairs[{s.geometry, p}];
    const double scale = std::abs(glm::determinant(glm::dmat3(DAffine(s.world_from_object))));
    if (pair.count++ > 0 && scale <= pair.scale) continue;
    pair.source_geometry = s.geometry, pair.packed_geometry = p, pair.instance = i, pair.scale = scale;
  }
  std::vector<Pair> list;
  for (const auto& [key, pair] : pairs) list.push_back(pair);
  return list;
}

/// A placed geometry in coordinates within [-1, 1].
struct Surface {
  const SceneSource* scene = nullptr;
  uint32_t geometry = 0;
  DAffine world_from_object{1.0};
  glm::dmat3 world_normal{1.0};
  std::vector<DVec3> positions; ///< world space until normalise()
  std::vector<Triangle> triangles;
  std::vector<double> area_before; ///< prefix sums over triangles, one more than triangles; world units squared

  Surface(const SceneSource& from, uint32_t instance)
      : scene(&from), geometry(from.instances()[instance].geometry),
        world_from_object(from.instances()[instance].world_from_object),
        world_normal(normal_matrix(world_from_object)) {
    world_from_object[3] += from.origin();
    const GeometryCounts counts = from.counts(geometry);
    std::vector<Vec3> decoded(counts.vertices);
    triangles.resize(counts.triangles);
    from.decode(geometry, decoded, triangles);
    positions.reserve(counts.vertices);
    for (const Vec3 p : decoded) positions.push_back(transform_point(world_from_object, DVec3(p)));
    area_before.push_back(0.0);
    for (const Triangle t : triangles) area_before.push_back(area_before.back() + 0.5 * glm::length(face_normal(t)));
  }

  double area() const { return area_before.back(); }

  DVec3 face_normal(Triangle t) const {
    return glm::cross(positions[t.y] - positions[t.x], positions[t.z] - positions[t.x]);
  }

  DVec3 point(uint32_t triangle, Vec2 b) const {
    const Triangle t = triangles[triangle];
    const double v = static_cast<double>(b.x), w = static_cast<double>(b.y);
    return (1.0 - v - w) * positions[t.x] + v * positions[t.y] + w * positions[t.z];
  }

  DVec3 normal(uint32_t triangle, Vec2 barycentrics) const {
    const auto shading = scene->shading_normal(geometry, triangle, barycentrics);
    return shading ? world_normal * DVec3(*shading) : face_normal(triangles[triangle]);
  }

  void normalise(DVec3 centre, double extent) {
    for (DVec3& p : positions) p = (p - centre) / extent;
  }
};

/// What the samples of one direction of a pair measure.
struct Samples {
  std::vector<double> distance, degrees;
  double area = 0.0; ///< that the samples represent
};

uint64_t mixed(uint64_t x) { // splitmix64
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

double unit(uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

double angle_between(DVec3 a, DVec3 b) {
  if (!(glm::dot(a, a) > 0.0) || !(glm::dot(b, b) > 0.0)) return 0.0;
  const double angle = angle_degrees(glm::normalize(a), glm::normalize(b));
  return std::min(angle, 180.0 - angle); // tracing turns normals towards the viewer
}

Samples sample(const Surface& from, const Surface& to, const NearestSurface& nearest, uint64_t count, double extent) {
  Samples samples{std::vector<double>(count), std::vector<double>(count), from.area()};
  tbb::parallel_for(uint64_t{0}, count, [&](uint64_t k) {
    const double place = (static_cast<double>(k) + unit(mixed(3 * k))) / static_cast<double>(count) * from.area();
    const auto above = std::upper_bound(from.area_before.begin(), from.area_before.end(), place);
    const auto triangle = static_cast<uint32_t>(std::clamp<std::ptrdiff_t>(
        above - from.area_before.begin() - 1, 0, static_cast<std::ptrdiff_t>(from.triangles.size()) - 1));
    const double root = std::sqrt(unit(mixed(3 * k + 1))), other = unit(mixed(3 * k + 2));
    const Vec2 b(static_cast<float>(root * (1.0 - other)), static_cast<float>(root * other));
    const NearestPoint found = nearest.nearest(from.point(triangle, b));
    samples.distance[k] = found.distance * extent;
    samples.degrees[k] = angle_between(from.normal(triangle, b), to.normal(found.triangle, found.barycentrics));
  });
  return samples;
}

struct PairError {
  Samples to_packed, to_source;
  uint64_t missing = 0;
};

PairError compare(const Pair& pair, const SceneSource& source, const SceneSource& packed, double samples_per_area,
                  EmbreeDevice& device) {
  PairError error;
  Surface from(source, pair.instance), to(packed, pair.instance);
  error.missing = !from.triangles.empty() && to.triangles.empty();
  if (from.triangles.empty() || to.triangles.empty()) return error;
  Bounds bounds;
  for (const Surface* s : {&from, &to})
    for (const DVec3 p : s->positions) bounds.extend(p);
  const double extent = std::max(0.5 * bounds.diagonal(), std::numeric_limits<double>::min());
  const auto samples = [&](const Surface& s) {
    return std::max(kMinSamples, static_cast<uint64_t>(samples_per_area * s.area() * static_cast<double>(pair.count)));
  };
  const uint64_t from_samples = samples(from), to_samples = samples(to);
  from.normalise(bounds.centre(), extent), to.normalise(bounds.centre(), extent);
  const NearestSurface nearest_source(device, from.positions, from.triangles),
      nearest_packed(device, to.positions, to.triangles);
  error.to_packed = sample(from, to, nearest_packed, from_samples, extent);
  error.to_source = sample(to, from, nearest_source, to_samples, extent);
  for (Samples* s : {&error.to_packed, &error.to_source}) s->area *= static_cast<double>(pair.count);
  return error;
}

double largest(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

/// Mean of f over the samples of all pairs, weighted by the area that they represent.
template <class Function>
double area_mean(std::span<const PairError> errors, Samples PairError::* side, std::vector<double> Samples::* values,
                 const Function& f) {
  double sum = 0.0, area = 0.0;
  for (const PairError& error : errors) {
    const Samples& s = error.*side;
    if ((s.*values).empty()) continue;
    double pair_sum = 0.0;
    for (const double value : s.*values) pair_sum += f(value);
    sum += pair_sum / static_cast<double>((s.*values).size()) * s.area;
    area += s.area;
  }
  return area > 0.0 ? sum / area : 0.0;
}

SurfaceDistance distance_of(std::span<const PairError> errors, Samples PairError::* side) {
  SurfaceDistance result;
  for (const PairError& error : errors) result.max = std::max(result.max, largest((error.*side).distance));
  result.mean = area_mean(errors, side, &Samples::distance, [](double d) { return d; });
  result.rms = std::sqrt(area_mean(errors, side, &Samples::distance, [](double d) { return d * d; }));
  return result;
}

std::vector<GeometryError> by_geometry(std::span<const Pair> pairs, std::span<const PairError> errors,
                                       const BakedFile& file) {
  std::vector<GeometryError> geometries;
  for (uint32_t g = 0; g < file.base_geometry_count(); ++g) {
    const baked::GeometryRecord& record = file.geometries()[g];
    GeometryError error;
    error.name = file.text(record.name), error.geometry = g, error.triangles = record.triangle_count;
    error.bytes = record.payload_bytes + uint64_t{record.cluster_count} * sizeof(baked::ClusterRecord) + sizeof record;
    geometries.push_back(std::move(error));
  }
  for (size_t i = 0; i < pairs.size(); ++i)
    for (const Samples* s : {&errors[i].to_packed, &errors[i].to_source}) {
      GeometryError& error = geometries[pairs[i].packed_geometry];
      error.max_distance = std::max(error.max_distance, largest(s->distance));
      error.max_normal_degrees = std::max(error.max_normal_degrees, largest(s->degrees));
    }
  return geometries;
}

double total_area(std::span<const Pair> pairs, const SceneSource& source) {
  std::vector<double> areas(pairs.size());
  tbb::parallel_for(size_t{0}, pairs.size(), [&](size_t i) {
    areas[i] = Surface(source, pairs[i].instance).area() * static_cast<double>(pairs[i].count);
  });
  double sum = 0.0;
  for (const double area : areas) sum += area;
  return sum;
}

} // namespace

SurfaceError surface_error(const SceneSource& source, const SceneSource& packed, const BakedFile& file,
                           uint64_t sample_count, const MemoryBudget& memory, Progress& progress) {
  const std::vector<Pair> pairs = pairs_of(source, packed);
  SurfaceError result;
  const double area = total_area(pairs, source);
  result.samples_per_area = area > 0.0 ? static_cast<double>(sample_count) / area : 0.0;
  EmbreeDevice device(memory);
  std::vector<PairError> errors(pairs.size());
  progress.begin("comparing surfaces", pairs.size());
  tbb::parallel_for(size_t{0}, pairs.size(), [&](size_t i) {
    errors[i] = compare(pairs[i], source, packed, result.samples_per_area, device);
    progress.advance();
  });
  result.to_packed = distance_of(errors, &PairError::to_packed);
  result.to_source = distance_of(errors, &PairError::to_source);
  std::vector<double> distances, degrees;
  for (const PairError& error : errors) {
    result.samples += error.to_packed.distance.size();
    result.missing_geometries += error.missing;
    for (const Samples* s : {&error.to_packed, &error.to_source}) {
      distances.insert(distances.end(), s->distance.begin(), s->distance.end());
      degrees.insert(degrees.end(), s->degrees.begin(), s->degrees.end());
    }
  }
  const auto same = [](double d) { return d; };
  result.max_normal_degrees = largest(degrees);
  result.mean_normal_degrees = 0.5 * (area_mean(errors, &PairError::to_packed, &Samples::degrees, same) +
                                      area_mean(errors, &PairError::to_source, &Samples::degrees, same));
  result.distance = make_histogram(distances, "world units");
  result.normal = make_histogram(degrees, "degrees");
  result.geometries = by_geometry(pairs, errors, file);
  return result;
}

namespace {

nlohmann::json worst(std::vector<GeometryError> geometries, double (*value)(const GeometryError&)) {
  constexpr size_t kShown = 10;
  std::ranges::stable_sort(geometries,
                           [&](const GeometryError& a, const GeometryError& b) { return value(a) > value(b); });
  nlohmann::json list = nlohmann::json::array();
  for (const GeometryError& g : std::span(geometries).first(std::min(kShown, geometries.size())))
    list.push_back({{"name", g.name},
                    {"geometry", g.geometry},
                    {"triangles", g.triangles},
                    {"bytes", g.bytes},
                    {"max_distance", g.max_distance},
                    {"max_normal_degrees", g.max_normal_degrees}});
  return list;
}

nlohmann::json to_json(const SurfaceDistance& distance) {
  return {{"max", distance.max}, {"mean", distance.mean}, {"rms", distance.rms}};
}

} // namespace

nlohmann::json to_json(const SurfaceError& error) {
  return {
      {"distance",
       {{"to_packed", to_json(error.to_packed)},
        {"to_source", to_json(error.to_source)},
        {"samples", error.samples},
        {"samples_per_area", error.samples_per_area}}},
      {"normal",
       {{"sampled_max_degrees", error.max_normal_degrees}, {"sampled_mean_degrees", error.mean_normal_degrees}}},
      {"histograms", {{"position", to_json(error.distance)}, {"normal", to_json(error.normal)}}},
      {"worst_geometries",
       {{"by_error", worst(error.geometries, [](const GeometryError& g) { return g.max_distance; })},
        {"by_bytes", worst(error.geometries, [](const GeometryError& g) { return static_cast<double>(g.bytes); })}}},
      {"missing_geometries", error.missing_geometries}};
}

} // namespace packtrace
