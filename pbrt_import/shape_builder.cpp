#include "pbrt_import/shape_builder.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "pbrt_import/scene/error.h"
#include "pbrt_import/shapes/curve.h"
#include "pbrt_import/shapes/heightfield.h"
#include "pbrt_import/shapes/mesh_cleanup.h"
#include "pbrt_import/shapes/nurbs.h"
#include "pbrt_import/shapes/quadrics.h"
#include "pbrt_import/shapes/subdivision.h"
#include "pbrt_import/tokenizer.h"

namespace packtrace {
namespace {

static_assert(sizeof(Vec3) == 3 * sizeof(float) && sizeof(Vec2) == 2 * sizeof(float));

/// Groups components into vectors, leaving out an incomplete last one.
template <class Vector>
std::vector<Vector> grouped(std::vector<float> components) {
  std::vector<Vector> vectors(components.size() / (sizeof(Vector) / sizeof(float)));
  if (!vectors.empty()) std::memcpy(vectors.data(), components.data(), vectors.size() * sizeof(Vector));
  return vectors;
}

std::vector<Vec2> take_uvs(ParameterList& parameters) {
  for (const ParameterType type : {ParameterType::kPoint2, ParameterType::kFloat})
    for (const std::string_view name : {"uv", "st"})
      if (std::vector<float> values = parameters.take_floats(name, type); !values.empty())
        return grouped<Vec2>(std::move(values));
  return {};
}

std::vector<Triangle> take_triangles(ParameterList& parameters, ShapeContext& context) {
  const std::span<const int32_t> indices = parameters.integers("indices");
  if (indices.empty()) throw Error(ErrorKind::kInput, "no \"integer indices\"");
  if (indices.size() % 3 != 0 && context.report)
    context.report(Severity::kWarning, 0,
                   "the number of indices, " + std::to_string(indices.size()) +
                       ", is not a multiple of 3; the last ones are ignored");
  std::vector<Triangle> triangles(indices.size() / 3);
  for (size_t i = 0; i < triangles.size(); ++i)
    // Negative indices become huge ones, which are out of range like all others that are.
    triangles[i] = {static_cast<uint32_t>(indices[3 * i]), static_cast<uint32_t>(indices[3 * i + 1]),
                    static_cast<uint32_t>(indices[3 * i + 2])};
  return triangles;
}

uint32_t count_of(const ParameterList& parameters, std::string_view name, int32_t fallback) {
  const int32_t count = parameters.get_integer(name, fallback);
  if (count < 0) throw Error(ErrorKind::kInput, "negative " + in_quotes(name));
  return static_cast<uint32_t>(count);
}

Mesh make_triangle_mesh(ParameterList& parameters, ShapeContext& context) {
  constexpr std::string_view kUnneeded[] = {"S", "faceIndices", "discarddegenerateUVs"};
  parameters.mark_used(kUnneeded);
  Mesh mesh;
  mesh.triangles = take_triangles(parameters, context);
  mesh.positions = grouped<Vec3>(parameters.take_floats("P", ParameterType::kPoint3));
  if (mesh.positions.empty()) throw Error(ErrorKind::kInput, "no \"point P\"");
  if (mesh.positions.size() >= std::numeric_limits<uint32_t>::max())
    throw Error(ErrorKind::kLimitExceeded, "more than 2^32 - 2 vertices");
  mesh.normals = grouped<Vec3>(parameters.take_floats("N", ParameterType::kNormal));
  mesh.uvs = take_uvs(parameters);
  context.dropped_triangles += drop_bad_triangles(mesh, context.report);
  return mesh;
}

Mesh make_sphere(ParameterList& parameters, ShapeContext& context) {
  SphereParameters sphere;
  sphere.radius = parameters.get_float("radius", 1.0f);
  sphere.z_min = parameters.get_float("zmin", -sphere.radius);
  sphere.z_max = parameters.get_float("zmax", sphere.radius);
  sphere.phi_max = parameters.get_float("phimax", 360.0f);
  return tessellate_sphere(sphere, context.tessellation_tolerance);
}

Mesh make_cylinder(ParameterList& parameters, ShapeContext& context) {
  CylinderParameters cylinder;
  cylinder.radius = parameters.get_float("radius", 1.0f);
  cylinder.z_min = parameters.get_float("zmin", -1.0f);
  cylinder.z_max = parameters.get_float("zmax", 1.0f);
  cylinder.phi_max = parameters.get_float("phimax", 360.0f);
  return tessellate_cylinder(cylinder, context.tessellation_tolerance);
}

Mesh make_disk(ParameterList& parameters, ShapeContext& context) {
  DiskParameters disk;
  disk.height = parameters.get_float("height", 0.0f);
  disk.radius = parameters.get_float("radius", 1.0f);
  disk.inner_radius = parameters.get_float("innerradius", 0.0f);
  disk.phi_max = parameters.get_float("phimax", 360.0f);
  return tessellate_disk(disk, context.tessellation_tolerance);
}

Mesh make_cone(ParameterList& parameters, ShapeContext& context) {
  ConeParameters cone;
  cone.radius = parameters.get_float("radius", 1.0f);
  cone.height = parameters.get_float("height", 1.0f);
  cone.phi_max = parameters.get_float("phimax", 360.0f);
  return tessellate_cone(cone, context.tessellation_tolerance);
}

Mesh make_paraboloid(ParameterList& parameters, ShapeContext& context) {
  ParaboloidParameters paraboloid;
  paraboloid.radius = parameters.get_float("radius", 1.0f);
  paraboloid.z_min = parameters.get_float("zmin", 0.0f);
  paraboloid.z_max = parameters.get_float("zmax", 1.0f);
  paraboloid.phi_max = parameters.get_float("phimax", 360.0f);
  return tessellate_paraboloid(paraboloid, context.tessellation_tolerance);
}

Mesh make_hyperboloid(ParameterList& parameters, ShapeContext& context) {
  HyperboloidParameters hyperboloid;
  hyperboloid.p1 = parameters.get_point("p1", hyperboloid.p1);
  hyperboloid.p2 = parameters.get_point("p2", hyperboloid.p2);
  hyperboloid.phi_max = parameters.get_float("phimax", 360.0f);
  return tessellate_hyperboloid(hyperboloid, context.tessellation_tolerance);
}

Mesh make_loop_subdivision(ParameterList& parameters, ShapeContext& context) {
  constexpr std::string_view kUnneeded[] = {"scheme"};
  parameters.mark_used(kUnneeded);
  const int32_t default_levels = parameters.get_integer("nlevels", 3);
  const uint32_t levels = count_of(parameters, "levels", default_levels);
  const std::vector<Triangle> triangles = take_triangles(parameters, context);
  const std::vector<Vec3> points = grouped<Vec3>(parameters.take_floats("P", ParameterType::kPoint3));
  if (points.empty()) throw Error(ErrorKind::kInput, "no \"point P\"");
  return subdivide_loop(points, triangles, levels, context.report);
}

Mesh make_curve(ParameterList& parameters, ShapeContext&) {
  constexpr std::string_view kUnneeded[] = {"splitdepth"};
  parameters.mark_used(kUnneeded);
  CurveParameters curve;
  const std::string type = parameters.get_string("type", "flat"), basis = parameters.get_string("basis", "bezier");
  if (type != "flat" && type != "ribbon" && type != "cylinder")
    throw Error(ErrorKind::kInput, "type " + in_quotes(type) + " is neither flat, ribbon nor cylinder");
  if (basis != "bezier" && basis != "bspline")
    throw Error(ErrorKind::kInput, "basis " + in_quotes(basis) + " is neither bezier nor bspline");
  curve.type = type == "ribbon" ? CurveType::kRibbon : type == "cylinder" ? CurveType::kCylinder : CurveType::kFlat;
  curve.basis = basis == "bspline" ? CurveBasis::kBspline : CurveBasis::kBezier;
  curve.degree = count_of(parameters, "degree", 3);
  const float width = parameters.get_float("width", 1.0f);
  curve.width0 = parameters.get_float("width0", width);
  curve.width1 = parameters.get_float("width1", width);
  const std::vector<Vec3> points = grouped<Vec3>(parameters.take_floats("P", ParameterType::kPoint3));
  const std::vector<Vec3> normals = grouped<Vec3>(parameters.take_floats("N", ParameterType::kNormal));
  curve.points = points;
  curve.normals = normals;
  return tessellate_curve(curve);
}

Mesh make_nurbs(ParameterList& parameters, ShapeContext& context) {
  NurbsParameters nurbs;
  nurbs.nu = count_of(parameters, "nu", 0);
  nurbs.nv = count_of(parameters, "nv", 0);
  nurbs.u_order = count_of(parameters, "uorder", 0);
  nurbs.v_order = count_of(parameters, "vorder", 0);
  nurbs.u_knots = parameters.floats("uknots", ParameterType::kFloat);
  nurbs.v_knots = parameters.floats("vknots", ParameterType::kFloat);
  const auto limit = [&](std::string_view name) {
    constexpr float kAbsent = std::numeric_limits<float>::quiet_NaN();
    const float value = parameters.get_float(name, kAbsent);
    return std::isnan(value) ? std::nullopt : std::optional<float>(value);
  };
  nurbs.u0 = limit("u0"), nurbs.u1 = limit("u1"), nurbs.v0 = limit("v0"), nurbs.v1 = limit("v1");
  std::vector<glm::vec4> points;
  for (const Vec3 p : grouped<Vec3>(parameters.take_floats("P", ParameterType::kPoint3))) points.emplace_back(p, 1.0f);
  if (points.empty()) points = grouped<glm::vec4>(parameters.take_floats("Pw", ParameterType::kFloat));
  if (points.empty()) throw Error(ErrorKind::kInput, "no control points, neither \"point P\" nor \"float Pw\"");
  nurbs.control_points = points;
  return tessellate_nurbs(nurbs, context.tessellation_tolerance);
}

Mesh make_height_field(ParameterList& parameters, ShapeContext& context) {
  const uint32_t nu = count_of(parameters, "nu", 0), nv = count_of(parameters, "nv", 0);
  Mesh mesh = make_heightfield(nu, nv, parameters.floats("Pz", ParameterType::kFloat));
  context.dropped_triangles += drop_bad_triangles(mesh, context.report);
  return mesh;
}

constexpr ShapeKind kKinds[] = {
    {"trianglemesh", make_triangle_mesh},
    {"loopsubdiv", make_loop_subdivision},
    {"sphere", make_sphere},
    {"cylinder", make_cylinder},
    {"disk", make_disk},
    {"cone", make_cone},
    {"paraboloid", make_paraboloid},
    {"hyperboloid", make_hyperboloid},
    {"curve", make_curve},
    {"nurbs", make_nurbs},
    {"heightfield", make_height_field},
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
