#pragma once

#include <deque>
#include <string>
#include <string_view>

#include "pbrt_import/scene/scene.h"

namespace packtrace::scenegen {

/// One mesh with one material.
struct ModelPart {
  std::string material;
  bool smooth = false; ///< vertices are shared across rounded surfaces and get averaged normals
  Mesh mesh;
};

/// An object to instance: meshes grouped by material, in metres, y up, standing on y = 0, its front towards -z.
class Model {
public:
  /// Returns the faceted mesh of a material; creates it at the first call. The reference stays valid.
  Mesh& flat(std::string_view material) { return part(material, false); }
  /// Returns the smooth mesh of a material; creates it at the first call. The reference stays valid.
  Mesh& smooth(std::string_view material) { return part(material, true); }

  /// Computes the vertex normals of the smooth parts. Call once, after the last triangle.
  void finish();

  const std::deque<ModelPart>& parts() const { return parts_; }
  uint64_t triangle_count() const;

private:
  Mesh& part(std::string_view material, bool smooth);
  std::deque<ModelPart> parts_;
};

} // namespace packtrace::scenegen
