#include "compress/exchange/scene/stream_export.h"

#include <bit>
#include <span>
#include <vector>

#include <nlohmann/json.hpp>

#include "compress/exchange/gltf/plain_primitives.h"
#include "compress/exchange/scene/scene_text.h"
#include "pbrt_import/base/printable.h"

namespace packtrace {
namespace {

static_assert(std::endian::native == std::endian::little);

/// A NumPy array of two dimensions. Source: NumPy, NEP 1, format version 1.0.
/// @param type such as "<f4"
template <class T>
std::vector<std::byte> npy(const std::string& type, const std::vector<T>& values, size_t columns) {
  std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" +
                       std::to_string(values.size() / columns) + ", " + std::to_string(columns) + "), }";
  constexpr size_t kAlignment = 64, kPreamble = 10;
  header.resize((kPreamble + header.size() + 1 + kAlignment - 1) / kAlignment * kAlignment - kPreamble - 1, ' ');
  header += '\n';
  std::string preamble("\x93NUMPY\x01\x00", 8);
  preamble += static_cast<char>(header.size() & 255u);
  preamble += static_cast<char>(header.size() >> 8);
  std::vector<std::byte> bytes = bytes_of_text(preamble + header);
  const auto raw = std::as_bytes(std::span(values));
  bytes.insert(bytes.end(), raw.begin(), raw.end());
  return bytes;
}

class StreamWriter {
public:
  StreamWriter(const BakedFile& file, const std::string& stem, Progress& progress)
      : file_(file), folder_(stem + "_files"), progress_(progress) {}

  SceneExport run(const std::string& stem) {
    progress_.begin("decoding", file_.base_geometry_count());
    for (uint32_t g = 0; g < file_.base_geometry_count(); ++g) {
      progress_.check_cancelled();
      add_geometry(g);
      progress_.advance();
    }
    add_instances();
    add_array("positions", "<f4", positions_, 3, "object space, one row per vertex");
    add_array("lattice", "<i8", lattice_, 3, "positions in steps of the geometry's lattice");
    add_array("normals", "<f4", normals_, 3, "of unit length; 0 where the primitive stores none");
    add_array("uvs", "<f4", uvs_, 2, "0 where the primitive stores none");
    add_array("triangles", "<u4", triangles_, 3, "vertex numbers");
    add_array("world_from_object", "<f4", maps_, 12, "of each instance: three columns and the translation");
    add_array("instances", "<u4", instances_, 2, "geometry and first entry in material_slots of each instance");
    add_array("material_slots", "<u4",
              std::vector<uint32_t>(file_.sections().material_slots.begin(), file_.sections().material_slots.end()), 1,
              "material numbers");
    for (uint32_t i = 0; i < file_.sections().materials.size(); ++i) {
      const baked::MaterialRecord& record = file_.sections().materials[i];
      json_["materials"].push_back(
          {{"name", to_utf8(file_.text(record.name))}, {"flags", record.flags}, {"albedo", record.albedo}});
    }
    const DVec3 origin = file_.origin();
    json_["format"] = "packtrace streams 1";
    json_["origin"] = {origin.x, origin.y, origin.z};
    SceneReport& report = result_.report;
    report.materials = file_.sections().materials.size(), report.instances = file_.instances().size();
    report.vertices = positions_.size() / 3, report.triangles = triangles_.size() / 3;
    report.moving = !file_.sections().rigid_motion.empty() || !file_.sections().deformation.empty();
    report.losses = find_losses(file_, ExportFormat::kStreams);
    result_.files.push_back({stem + ".json", bytes_of_text(json_.dump(1) + "\n")});
    for (const ExportedFile& f : result_.files) report.file_bytes += f.bytes.size();
    return std::move(result_);
  }

private:
  template <class T>
  void add_array(const std::string& name, const std::string& type, const std::vector<T>& values, size_t columns,
                 const std::string& meaning) {
    const std::string file = folder_ + "/" + name + ".npy";
    result_.files.push_back({file, npy(type, values, columns)});
    json_["arrays"][name] = {
        {"file", file}, {"type", type}, {"shape", {values.size() / columns, columns}}, {"meaning", meaning}};
  }

  void add_geometry(uint32_t geometry) {
    const baked::GeometryRecord& record = file_.geometries()[geometry];
    nlohmann::json primitives = nlohmann::json::array();
    for (const PlainPrimitive& part : plain_primitives(file_, geometry)) {
      const size_t first = positions_.size() / 3;
      primitives.push_back({{"material_slot", part.material_slot},
                            {"first_vertex", first},
                            {"vertices", part.positions.size()},
                            {"first_triangle", triangles_.size() / 3},
                            {"triangles", part.triangles.size()},
                            {"normals", !part.normals.empty()},
                            {"uvs", !part.uvs.empty()}});
      for (size_t i = 0; i < part.positions.size(); ++i) {
        const Vec3 n = part.normals.empty() ? Vec3(0.0f) : part.normals[i];
        const Vec2 uv = part.uvs.empty() ? Vec2(0.0f) : part.uvs[i];
        positions_.insert(positions_.end(), {part.positions[i].x, part.positions[i].y, part.positions[i].z});
        lattice_.insert(lattice_.end(), part.lattice[i].begin(), part.lattice[i].end());
        normals_.insert(normals_.end(), {n.x, n.y, n.z});
        uvs_.insert(uvs_.end(), {uv.x, uv.y});
      }
      for (const Triangle& t : part.triangles)
        for (int corner = 0; corner < 3; ++corner) triangles_.push_back(static_cast<uint32_t>(first) + t[corner]);
    }
    json_["geometries"].push_back({{"name", to_utf8(file_.text(record.name))},
                                   {"step", {record.step_mantissa, record.step_exponent}},
                                   {"world_space", (record.flags & baked::kWorldSpace) != 0},
                                   {"primitives", std::move(primitives)}});
    result_.report.shapes = json_["geometries"].size();
  }

  void add_instances() {
    for (const baked::InstanceRecord& instance : file_.instances()) {
      maps_.insert(maps_.end(), instance.world_from_object.begin(), instance.world_from_object.end());
      instances_.insert(instances_.end(), {instance.geometry, instance.first_slot});
    }
  }

  const BakedFile& file_;
  const std::string folder_;
  Progress& progress_;
  std::vector<float> positions_, normals_, uvs_, maps_;
  std::vector<int64_t> lattice_;
  std::vector<uint32_t> triangles_, instances_;
  nlohmann::json json_;
  SceneExport result_;
};

} // namespace

SceneExport export_streams(const BakedFile& file, const std::string& stem, Progress& progress) {
  return StreamWriter(file, stem, progress).run(stem);
}

} // namespace packtrace
