#include "pbrt_import/shapes/mesh_cleanup.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <string_view>

#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

/// Number of occurrences of a problem, and the first one.
struct Tally {
  uint64_t count = 0;
  uint64_t first = 0;

  void add(uint64_t where) {
    if (count++ == 0) first = where;
  }
  /// Adds a tally of later elements.
  void operator+=(const Tally& more) {
    if (count == 0) first = more.first;
    count += more.count;
  }
  /// Reports the tally as "3 triangles (the first is number 17) dropped: ...".
  void report_to(const ReportFn& report, Severity severity, std::string_view noun, std::string_view text) const {
    if (count > 0 && report) describe_to(report, severity, noun, text);
  }

private:
  void describe_to(const ReportFn& report, Severity severity, std::string_view noun, std::string_view text) const {
    std::string message = std::to_string(count);
    message.append(" ").append(noun).append(count == 1 ? " (number " : "s (the first is number ");
    message.append(std::to_string(first)).append(") ").append(text);
    report(severity, 0, std::move(message));
  }
};

/// Sums up, in order, the results of count_up(begin, end) for pieces of [0, count). Large meshes are processed in
/// parallel.
template <class CountUp>
auto add_up(size_t count, CountUp count_up) {
  constexpr size_t kPiece = 1u << 15;
  if (count <= kPiece) return count_up(size_t{0}, count);
  std::vector<decltype(count_up(size_t{0}, count))> sums((count + kPiece - 1) / kPiece);
  tbb::parallel_for(size_t{0}, sums.size(),
                    [&](size_t i) { sums[i] = count_up(i * kPiece, std::min(count, (i + 1) * kPiece)); });
  for (size_t i = 1; i < sums.size(); ++i) sums[0] += sums[i];
  return sums[0];
}

/// Uses integer arithmetic, so that the compiler vectorises the loop.
bool all_finite(const std::vector<Vec3>& points) {
  constexpr uint32_t kExponent = 0x7f800000u;
  const auto count_bad = [&](size_t begin, size_t end) {
    uint32_t bad = 0;
    for (size_t i = begin; i < end; ++i) {
      const auto is_bad = [](float f) { return uint32_t{(std::bit_cast<uint32_t>(f) & kExponent) == kExponent}; };
      bad |= is_bad(points[i].x) | is_bad(points[i].y) | is_bad(points[i].z);
    }
    return uint64_t{bad};
  };
  return add_up(points.size(), count_bad) == 0;
}

struct TriangleTallies {
  Tally out_of_range, repeated, not_finite, coincident;

  uint64_t dropped() const { return out_of_range.count + repeated.count + not_finite.count; }
  void operator+=(const TriangleTallies& more) {
    out_of_range += more.out_of_range;
    repeated += more.repeated;
    not_finite += more.not_finite;
    coincident += more.coincident;
  }
};

/// Checks single triangles.
class TriangleCheck {
public:
  explicit TriangleCheck(const std::vector<Vec3>& positions)
      : positions_(positions), all_finite_(all_finite(positions)) {}

  /// @return false if the triangle must be dropped
  bool operator()(const Triangle& t, size_t number, TriangleTallies& tallies) const {
    const std::vector<Vec3>& p = positions_;
    if (t.x >= p.size() || t.y >= p.size() || t.z >= p.size())
      tallies.out_of_range.add(number);
    else if (t.x == t.y || t.y == t.z || t.z == t.x)
      tallies.repeated.add(number);
    else if (!all_finite_ && !(is_finite(p[t.x]) && is_finite(p[t.y]) && is_finite(p[t.z])))
      tallies.not_finite.add(number);
    else {
      if (p[t.x] == p[t.y] || p[t.y] == p[t.z] || p[t.z] == p[t.x]) tallies.coincident.add(number);
      return true;
    }
    return false;
  }

private:
  const std::vector<Vec3>& positions_;
  const bool all_finite_;
};

