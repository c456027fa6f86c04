// Baked files as numpy arrays.

#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl/filesystem.h>

#include "compress/format/file/baked_file.h"
#include "compress/format/file/file_summary.h"
#include "runtime/commands/reports/file_report.h"
#include "runtime/python/bindings.h"

namespace py = pybind11;

namespace packtrace {
namespace {

/// Registers the records' fields with numpy.
void register_records() {
  using namespace baked;
  PYBIND11_NUMPY_DTYPE(StringRef, offset, bytes);
  PYBIND11_NUMPY_DTYPE(GeometryRecord, first_cluster, payload_offset, payload_bytes, origin, max_position_error,
                       position_error_bound, cluster_count, triangle_count, vertex_count, step_mantissa, step_exponent,
                       anchor_shift, uv_exponent, bounds_lo, bounds_hi, max_normal_error_degrees,
                       mean_normal_error_degrees, max_uv_error, flags, class_clusters, name, normal_encoding,
                       uv_encoding, slot_count, requirements);
  PYBIND11_NUMPY_DTYPE(ClusterRecord, payload_offset, first_triangle, first_vertex, material_slot, anchor,
                       normal_anchor, vertex_count, normal_palette, triangle_count, strip_count, position_bits,
                       normal_bits, flags);
  PYBIND11_NUMPY_DTYPE(MaterialRecord, flags, albedo, alpha_mask, shadow_alpha_mask, albedo_texture, name);
  PYBIND11_NUMPY_DTYPE(InstanceRecord, world_from_object, geometry, first_slot);
  PYBIND11_NUMPY_DTYPE(MaskRecord, first_word, width, height, wrap, reserved, uv_scale, uv_offset);
  PYBIND11_NUMPY_DTYPE(TextureRecord, first_byte, width, height, wrap, codec, uv_scale, uv_offset, psnr_db, reserved,
                       name);
  PYBIND11_NUMPY_DTYPE(CameraRecord, world_from_camera, fov_degrees, screen_window, projection, has_screen_window,
                       width_px, height_px, film_name);
  PYBIND11_NUMPY_DTYPE(RequirementRecord, stream, reason, geometries, reserved, triangles, source_bytes, stored_bits);
  PYBIND11_NUMPY_DTYPE(SummaryRecord, source_triangles, dropped_triangles, unused_triangles, source_vertices,
                       merged_vertices, collapsed_triangles, bounds_lo, bounds_hi, origin, precision_value,
                       precision_kind, world_step_mantissa, world_step_exponent, purpose, stream_bits, left_out,
                       coinciding_triangles, source_area, collapsed_area);
  PYBIND11_NUMPY_DTYPE(LodLevelRecord, first_group, first_link, triangles, base, level, geometry, group_count, error);
  PYBIND11_NUMPY_DTYPE(LodGroupRecord, center, radius, error, level);
  PYBIND11_NUMPY_DTYPE(LodLinkRecord, group, generating_group);
  PYBIND11_NUMPY_DTYPE(TreeRecord, first_node, node_count, depth, origin, step_mantissa, step_exponent, geometry,
                       reserved);
  PYBIND11_NUMPY_DTYPE(PackedNode, origin, exponents, ray_classes, first_triangle, first_child, cluster, children, lo,
                       hi);
}

/// A read-only view; the owner lives as long as the array.
template <typename T>
py::array view(std::span<const T> values, py::handle owner) {
  const auto count = static_cast<py::ssize_t>(values.size());
  py::array array(py::dtype::of<T>(), {count}, {static_cast<py::ssize_t>(sizeof(T))}, values.data(), owner);
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

py::dict streams(const py::object& self) {
  const BakedSections& s = self.cast<const BakedFile&>().sections();
  const std::span<const uint8_t> strings(reinterpret_cast<const uint8_t*>(s.strings.data()), s.strings.size());
  py::dict result;
  const auto add = [&]<typename T>(const char* name, std::span<const T> values) { result[name] = view(values, self); };
  add("geometries", s.geometries), add("clusters", s.clusters), add("payload", s.payload);
  add("materials", s.materials), add("instances", s.instances), add("masks", s.masks);
  add("mask_words", s.mask_words), add("textures", s.textures), add("texture_bytes", s.texture_bytes),
      add("shading", s.shading);
  add("cameras", s.cameras), add("strings", strings), add("summary", s.summary);
  add("material_slots", s.material_slots), add("requirements", s.requirements), add("lod_levels", s.lod_levels);
  add("lod_groups", s.lod_groups), add("lod_links", s.lod_links), add("trees", s.trees);
  add("rigid_motion", s.rigid_motion), add("deformation", s.deformation), add("nodes", s.nodes);
  return result;
}

/// An array of rows of N numbers each.
template <typename Vector>
py::array_t<typename Vector::value_type> rows(size_t count) {
  return py::array_t<typename Vector::value_type>(
      {static_cast<py::ssize_t>(count), static_cast<py::ssize_t>(Vector::length())});
}

template <typename Vector>
std::span<Vector> rows_of(py::array_t<typename Vector::value_type>& array) {
  return {reinterpret_cast<Vector*>(array.mutable_data()), static_cast<size_t>(array.shape(0))};
}

py::dict decode(const BakedFile& file, uint32_t geometry) {
  if (geometry >= file.geometries().size()) throw py::index_error("no such geometry");
  const baked::GeometryRecord& record = file.geometries()[geometry];
  bool any_normals = false, any_uvs = false;
  for (const baked::ClusterRecord& cluster : file.clusters(geometry)) {
    any_normals |= (cluster.flags & baked::kClusterHasNormals) != 0;
    any_uvs |= (cluster.flags & baked::kClusterHasUvs) != 0;
  }
  auto positions = rows<Vec3>(record.vertex_count), normals = rows<Vec3>(any_normals ? record.vertex_count : 0);
  auto uvs = rows<Vec2>(any_uvs ? record.vertex_count : 0);
  auto triangles = rows<Triangle>(record.triangle_count);
  py::array_t<uint32_t> clusters(static_cast<py::ssize_t>(record.triangle_count));
  const auto position_rows = rows_of<Vec3>(positions), normal_rows = rows_of<Vec3>(normals);
  const auto uv_rows = rows_of<Vec2>(uvs);
  const auto triangle_rows = rows_of<Triangle>(triangles);
  const std::span<uint32_t> cluster_rows(clusters.mutable_data(), record.triangle_count);
  {
    const py::gil_scoped_release release;
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    std::fill(normal_rows.begin(), normal_rows.end(), Vec3(kNone));
    std::fill(uv_rows.begin(), uv_rows.end(), Vec2(kNone));
    for (uint32_t i = 0; i < record.cluster_count; ++i) {
      const ClusterView cluster = file.cluster(geometry, i);
      const baked::ClusterRecord& c = cluster.record();
      decode_positions(cluster, position_rows.subspan(c.first_vertex, c.vertex_count));
      decode_indices(cluster, c.first_vertex, triangle_rows.subspan(c.first_triangle, c.triangle_count));
      std::fill_n(cluster_rows.begin() + c.first_triangle, c.triangle_count, i);
      if (cluster.has_normals()) decode_normals(cluster, normal_rows.subspan(c.first_vertex, c.vertex_count));
      if (cluster.has_uvs()) decode_uvs(cluster, uv_rows.subspan(c.first_vertex, c.vertex_count));
    }
  }
  py::dict result;
  result["positions"] = positions;
  result["triangles"] = triangles;
  result["clusters"] = clusters;
  if (any_normals) result["normals"] = normals;
  if (any_uvs) result["uvs"] = uvs;
  return result;
}

py::object info(const BakedFile& file, bool by_geometry) {
  std::string text;
  {
    const py::gil_scoped_release release;
    text = to_json(summarize(file), by_geometry).dump();
  }
  return py::module_::import("json").attr("loads")(text);
}

} // namespace

void bind_files(py::module_& module) {
  register_records();
  py::class_<BakedFile, std::shared_ptr<BakedFile>>(module, "File")
      .def_property_readonly("geometry_count", [](const BakedFile& file) { return file.geometries().size(); })
      .def_property_readonly("base_geometry_count", &BakedFile::base_geometry_count)
      .def_property_readonly("file_bytes", &BakedFile::file_bytes)
      .def("info", &info, py::arg("by_geometry") = false)
      .def("streams", &streams)
      .def("decode", &decode, py::arg("geometry"));
  module.def(
      "open", [](const std::filesystem::path& path) { return std::make_shared<BakedFile>(BakedFile::open(path)); },
      py::arg("path"), py::call_guard<py::gil_scoped_release>());
}

} // namespace packtrace
