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
  uint64_t dropped_triangles = 0; ///< added to
  MemoryReservation* memory = nullptr; ///< for the mesh and what making it takes; null: nobody counts
};

/// All that is needed to make the triangles of a shape, in the shape's own space.
struct MeshJob {
  /// Any thread may call it, once. Throws Error, message without a place, if the shape is unusable. Empty: the mesh is
  /// there already, and only drop_bad_triangles() is still to come.
  std::function<Mesh(ShapeContext& context)> make{};
  Mesh given{};                ///< where make is empty
  uint64_t bytes_at_most = 0;  ///< bound on bytes_of(mesh); 0: not known
  uint64_t bytes_at_least = 0; ///< as far as can be told before it is made
  std::string same_as{};      ///< jobs that have it in common make the same mesh; empty: this one stands alone
  double scale = 1.0;         ///< the shape is the mesh scaled by it
};

/// Takes what one kind of shape needs out of the list. Throws Error, message without a place, if the shape is unusable.
/// @param report problems with the parameters
using ShapeFunction = MeshJob (*)(ParameterList& parameters, const ReportFn& report);

/// A kind of shape whose triangles come from its parameters alone, so not plymesh.
struct ShapeKind {
  std::string_view name;
  ShapeFunction read = nullptr;
};

/// @return null if pbrt knows no such shape
const ShapeKind* find_shape_kind(std::string_view name);

/// The known kind, plymesh included, that name is most likely a misspelling of; empty: none.
std::string_view closest_shape_kind(std::string_view name);

} // namespace packtrace