/// Removes bad triangles and marks the vertices of the others.
uint64_t drop_triangles(Mesh& mesh, std::vector<uint8_t>& used, const ReportFn& report) {
  const TriangleCheck check(mesh.positions);
  const TriangleTallies all = add_up(mesh.triangles.size(), [&](size_t begin, size_t end) {
    TriangleTallies tallies;
    for (size_t i = begin; i < end; ++i) {
      const Triangle t = mesh.triangles[i];
      if (!check(t, i, tallies)) continue;
      for (const uint32_t vertex : {t.x, t.y, t.z}) // other threads may mark the same vertex
        std::atomic_ref(used[vertex]).store(1, std::memory_order_relaxed);
    }
    return tallies;
  });
  if (all.dropped() > 0) {
    TriangleTallies again;
    std::erase_if(mesh.triangles, [&](const Triangle& t) { return !check(t, 0, again); });
  }
  all.out_of_range.report_to(report, Severity::kWarning, "triangle", "dropped: vertex index out of range");
  all.repeated.report_to(report, Severity::kWarning, "triangle", "dropped: repeated vertex index");
  all.not_finite.report_to(report, Severity::kWarning, "triangle", "dropped: vertex position not finite");
  all.coincident.report_to(report, Severity::kNote, "triangle", "without area kept: two corners coincide");
  return all.dropped();
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

/// Sets the marked normals to the area-weighted mean of the adjacent face normals, or to +z if that is zero.
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

bool is_unit(Vec3 n) {
  constexpr float kUnitTolerance = 4e-7f; // for the squared length: a few roundings of a float unit vector
  return std::abs(glm::dot(n, n) - 1.0f) <= kUnitTolerance;
}

/// Normalises a normal; returns false and leaves it unchanged if its length is zero.
bool make_unit(Vec3& n) {
  if (is_unit(n)) return true;
  const DVec3 wide(n);
  const double length = glm::length(wide); // cannot overflow: the components are floats
  if (!(length > 0.0 && std::isfinite(length))) return false;
  n = Vec3(wide / length);
  return true;
}

void fix_normals(Mesh& mesh, const ReportFn& report) {
  const Tally tally = add_up(mesh.normals.size(), [&](size_t begin, size_t end) {
    Tally bad;
    for (size_t i = begin; i < end; ++i)
      if (!make_unit(mesh.normals[i])) bad.add(i);
    return bad;
  });
  if (tally.count == 0) return;
  std::vector<uint8_t> bad(mesh.normals.size());
  for (size_t i = tally.first; i < bad.size(); ++i) bad[i] = !make_unit(mesh.normals[i]);
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

bool is_clean(const Mesh& mesh) {
  constexpr size_t kMaxVertices = 511;
  const std::vector<Vec3>& p = mesh.positions;
  const auto fits = [&](size_t count) { return count == 0 || count == p.size(); };
  if (p.size() > kMaxVertices || mesh.triangles.empty() || !fits(mesh.normals.size()) || !fits(mesh.uvs.size()))
    return false;
  std::array<uint64_t, kMaxVertices / 64 + 1> used;
  std::fill_n(used.begin(), p.size() / 64 + 1, uint64_t{0});
  for (const Triangle& t : mesh.triangles) {
    if (t.x >= p.size() || t.y >= p.size() || t.z >= p.size()) return false;
    // Equal indices have equal positions. NaN differ, but are not finite.
    if (p[t.x] == p[t.y] || p[t.y] == p[t.z] || p[t.z] == p[t.x]) return false;
    if (t.x == t.y || t.y == t.z || t.z == t.x) return false;
    for (const uint32_t vertex : {t.x, t.y, t.z}) used[vertex / 64] |= uint64_t{1} << vertex % 64;
  }
  const auto all_used = [&] {
    for (size_t word = 0; word < p.size() / 64; ++word)
      if (~used[word] != 0) return false;
    return used[p.size() / 64] == (uint64_t{1} << p.size() % 64) - 1;
  };
  const auto finite_uv = [](Vec2 uv) { return std::isfinite(uv.x) && std::isfinite(uv.y); };
  return all_used() && all_finite(p) && std::all_of(mesh.normals.begin(), mesh.normals.end(), is_unit) &&
         std::all_of(mesh.uvs.begin(), mesh.uvs.end(), finite_uv);
}

uint64_t clean_up_mesh(Mesh& mesh, const ReportFn& report) {
  check_count(mesh.normals, mesh.positions.size(), "normals", report);
  check_count(mesh.uvs, mesh.positions.size(), "uvs", report);
  std::vector<uint8_t> used(mesh.positions.size());
  const uint64_t dropped = drop_triangles(mesh, used, report);
  drop_unused_vertices(mesh, used);
  fix_normals(mesh, report);
  const Tally bad_uvs = add_up(mesh.uvs.size(), [&](size_t begin, size_t end) {
    Tally bad;
    for (size_t i = begin; i < end; ++i) {
      Vec2& uv = mesh.uvs[i];
      if (std::isfinite(uv.x) && std::isfinite(uv.y)) continue;
      uv = Vec2(0.0f);
      bad.add(i);
    }
    return bad;
  });
  bad_uvs.report_to(report, Severity::kWarning, "uv", "not finite: set to zero");
  return dropped;
}

} // namespace packtrace
