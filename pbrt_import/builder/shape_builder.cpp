#include "pbrt_import/builder/shape_builder.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "pbrt_import/base/error.h"
#include "pbrt_import/shapes/curve.h"
#include "pbrt_import/shapes/heightfield.h"
#include "pbrt_import/shapes/mesh_cleanup.h"
#include "pbrt_import/shapes/nurbs.h"
#include "pbrt_import/shapes/quadrics.h"
#include "pbrt_import/shapes/subdivision.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

/// Groups components into vectors; an incomplete last group is ignored.
template <class Vector>
std::vector<Vector> grouped(std::span<const float> components) {
  static_assert(sizeof(Vector) % sizeof(float) == 0);
  const size_t count = components.size() * sizeof(float) / sizeof(Vector);
  std::vector<Vector> vectors;
  if (count == 0) return vectors;
  reserve_large(vectors, count);
  vectors.resize(count);
  std::memcpy(vectors.data(), components.data(), count * sizeof(Vector));
  return vectors;
}

/// Like grouped(), for a parameter whose type does not imply the group size. Reports an incomplete last group.
template <class Vector>
std::vector<Vector> read_groups(const ParameterList& parameters, std::string_view name, ParameterType type,
                                const ReportFn& report) {
  const std::span<const float> values = parameters.floats(name, type);
  constexpr size_t kGroup = sizeof(Vector) / sizeof(float);
  if (const size_t excess = values.size() % kGroup)
    report(Severity::kWarning, 0,
           "parameter " + in_quotes(name) + " takes values in groups of " + std::to_string(kGroup) + ", found " +
               std::to_string(values.size()) + "; the last " + std::to_string(excess) + " are ignored");
  return grouped<Vector>(values);
}

std::vector<Vec2> read_uvs(const ParameterList& parameters, const ReportFn& report) {
  for (const ParameterType type : {ParameterType::kPoint2, ParameterType::kFloat})
    for (const std::string_view name : {"uv", "st"})
      if (std::vector<Vec2> uvs = read_groups<Vec2>(parameters, name, type, report); !uvs.empty()) return uvs;
  return {};
}

/// Takes the index triples. Negative indices become large unsigned ones, which are out of range for every mesh.
std::vector<Triangle> take_triangles(ParameterList& parameters, const ReportFn& report) {
  const size_t count = parameters.integers("indices").size();
  if (count == 0) throw Error(ErrorKind::kInput, "no \"integer indices\"");
  if (count % 3 != 0)
    report(Severity::kWarning, 0,
           "the number of indices, " + std::to_string(count) + ", is not a multiple of 3; the last ones are ignored");
  return parameters.take_triangles("indices");
}

std::vector<Vec3> take_points(ParameterList& parameters) {
  std::vector<Vec3> points = parameters.take_vectors("P", ParameterType::kPoint3);
  if (points.empty()) throw Error(ErrorKind::kInput, "no \"point P\"");
  return points;
}

uint32_t count_of(const ParameterList& parameters, std::string_view name, int32_t fallback) {
  const int32_t count = parameters.get_integer(name, fallback);
  if (count < 0) throw Error(ErrorKind::kInput, "negative " + in_quotes(name));
  return static_cast<uint32_t>(count);
}

MeshJob read_triangle_mesh(ParameterList& parameters, const ReportFn& report) {
  constexpr std::string_view kUnneeded[] = {"S", "faceIndices", "discarddegenerateUVs"};
  parameters.mark_used(kUnneeded);
  MeshJob job;
  Mesh& mesh = job.given;
  mesh.triangles = take_triangles(parameters, report);
  mesh.positions = take_points(parameters);
  if (mesh.positions.size() >= std::numeric_limits<uint32_t>::max())
    throw Error(ErrorKind::kLimitExceeded, "more than 2^32 - 2 vertices");
  mesh.normals = parameters.take_vectors("N", ParameterType::kNormal);
  mesh.uvs = read_uvs(parameters, report);
  job.bytes_at_most = bytes_of(mesh);
  return job;
}

/// Creates the job of a quadric. The key for equal meshes consists of the quadric's kind and parameters.
template <class Quadric>
MeshJob quadric_job(std::string_view kind, const Quadric& quadric,
                    Mesh (*tessellate)(const Quadric&, double, MemoryReservation*)) {
  static_assert(std::is_trivially_copyable_v<Quadric> && sizeof(Quadric) % sizeof(float) == 0);
  MeshJob job;
  job.make = [=](ShapeContext& context) { return tessellate(quadric, context.tessellation_tolerance, context.memory); };
  job.same_as = kind;
  job.same_as.append(reinterpret_cast<const char*>(&quadric), sizeof quadric);
  return job;
}

