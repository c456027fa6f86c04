#include "pbrt_import/shapes/mesh_cleanup.h"

#include <algorithm>
#include <bit>
#include <string_view>

namespace packtrace {
namespace {

/// How often something happened, and where first.
struct Tally {
  uint64_t count = 0;
  uint64_t first = 0;

  void add(uint64_t where) {
    if (count++ == 0) first = where;
  }
  /// "3 triangles (the first is number 17) dropped: ..."
  void report_to(const ReportFn& report, Severity severity, std::string_view noun, std::string_view text) const {
    if (count == 0 || !report) return;
    std::string message = std::to_string(count);
    message.append(" ").append(noun).append(count == 1 ? " (number " : "s (the first is number ");
    message.append(std::to_string(first)).append(") ").append(text);
    report(severity, 0, std::move(message));
  }
};

/// Integer arithmetic, so that the compiler vectorises the loop.
bool all_finite(const std::vector<Vec3>& points) {
  constexpr uint32_t kExponent = 0x7f800000u;
  uint32_t bad = 0;
  for (const Vec3& p : points) {
    const auto is_bad = [](float f) { return uint32_t{(std::bit_cast<uint32_t>(f) & kExponent) == kExponent}; };
    bad |= is_bad(p.x) | is_bad(p.y) | is_bad(p.z);
  }
  return bad == 0;
}

/// Removes bad triangles and marks the vertices of the others.
uint64_t drop_triangles(Mesh& mesh, std::vector<uint8_t>& used, const ReportFn& report) {
  const std::vector<Vec3>& p = mesh.positions;
  const bool check_finite = !all_finite(p);
  Tally out_of_range, repeated, not_finite, coincident;
  size_t kept = 0;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle t = mesh.triangles[i];
    if (t.x >= p.size() || t.y >= p.size() || t.z >= p.size()) {
      out_of_range.add(i);
    } else if (t.x == t.y || t.y == t.z || t.z == t.x) {
      repeated.add(i);
    } else if (check_finite && !(is_finite(p[t.x]) && is_finite(p[t.y]) && is_finite(p[t.z]))) {
      not_finite.add(i);
    } else {
      if (p[t.x] == p[t.y] || p[t.y] == p[t.z] || p[t.z] == p[t.x]) coincident.add(i);
      used[t.x] = used[t.y] = used[t.z] = 1;
      mesh.triangles[kept++] = t;
    }
  }
  const uint64_t dropped = mesh.triangles.size() - kept;
  mesh.triangles.resize(kept);
  out_of_range.report_to(report, Severity::kWarning, "triangle", "dropped: vertex index out of range");
  repeated.report_to(report, Severity::kWarning, "triangle", "dropped: repeated vertex index");
  not_finite.report_to(report, Severity::kWarning, "triangle", "dropped: vertex position not finite");
  coincident.report_to(report, Severity::kNote, "triangle", "without area kept: two corners coincide");
  return dropped;
}

template <class T>
void keep_used(std::vector<T>& attribute, const std::vector<uint8_t>& used) {
  if (attribute.empty()) return;
  size_t kept = 0;
  for (size_t i = 0; i < used.size(); ++i)
    if (used[i]) attribute[kept++] = attribute[i];
  attribute.resize(kept);
}

void drop_unused_vertices(Mesh& mesh, const std::vector<uint8_t>& used) {
  if (std::find(used.begin(), used.end(), uint8_t{0}) == used.end()) return;
  std::vector<uint32_t> new_index(used.size());
  uint32_t next = 0;
  for (size_t i = 0; i < used.size(); ++i) {
    new_index[i] = next;
    next += used[i];
  }
  for (Triangle& t : mesh.triangles) t = Triangle(new_index[t.x], new_index[t.y], new_index[t.z]);
  keep_used(mesh.positions, used);
  keep_used(mesh.normals, used);
  keep_used(mesh.uvs, used);
}

/// Sets the marked normals to the area-weighted mean of the faces around them; +z where those cancel or have no area.
void normals_from_faces(Mesh& mesh, const std::vector<uint8_t>& marked) {
  std::vector<DVec3> sums(marked.size(), DVec3(0.0));
  for (const Triangle& t : mesh.triangles) {
    if (!(marked[t.x] || marked[t.y] || marked[t.z])) continue;
    const DVec3 p0(mesh.positions[t.x]), p1(mesh.positions[t.y]), p2(mesh.positions[t.z]);
    const DVec3 area = glm::cross(p1 - p0, p2 - p0);
    for (int k = 0; k < 3; ++k) sums[t[k]] += area;
  }
  for (size_t i = 0; i < marked.size(); ++i) {
    if (!marked[i]) continue;
    const double length = glm::length(sums[i]);
    mesh.normals[i] = length > 0.0 && std::isfinite(length) ? Vec3(sums[i] / length) : Vec3(0.0f, 0.0f, 1.0f);
  }
}

void fix_normals(Mesh& mesh, const ReportFn& report) {
  constexpr float kUnitTolerance = 4e-7f; // on the squared length; a few roundings of a float unit vector
  std::vector<uint8_t> bad;
  Tally tally;
  for (size_t i = 0; i < mesh.normals.size(); ++i) {
    Vec3& n = mesh.normals[i];
    if (std::abs(glm::dot(n, n) - 1.0f) <= kUnitTolerance) continue;
    const DVec3 wide(n);
    const double length = glm::length(wide); // cannot overflow: the components are floats
    if (length > 0.0 && std::isfinite(length)) {
      n = Vec3(wide / length);
    } else {
      if (bad.empty()) bad.resize(mesh.normals.size());
      bad[i] = 1;
      tally.add(i);
    }
  }
  if (tally.count == 0) return;
  normals_from_faces(mesh, bad);
  tally.report_to(report, Severity::kWarning, "vertex normal", "zero or not finite: recomputed from the faces around");
}

template <class T>
void check_count(std::vector<T>& attribute, size_t vertex_count, std::string_view noun, const ReportFn& report) {
  if (attribute.empty() || attribute.size() == vertex_count) return;
  if (report)
    report(Severity::kWarning, 0,
           std::to_string(attribute.size()) + " " + std::string(noun) + " for " + std::to_string(vertex_count) +
               " vertices: ignored");
  attribute = {};
}

} // namespace

uint64_t drop_bad_triangles(Mesh& mesh, const ReportFn& report) {
  check_count(mesh.normals, mesh.positions.size(), "normals", report);
  check_count(mesh.uvs, mesh.positions.size(), "uvs", report);
  std::vector<uint8_t> used(mesh.positions.size());
  const uint64_t dropped = drop_triangles(mesh, used, report);
  drop_unused_vertices(mesh, used);
  fix_normals(mesh, report);
  Tally bad_uvs;
  for (size_t i = 0; i < mesh.uvs.size(); ++i) {
    Vec2& uv = mesh.uvs[i];
    if (std::isfinite(uv.x) && std::isfinite(uv.y)) continue;
    uv = Vec2(0.0f);
    bad_uvs.add(i);
  }
  bad_uvs.report_to(report, Severity::kWarning, "uv", "not finite: set to zero");
  return dropped;
}

} // namespace packtrace
