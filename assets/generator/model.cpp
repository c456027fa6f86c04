#include "assets/generator/model.h"

#include "assets/generator/primitives.h"

namespace packtrace::scenegen {

Mesh& Model::part(std::string_view material, bool smooth) {
  for (ModelPart& part : parts_) {
    if (part.smooth == smooth && part.material == material) return part.mesh;
  }
  parts_.push_back({std::string(material), smooth, {}});
  return parts_.back().mesh;
}

void Model::finish() {
  for (ModelPart& part : parts_) {
    if (part.smooth) compute_normals(part.mesh);
  }
}

uint64_t Model::triangle_count() const {
  uint64_t count = 0;
  for (const ModelPart& part : parts_) count += part.mesh.triangles.size();
  return count;
}

} // namespace packtrace::scenegen