MeshJob read_sphere(ParameterList& parameters, const ReportFn&) {
  SphereParameters sphere;
  sphere.radius = parameters.get_float("radius", 1.0f);
  sphere.z_min = parameters.get_float("zmin", -sphere.radius);
  sphere.z_max = parameters.get_float("zmax", sphere.radius);
  sphere.phi_max = parameters.get_float("phimax", 360.0f);
  // Whole spheres only differ in scale, so that scenes with many spheres share one mesh.
  const bool whole =
      std::min(sphere.z_min, sphere.z_max) <= -sphere.radius && std::max(sphere.z_min, sphere.z_max) >= sphere.radius;
  const double scale = whole && sphere.radius > 0.0f && std::isfinite(sphere.radius) ? sphere.radius : 1.0;
  if (scale != 1.0) sphere = {1.0f, -1.0f, 1.0f, sphere.phi_max};
  MeshJob job = quadric_job("sphere", sphere, tessellate_sphere);
  job.scale = scale;
  return job;
}

MeshJob read_cylinder(ParameterList& parameters, const ReportFn&) {
  CylinderParameters cylinder;
  cylinder.radius = parameters.get_float("radius", 1.0f);
  cylinder.z_min = parameters.get_float("zmin", -1.0f);
  cylinder.z_max = parameters.get_float("zmax", 1.0f);
  cylinder.phi_max = parameters.get_float("phimax", 360.0f);
  return quadric_job("cylinder", cylinder, tessellate_cylinder);
}

MeshJob read_disk(ParameterList& parameters, const ReportFn&) {
  DiskParameters disk;
  disk.height = parameters.get_float("height", 0.0f);
  disk.radius = parameters.get_float("radius", 1.0f);
  disk.inner_radius = parameters.get_float("innerradius", 0.0f);
  disk.phi_max = parameters.get_float("phimax", 360.0f);
  return quadric_job("disk", disk, tessellate_disk);
}

MeshJob read_cone(ParameterList& parameters, const ReportFn&) {
  ConeParameters cone;
  cone.radius = parameters.get_float("radius", 1.0f);
  cone.height = parameters.get_float("height", 1.0f);
  cone.phi_max = parameters.get_float("phimax", 360.0f);
  return quadric_job("cone", cone, tessellate_cone);
}

MeshJob read_paraboloid(ParameterList& parameters, const ReportFn&) {
  ParaboloidParameters paraboloid;
  paraboloid.radius = parameters.get_float("radius", 1.0f);
  paraboloid.z_min = parameters.get_float("zmin", 0.0f);
  paraboloid.z_max = parameters.get_float("zmax", 1.0f);
  paraboloid.phi_max = parameters.get_float("phimax", 360.0f);
  return quadric_job("paraboloid", paraboloid, tessellate_paraboloid);
}

MeshJob read_hyperboloid(ParameterList& parameters, const ReportFn&) {
  HyperboloidParameters hyperboloid;
  hyperboloid.p1 = parameters.get_point("p1", hyperboloid.p1);
  hyperboloid.p2 = parameters.get_point("p2", hyperboloid.p2);
  hyperboloid.phi_max = parameters.get_float("phimax", 360.0f);
  return quadric_job("hyperboloid", hyperboloid, tessellate_hyperboloid);
}

MeshJob read_loop_subdivision(ParameterList& parameters, const ReportFn& report) {
  constexpr std::string_view kUnneeded[] = {"scheme"};
  parameters.mark_used(kUnneeded);
  const int32_t default_levels = parameters.get_integer("nlevels", 3);
  const uint32_t levels = count_of(parameters, "levels", default_levels);
  std::vector<Triangle> triangles = take_triangles(parameters, report);
  std::vector<Vec3> points = take_points(parameters);
  MeshJob job;
  // Each level splits a triangle into four and adds at most one vertex per new triangle.
  if (constexpr uint32_t kMaxSizedLevels = 12; levels <= kMaxSizedLevels) { // more levels exceed the triangle limit
    const uint64_t made = static_cast<uint64_t>(triangles.size()) << (2 * levels);
    job.bytes_at_least = made * sizeof(Triangle);
    job.bytes_at_most = job.bytes_at_least + (points.size() + made) * 2 * sizeof(Vec3);
  }
  job.make = [levels, triangles = std::move(triangles), points = std::move(points)](ShapeContext& context) {
    return subdivide_loop(points, triangles, levels, context.report, &context.dropped_triangles,
                          context.check_cancelled, context.memory);
  };
  return job;
}

