#include "assets/generator/scene_writer.h"

#include <cassert>

#include <fmt/format.h>

#include "assets/generator/ply_output.h"

namespace packtrace::scenegen {
namespace {

/// Four significant digits move the far end of a 20 m object by a millimetre; positions need more.
std::string transform_text(const DAffine& m) {
  return fmt::format("Transform [{:.4g} {:.4g} {:.4g} 0 {:.4g} {:.4g} {:.4g} 0 {:.4g} {:.4g} {:.4g} 0 "
                     "{:.6g} {:.6g} {:.6g} 1]",
                     m[0].x, m[0].y, m[0].z, m[1].x, m[1].y, m[1].z, m[2].x, m[2].y, m[2].z, m[3].x, m[3].y, m[3].z);
}

} // namespace

SceneWriter::SceneWriter(const OutputConfig& config, std::string name, std::string_view comment, const ViewConfig& view)
    : config_(config), name_(std::move(name)), main_(config.folder / (name_ + ".pbrt"), config.overwrite),
      objects_(config.folder / (name_ + "_objects.pbrt"), config.overwrite),
      instances_(config.folder / (name_ + "_instances.pbrt"), config.overwrite) {
  main_.write(comment);
  if (view.end_time_s > 0.0) main_.write(fmt::format("TransformTimes 0 {}\n", view.end_time_s));
  main_.write(fmt::format("LookAt {} {} {}  {} {} {}  0 1 0\n", view.eye.x, view.eye.y, view.eye.z, view.target.x,
                          view.target.y, view.target.z));
  main_.write(fmt::format("Camera \"perspective\" \"float fov\" [ {} ]{}\n", view.fov_degrees,
                          view.end_time_s > 0.0 ? " \"float shutteropen\" [ 0 ] \"float shutterclose\" [ 0 ]" : ""));
  main_.write(fmt::format("Film \"image\" \"integer xresolution\" [ {} ] \"integer yresolution\" [ {} ] "
                          "\"string filename\" [ \"{}.exr\" ]\n",
                          view.width_px, view.height_px, name_));
  main_.write("Sampler \"halton\" \"integer pixelsamples\" [ 64 ]\n"
              "Integrator \"ambientocclusion\" \"integer nsamples\" [ 16 ]\n\nWorldBegin\n"
              "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n\n");
}

void SceneWriter::material(std::string_view name, Vec3 albedo) {
  main_.write(fmt::format("MakeNamedMaterial \"{}\" \"string type\" \"matte\" \"rgb Kd\" [ {} {} {} ]\n", name,
                          albedo.x, albedo.y, albedo.z));
}

void SceneWriter::textured_material(std::string_view name, std::string_view file) {
  main_.write(fmt::format("Texture \"{0}\" \"spectrum\" \"imagemap\" \"string filename\" \"{1}\"\n"
                          "MakeNamedMaterial \"{0}\" \"string type\" \"matte\" \"texture Kd\" \"{0}\"\n",
                          name, file));
}

void SceneWriter::ply_model(std::string_view model_name, std::string_view file, std::string_view material,
                            uint64_t triangle_count) {
  models_.insert_or_assign(std::string(model_name),
                           StoredModel{Model(), {{std::string(file), std::string(material)}}, triangle_count, true});
  totals_.unique_triangles += triangle_count;
}

void SceneWriter::model(std::string_view model_name, Model model) {
  const uint64_t triangle_count = model.triangle_count();
  models_.insert_or_assign(std::string(model_name), StoredModel{std::move(model), {}, triangle_count, false});
}

void SceneWriter::object(std::string_view object_name, std::string_view model_name, const MaterialChoice& choice) {
  object_names_.insert_or_assign(std::string(object_name), StoredObject{std::string(model_name), choice, false});
}

void SceneWriter::object(std::string_view object_name, Model new_model) {
  model(object_name, std::move(new_model));
  object(object_name, object_name);
}

const SceneWriter::StoredModel& SceneWriter::written_model(std::string_view name) {
  const auto found = models_.find(name);
  assert(found != models_.end());
  StoredModel& stored = found->second;
  if (stored.written) return stored;
  for (const ModelPart& part : stored.model.parts()) {
    if (part.mesh.triangles.empty()) continue;
    const std::string file_name = fmt::format("geometry/{}_{}.ply", name, stored.parts.size());
    BufferedFile file(config_.folder / file_name, config_.overwrite);
    write_ply(file, part.mesh);
    file.close();
    stored.parts.push_back({file_name, part.material});
  }
  stored.model = Model();
  stored.written = true;
  totals_.unique_triangles += stored.triangle_count;
  return stored;
}

void SceneWriter::write_shapes(const std::vector<PlyPart>& parts, const MaterialChoice& choice) {
  for (const PlyPart& part : parts) {
    const auto chosen = choice.find(part.material);
    objects_.write(fmt::format("NamedMaterial \"{}\" Shape \"plymesh\" \"string filename\" \"{}\"\n",
                               chosen == choice.end() ? part.material : chosen->second, part.file));
  }
}

const SceneWriter::StoredModel& SceneWriter::written_object(std::string_view object_name) {
  const auto found = object_names_.find(object_name);
  assert(found != object_names_.end());
  StoredObject& object = found->second;
  const StoredModel& model = written_model(object.model);
  if (!object.written) {
    objects_.write(fmt::format("ObjectBegin \"{}\"\n", object_name));
    write_shapes(model.parts, object.choice);
    objects_.write("ObjectEnd\n");
    object.written = true;
  }
  return model;
}

void SceneWriter::write_object(std::string_view object_name) { written_object(object_name); }

void SceneWriter::count_instance(std::string_view object_name) {
  const StoredModel& model = written_object(object_name);
  ++totals_.instances;
  totals_.placed_triangles += model.triangle_count;
}

void SceneWriter::instance(std::string_view object_name, const DAffine& world_from_object) {
  count_instance(object_name);
  instances_.write(transform_text(world_from_object));
  instances_.write(fmt::format("ObjectInstance \"{}\"\n", object_name));
}

void SceneWriter::moving_instance(std::string_view object_name, const DAffine& world_from_object_begin,
                                  const DAffine& world_from_object_end) {
  count_instance(object_name);
  instances_.write("AttributeBegin ActiveTransform StartTime ");
  instances_.write(transform_text(world_from_object_begin));
  instances_.write("\n  ActiveTransform EndTime ");
  instances_.write(transform_text(world_from_object_end));
  instances_.write(fmt::format("\n  ActiveTransform All ObjectInstance \"{}\" AttributeEnd\n", object_name));
}

void SceneWriter::world_shape(std::string_view model_name) {
  const StoredModel& model = written_model(model_name);
  write_shapes(model.parts, {});
  totals_.placed_triangles += model.triangle_count;
}

void SceneWriter::world_file(std::string_view file, std::string_view material, uint64_t triangle_count) {
  write_shapes({{std::string(file), std::string(material)}}, {});
  totals_.unique_triangles += triangle_count;
  totals_.placed_triangles += triangle_count;
}

SceneTotals SceneWriter::finish() {
  main_.write(fmt::format("\nInclude \"{0}_objects.pbrt\"\nInclude \"{0}_instances.pbrt\"\n\nWorldEnd\n", name_));
  objects_.close();
  instances_.close();
  main_.close();
  return totals_;
}

} // namespace packtrace::scenegen
