#include "compress/exchange/vertex16/vertex16_export.h"

#include <algorithm>
#include <limits>

#include <tbb/parallel_for.h>

#include "compress/exchange/vertex16/vertex16_file.h"
#include "compress/exchange/vertex16/vertex16_geometry.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

/// Chooses the number of bits that each geometry's lattice loses. All world-space geometry loses the same number, so
/// that shared vertices stay equal.
std::vector<uint32_t> choose_shifts(const BakedFile& file) {
  std::vector<uint32_t> shifts(file.base_geometry_count());
  tbb::parallel_for(size_t{0}, shifts.size(),
                    [&](size_t i) { shifts[i] = vertex16_shift(lattice_box(file, static_cast<uint32_t>(i))); });
  uint32_t world = 0;
  const auto in_world = [&](size_t i) { return (file.geometries()[i].flags & baked::kWorldSpace) != 0; };
  for (size_t i = 0; i < shifts.size(); ++i)
    if (in_world(i)) world = std::max(world, shifts[i]);
  for (size_t i = 0; i < shifts.size(); ++i)
    if (in_world(i)) shifts[i] = world;
  return shifts;
}

class Exporter {
public:
  explicit Exporter(const BakedFile& file) : file_(file) {}

  void add(Vertex16Geometry&& geometry) {
    vertex16::GeometryRecord record = geometry.record;
    const bool narrow = record.index_bits == 16;
    const size_t first_index = narrow ? indices16_.size() : indices32_.size();
    constexpr size_t kMax = std::numeric_limits<uint32_t>::max() - 1;
    if (geometry.vertices.size() > kMax - vertices_.size() || geometry.indices.size() > kMax - first_index)
      throw Error(ErrorKind::kLimitExceeded, "more than 2^32 - 2 vertices or indices in one file");
    record.first_vertex = static_cast<uint32_t>(vertices_.size());
    record.first_draw = static_cast<uint32_t>(draws_.size());
    for (vertex16::DrawRecord draw : geometry.draws) {
      draw.first_index += static_cast<uint32_t>(first_index);
      draw.vertex_offset = record.first_vertex;
      draws_.push_back(draw);
    }
    vertices_.insert(vertices_.end(), geometry.vertices.begin(), geometry.vertices.end());
    for (const uint32_t index : geometry.indices)
      if (narrow)
        indices16_.push_back(static_cast<uint16_t>(index));
      else
        indices32_.push_back(index);
    geometries_.push_back(record);
    add_to_report(record);
    report_.triangles += geometry.indices.size() / 3;
  }

  Vertex16Export finish() {
    for (const baked::InstanceRecord& from : file_.instances()) {
      vertex16::InstanceRecord to{};
      for (size_t row = 0; row < 3; ++row)
        for (size_t column = 0; column < 4; ++column)
          to.world_from_object[4 * row + column] = from.world_from_object[3 * column + row];
      to.geometry = from.geometry;
      to.first_slot = from.first_slot;
      instances_.push_back(to);
    }
    const BakedSections& s = file_.sections();
    Vertex16Export result;
    result.bytes =
        vertex16::assemble({vertices_, indices16_, indices32_, geometries_, draws_, instances_, s.material_slots,
                            s.materials, s.masks, s.mask_words, s.textures, s.texture_bytes, s.strings});
    // Reads the result back before it leaves the export.
    vertex16::validate(result.bytes, "export result");
    report_.geometries = geometries_.size(), report_.draws = draws_.size();
    report_.instances = instances_.size(), report_.materials = s.materials.size();
    report_.vertices = vertices_.size();
    report_.vertex_bytes = vertices_.size() * sizeof(glm::uvec4);
    report_.index_bytes = indices16_.size() * sizeof(uint16_t) + indices32_.size() * sizeof(uint32_t);
    report_.file_bytes = result.bytes.size();
    result.report = report_;
    return result;
  }

  void count_coarser(bool coarser) { report_.coarser_geometries += coarser; }

private:
  void add_to_report(const vertex16::GeometryRecord& record) {
    const auto raise = [](double& largest, float value) { largest = std::max(largest, double{value}); };
    raise(report_.max_position_error, record.max_position_error);
    raise(report_.max_normal_error_degrees, record.max_normal_error_degrees);
    raise(report_.max_uv_error, record.max_uv_error);
    raise(report_.max_tangent_error_degrees, record.max_tangent_error_degrees);
  }

  const BakedFile& file_;
  std::vector<glm::uvec4> vertices_;
  std::vector<uint16_t> indices16_;
  std::vector<uint32_t> indices32_;
  std::vector<vertex16::GeometryRecord> geometries_;
  std::vector<vertex16::DrawRecord> draws_;
  std::vector<vertex16::InstanceRecord> instances_;
  Vertex16Report report_;
};

} // namespace

Vertex16Export export_vertex16(const BakedFile& file, Progress& progress) {
  const std::vector<uint32_t> shifts = choose_shifts(file);
  const std::vector<std::vector<uint32_t>> runs = material_runs(file.sections());
  std::vector<Vertex16Geometry> geometries(shifts.size());
  progress.begin("re-encoding vertices", shifts.size());
  tbb::parallel_for(size_t{0}, shifts.size(), [&](size_t i) {
    progress.check_cancelled();
    geometries[i] = make_vertex16_geometry(file, static_cast<uint32_t>(i), runs[i], shifts[i]);
    progress.advance();
  });
  progress.begin("assembling the file", 0);
  Exporter exporter(file);
  for (size_t i = 0; i < geometries.size(); ++i) {
    exporter.count_coarser(shifts[i] > 0);
    exporter.add(std::move(geometries[i]));
    geometries[i] = {};
  }
  return exporter.finish();
}

} // namespace packtrace