MeshJob read_curve(ParameterList& parameters, const ReportFn& report) {
  constexpr std::string_view kUnneeded[] = {"splitdepth"};
  parameters.mark_used(kUnneeded);
  CurveParameters curve;
  const std::string type = parameters.get_string("type", "flat"), basis = parameters.get_string("basis", "bezier");
  if (type != "flat" && type != "ribbon" && type != "cylinder")
    report(Severity::kError, 0, "type " + in_quotes(type) + " is neither flat, ribbon nor cylinder; it is drawn round");
  if (basis != "bezier" && basis != "bspline")
    throw Error(ErrorKind::kInput, "basis " + in_quotes(basis) + " is neither bezier nor bspline");
  curve.type = type == "ribbon" ? CurveType::kRibbon : type == "cylinder" ? CurveType::kCylinder : CurveType::kFlat;
  curve.basis = basis == "bspline" ? CurveBasis::kBspline : CurveBasis::kBezier;
  curve.degree = count_of(parameters, "degree", 3);
  const float width = parameters.get_float("width", 1.0f);
  curve.width0 = parameters.get_float("width0", width);
  curve.width1 = parameters.get_float("width1", width);
  std::vector<Vec3> normals = parameters.take_vectors("N", ParameterType::kNormal);
  if (!normals.empty() && curve.type != CurveType::kRibbon)
    report(Severity::kWarning, 0, "normals are for ribbons only; they are ignored");
  MeshJob job;
  job.make = [curve, points = parameters.take_vectors("P", ParameterType::kPoint3),
              normals = std::move(normals)](ShapeContext& context) mutable {
    curve.points = points;
    curve.normals = normals;
    return tessellate_curve(curve, context.memory);
  };
  return job;
}

std::vector<glm::vec4> take_control_points(ParameterList& parameters, const ReportFn& report) {
  std::vector<glm::vec4> points;
  for (const Vec3 p : parameters.take_vectors("P", ParameterType::kPoint3)) points.emplace_back(p, 1.0f);
  if (points.empty()) points = read_groups<glm::vec4>(parameters, "Pw", ParameterType::kFloat, report);
  if (points.empty()) throw Error(ErrorKind::kInput, "no control points, neither \"point P\" nor \"float Pw\"");
  return points;
}

MeshJob read_nurbs(ParameterList& parameters, const ReportFn& report) {
  NurbsParameters nurbs;
  nurbs.nu = count_of(parameters, "nu", 0);
  nurbs.nv = count_of(parameters, "nv", 0);
  nurbs.u_order = count_of(parameters, "uorder", 0);
  nurbs.v_order = count_of(parameters, "vorder", 0);
  const auto limit = [&](std::string_view name) {
    const float value = parameters.get_float(name, 0.0f), other_default = parameters.get_float(name, 1.0f);
    const bool absent = value == 0.0f && other_default == 1.0f;
    return absent ? std::nullopt : std::optional<float>(value);
  };
  nurbs.u0 = limit("u0"), nurbs.u1 = limit("u1"), nurbs.v0 = limit("v0"), nurbs.v1 = limit("v1");
  MeshJob job;
  job.make = [nurbs, u_knots = grouped<float>(parameters.floats("uknots", ParameterType::kFloat)),
              v_knots = grouped<float>(parameters.floats("vknots", ParameterType::kFloat)),
              points = take_control_points(parameters, report)](ShapeContext& context) mutable {
    nurbs.u_knots = u_knots;
    nurbs.v_knots = v_knots;
    nurbs.control_points = points;
    return tessellate_nurbs(nurbs, context.tessellation_tolerance, context.report, context.check_cancelled,
                            context.memory);
  };
  return job;
}

MeshJob read_height_field(ParameterList& parameters, const ReportFn&) {
  const uint32_t nu = count_of(parameters, "nu", 0), nv = count_of(parameters, "nv", 0);
  std::vector<float> heights = grouped<float>(parameters.floats("Pz", ParameterType::kFloat));
  MeshJob job;
  // At most two triangles per sample.
  job.bytes_at_most = heights.size() * (sizeof(Vec3) + sizeof(Vec2) + 2 * sizeof(Triangle));
  job.make = [nu, nv, heights = std::move(heights)](ShapeContext& context) {
    Mesh mesh = make_heightfield(nu, nv, heights);
    context.dropped_triangles += clean_up_mesh(mesh, context.report);
    return mesh;
  };
  return job;
}

constexpr ShapeKind kKinds[] = {
    {"trianglemesh", read_triangle_mesh},
    {"loopsubdiv", read_loop_subdivision},
    {"sphere", read_sphere},
    {"cylinder", read_cylinder},
    {"disk", read_disk},
    {"cone", read_cone},
    {"paraboloid", read_paraboloid},
    {"hyperboloid", read_hyperboloid},
    {"curve", read_curve},
    {"nurbs", read_nurbs},
    {"heightfield", read_height_field},
};

} // namespace

const ShapeKind* find_shape_kind(std::string_view name) {
  for (const ShapeKind& kind : kKinds)
    if (kind.name == name) return &kind;
  return nullptr;
}

std::string_view closest_shape_kind(std::string_view name) {
  std::vector<std::string_view> names{"plymesh"};
  for (const ShapeKind& kind : kKinds) names.push_back(kind.name);
  return closest_name(name, names);
}

} // namespace packtrace
