#pragma once

#include <deque>
#include <string>
#include <string_view>

#include "pbrt_import/scene/scene.h"

namespace packtrace::scenegen {

/// One mesh of one material.
struct ModelPart {
  std::string material;
  bool smooth = false; ///< vertices are shared across round surfaces and get averaged normals
  Mesh mesh;
};

/// A thing to instance: meshes grouped by material, in metres, y up, standing on y = 0, its front towards -z.
class Model {
public:
  /// The faceted mesh of a material; created when first asked for. The reference stays good.
  Mesh& flat(std::string_view material) { return part(material, false); }
  /// The round mesh of a material.
  Mesh& smooth(std::string_view material) { return part(material, true); }

  /// Gives the smooth parts their vertex normals. Call once, after the last triangle.
  void finish();

  const std::deque<ModelPart>& parts() const { return parts_; }
  uint64_t triangle_count() const;

private:
  Mesh& part(std::string_view material, bool smooth);
  std::deque<ModelPart> parts_;
};

} // namespace packtrace::scenegen
