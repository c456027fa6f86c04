#include "compress/bake/clusters/normal_quantizer.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "compress/bake/clusters/error_stats.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/angle.h"

namespace packtrace {
namespace {

/// Encodings to choose from, with ascending numbers of bits.
constexpr std::array<NormalEncoding, 4> kChoice{NormalEncoding::kAxis12, NormalEncoding::kAxis16,
                                                NormalEncoding::kOct20, NormalEncoding::kAxis24};

/// Returns 0 for a zero vector.
DVec3 safe_normalize(DVec3 v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(largest > 0.0)) return DVec3(0.0);
  v /= largest;
  return v / glm::length(v);
}

/// Unit normal of the decoded triangle; zero if it has no area.
DVec3 face_normal(const QuantizedPart& work, const Triangle& t) {
  const LatticePoint &a = work.lattice[t.x], &b = work.lattice[t.y], &c = work.lattice[t.z];
  DVec3 ab, ac;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<size_t>(axis);
    ab[axis] = static_cast<double>(b[i] - a[i]);
    ac[axis] = static_cast<double>(c[i] - a[i]);
  }
  return safe_normalize(glm::cross(ab, ac));
}

void add_normal_errors(const ErrorStats& errors, QuantizeStats& stats) {
  stats.max_normal_error_degrees = std::max(stats.max_normal_error_degrees, errors.max);
  stats.normal_error_sum += errors.sum;
  stats.normal_count += errors.count;
}

/// Replaces each zero normal by the face normal of a triangle that uses it.
void repair_normals(QuantizedPart& work) {
  for (const Triangle& t : work.triangles)
    for (int corner = 0; corner < 3; ++corner)
      if (DVec3& n = work.normals[t[corner]]; n == DVec3(0.0)) n = face_normal(work, t);
  for (DVec3& n : work.normals)
    if (n == DVec3(0.0)) n = DVec3(0.0, 0.0, 1.0);
}

double decoded_error(DVec3 normal, Vec3 decoded) { return angle_degrees(normal, glm::normalize(DVec3(decoded))); }

bool keeps_error(NormalEncoding encoding, const QuantizedPart& work, double max_error_degrees) {
  if (format_of(encoding).max_error_degrees <= max_error_degrees) return true;
  std::atomic<bool> kept{true};
  for_each_item(work.normals.size(), [&](size_t i) {
    if (work.smooth[i] == 0 || !kept.load(std::memory_order_relaxed)) return;
    if (decoded_error(work.normals[i], find_nearest_normal(encoding, work.normals[i]).decoded) > max_error_degrees)
      kept.store(false, std::memory_order_relaxed);
  });
  return kept;
}

} // namespace

void quantize_normals(const GeometryPart& part, const Mesh& mesh, QuantizedPart& work, QuantizeStats& stats) {
  if (mesh.normals.size() != mesh.positions.size())
    throw Error(ErrorKind::kInput, mesh.name + ": normals and positions differ in number");
  const glm::dmat3 matrix = normal_matrix(part.geometry_from_mesh);
  work.normals.resize(mesh.normals.size());
  std::atomic<uint64_t> zeros{0};
  std::atomic<bool> finite{true};
  for_each_item(mesh.normals.size(), [&](size_t i) {
    if (!is_finite(mesh.normals[i])) finite.store(false, std::memory_order_relaxed);
    work.normals[i] = safe_normalize(matrix * DVec3(mesh.normals[i]));
    if (work.normals[i] == DVec3(0.0)) zeros.fetch_add(1, std::memory_order_relaxed);
  });
  if (!finite) throw Error(ErrorKind::kInput, mesh.name + ": a normal is not finite");
  if (zeros > 0) repair_normals(work);
  stats.repaired_normals += zeros;
  work.flat.assign(work.triangles.size(), 0);
}

void find_flat_triangles(double flat_degrees, QuantizedPart& work) {
  // Slightly reduced, so that rounding never lifts a measured angle above the limit.
  const double flat_chord = 2.0 * std::sin(flat_degrees / kDegreesPerRadian * 0.5) * (1.0 - 1e-9);
  const auto near = [&](const Triangle& t, DVec3 n) {
    for (int corner = 0; corner < 3; ++corner) {
      const DVec3 d = work.normals[t[corner]] - n;
      if (!(glm::dot(d, d) <= flat_chord * flat_chord)) return false;
    }
    return true;
  };
  for_each_item(work.triangles.size(), [&](size_t i) {
    if (!work.stays(i)) return;
    const Triangle& t = work.triangles[i];
    const DVec3 n = face_normal(work, t);
    work.flat[i] = near(t, n) || near(t, -n); // either side: tracing turns normals to the viewer
  });
}

void find_smooth_normals(QuantizedPart& work, QuantizeStats& stats) {
  const ErrorStats flat_errors = accumulate_errors(work.triangles.size(), [&](size_t i, ErrorStats& errors) {
    if (work.flat[i] == 0 || !work.stays(i)) return;
    const Triangle& t = work.triangles[i];
    const DVec3 n = face_normal(work, t);
    const double sign = glm::dot(work.normals[t.x], n) < 0.0 ? -1.0 : 1.0;
    for (int corner = 0; corner < 3; ++corner) errors.add(angle_degrees(work.normals[t[corner]], sign * n));
  });
  stats.flat_triangles += flat_errors.count / 3;
  add_normal_errors(flat_errors, stats);
  work.smooth.assign(work.normals.size(), 0);
  for (size_t i = 0; i < work.triangles.size(); ++i)
    for (int corner = 0; corner < 3 && work.flat[i] == 0 && work.stays(i); ++corner)
      work.smooth[work.triangles[i][corner]] = 1;
}

uint32_t expected_normal_bits(double max_error_degrees) {
  for (const NormalEncoding encoding : kChoice)
    if (format_of(encoding).max_error_degrees <= max_error_degrees) return format_of(encoding).bits;
  return format_of(NormalEncoding::kAxis32).bits;
}

NormalEncoding choose_normal_encoding(std::span<const QuantizedPart> parts, double max_error_degrees) {
  for (const NormalEncoding encoding : kChoice)
    if (std::all_of(parts.begin(), parts.end(),
                    [&](const QuantizedPart& part) { return keeps_error(encoding, part, max_error_degrees); }))
      return encoding;
  return NormalEncoding::kAxis32;
}

void encode_normals(NormalEncoding encoding, QuantizedPart& work, QuantizeStats& stats) {
  work.codes.assign(work.normals.size(), 0);
  add_normal_errors(accumulate_errors(work.normals.size(),
                                      [&](size_t i, ErrorStats& errors) {
                                        if (work.smooth[i] == 0) return;
                                        const NearestNormal near = find_nearest_normal(encoding, work.normals[i]);
                                        work.codes[i] = near.code;
                                        errors.add(decoded_error(work.normals[i], near.decoded));
                                      }),
                    stats);
}

double normal_encoding_error(NormalEncoding encoding, DVec3 normal, uint32_t code) {
  return decoded_error(normal, decode_normal(encoding, code));
}

} // namespace packtrace
