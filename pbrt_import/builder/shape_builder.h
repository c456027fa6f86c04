#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "pbrt_import/language/parameters.h"
#include "pbrt_import/scene/scene.h"
#include "pbrt_import/shapes/report.h"

namespace packtrace {

struct ShapeContext {
  double tessellation_tolerance = 1e-3;
  const ReportFn& report;
  const CheckCancelledFn& check_cancelled;
  uint64_t dropped_triangles = 0;      ///< incremented by the number of dropped triangles
  MemoryReservation* memory = nullptr; ///< for the mesh and its working memory; null: not counted
};

/// Everything needed to make the triangles of a shape, in shape space.
struct MeshJob {
  /// Makes the mesh; any thread may call it, once. Throws Error, with a message without position, if the shape is
  /// unusable. If empty, the mesh is in `given` and only needs clean_up_mesh().
  std::function<Mesh(ShapeContext& context)> make{};
  Mesh given{};                ///< the mesh if `make` is empty
  uint64_t bytes_at_most = 0;  ///< upper bound of bytes_of(mesh); 0: unknown
  uint64_t bytes_at_least = 0; ///< lower bound that is known before the mesh is made
  std::string same_as{};       ///< jobs with equal keys make the same mesh; empty: unique
  double scale = 1.0;          ///< the shape is the mesh scaled by this factor
};

/// Creates the job of one kind of shape and takes its data out of the parameter list. Throws Error, with a message
/// without position, if the shape is unusable.
/// @param report receives problems with the parameters
using ShapeFunction = MeshJob (*)(ParameterList& parameters, const ReportFn& report);

/// A kind of shape whose triangles depend on its parameters only, which excludes plymesh.
struct ShapeKind {
  std::string_view name;
  ShapeFunction read = nullptr;
};

/// Finds a kind of shape by name.
/// @return null if pbrt has no such shape
const ShapeKind* find_shape_kind(std::string_view name);

/// Name of the known kind, including plymesh, that `name` is most likely a misspelling of; empty if none is close.
std::string_view closest_shape_kind(std::string_view name);

} // namespace packtrace
