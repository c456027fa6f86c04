#include "compress/exchange/scene/pbrt_export.h"

#include <bit>
#include <cstring>
#include <map>
#include <span>
#include <utility>

#include "compress/exchange/gltf/plain_primitives.h"
#include "compress/exchange/scene/scene_text.h"
#include "pbrt_import/scene/material_flags.h"

namespace packtrace {
namespace {

static_assert(std::endian::native == std::endian::little);

template <class T>
void append_raw(std::vector<std::byte>& to, const T& value) {
  const auto bytes = std::as_bytes(std::span(&value, 1));
  to.insert(to.end(), bytes.begin(), bytes.end());
}

/// A binary PLY file.
std::vector<std::byte> ply_bytes(const PlainPrimitive& plain) {
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                       std::to_string(plain.positions.size()) +
                       "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!plain.normals.empty()) header += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!plain.uvs.empty()) header += "property float u\nproperty float v\n";
  header += "element face " + std::to_string(plain.triangles.size()) +
            "\nproperty list uchar int vertex_indices\nend_header\n";
  std::vector<std::byte> bytes = bytes_of_text(header);
  for (size_t i = 0; i < plain.positions.size(); ++i) {
    append_raw(bytes, plain.positions[i]);
    if (!plain.normals.empty()) append_raw(bytes, plain.normals[i]);
    if (!plain.uvs.empty()) append_raw(bytes, plain.uvs[i]);
  }
  for (const Triangle& triangle : plain.triangles) {
    append_raw(bytes, uint8_t{3});
    append_raw(bytes, triangle);
  }
  return bytes;
}

/// A file name as a string of pbrt holds it.
std::string escaped(const std::string& name) {
  std::string text;
  for (const char c : name) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  return text;
}

class PbrtWriter {
public:
  PbrtWriter(const BakedFile& file, const std::string& stem, Progress& progress)
      : file_(file), folder_(stem + "_files"), progress_(progress) {
    for (uint32_t i = 0; i < file.sections().materials.size(); ++i)
      names_.push_back(plain_name(file.text(file.sections().materials[i].name), i, true));
  }

  SceneExport run(const std::string& stem) {
    text_ = "# Exported by packtrace. pbrt ignores \"integer lattice\", the mantissa and exponent of the step of the "
            "lattice\n"
            "# on which the positions lie.\n";
    if (!file_.cameras().empty()) add_camera(file_.cameras().front());
    text_ += "WorldBegin\n";
    const DVec3 origin = file_.origin();
    if (origin != DVec3(0.0)) line("Translate ", std::span(&origin.x, 3));
    add_images(file_, folder_, result_);
    for (uint32_t i = 0; i < names_.size(); ++i) add_material(i);
    add_geometries();
    text_ += "WorldEnd\n";
    SceneReport& report = result_.report;
    report.materials = names_.size(), report.cameras = file_.cameras().empty() ? 0 : 1;
    report.moving = !file_.sections().rigid_motion.empty() || !file_.sections().deformation.empty();
    report.losses = find_losses(file_, ExportFormat::kPbrt);
    result_.files.push_back({stem + ".pbrt", bytes_of_text(text_)});
    for (const ExportedFile& f : result_.files) report.file_bytes += f.bytes.size();
    return std::move(result_);
  }

private:
  template <class T>
  void line(std::string_view before, std::span<const T> values, std::string_view after = "\n") {
    text_ += before;
    append_numbers(text_, values);
    text_ += after;
  }

  void matrix(std::string_view keyword, const DAffine& m) {
    const double values[] = {m[0].x, m[0].y, m[0].z, 0, m[1].x, m[1].y, m[1].z, 0,
                             m[2].x, m[2].y, m[2].z, 0, m[3].x, m[3].y, m[3].z, 1};
    line(std::string(keyword) + " [", std::span<const double>(values), "]\n");
  }

  void add_camera(const Camera& camera) {
    DAffine world_from_camera = camera.world_from_camera;
    world_from_camera[3] += file_.origin();
    matrix("Transform", inverse(world_from_camera));
    text_ += "Film \"image\" \"integer xresolution\" " + std::to_string(camera.width_px) + " \"integer yresolution\" " +
             std::to_string(camera.height_px) + "\n";
    if (camera.projection == Projection::kEnvironment) {
      text_ += "Camera \"environment\"\n";
      return;
    }
    const bool perspective = camera.projection == Projection::kPerspective;
    text_ += perspective ? "Camera \"perspective\"" : "Camera \"orthographic\"";
    if (perspective) line(" \"float fov\" ", std::span(&camera.fov_degrees, 1), "");
    if (camera.screen_window) line(" \"float screenwindow\" [", std::span(&camera.screen_window->x, 4), "]");
    text_ += '\n';
  }

  template <class View>
  void add_texture(const std::string& name, std::string_view type, const std::string& image, const View& view) {
    text_ += "Texture \"" + name + "\" \"" + std::string(type) + "\" \"imagemap\" \"string filename\" \"" +
             escaped(image) + "\"";
    line(" \"float uscale\" ", std::span(&view.uv_scale.x, 1), "");
    line(" \"float vscale\" ", std::span(&view.uv_scale.y, 1), "");
    line(" \"float udelta\" ", std::span(&view.uv_offset.x, 1), "");
    line(" \"float vdelta\" ", std::span(&view.uv_offset.y, 1), "");
    text_ += view.wrap == WrapMode::kRepeat  ? ""
             : view.wrap == WrapMode::kClamp ? " \"string wrap\" \"clamp\""
                                             : " \"string wrap\" \"black\"";
    text_ += '\n';
  }

  void add_material(uint32_t number) {
    const baked::MaterialRecord& record = file_.sections().materials[number];
    const std::string& name = names_[number];
    const auto add_mask = [&](uint32_t mask, const char* use) {
      if (mask != baked::kNone) add_texture(name + use, "float", mask_file(folder_, mask), file_.mask(mask));
    };
    if ((record.flags & kAlphaMask) != 0) add_mask(record.alpha_mask, " alpha");
    if ((record.flags & kShadowAlphaMask) != 0) add_mask(record.shadow_alpha_mask, " shadow alpha");
    const bool textured = record.albedo_texture != baked::kNone;
    if (textured)
      add_texture(name + " colour", "spectrum", texture_file(folder_, record.albedo_texture),
                  file_.texture(record.albedo_texture));
    if ((record.flags & kInvisible) != 0) {
      text_ += "MakeNamedMaterial \"" + name + "\" \"string type\" \"none\"\n";
      return;
    }
    std::string_view type = "matte", parameter = "Kd";
    if ((record.flags & kMirror) != 0)
      type = "mirror", parameter = "Kr";
    else if ((record.flags & kTransmissive) != 0)
      type = "glass", parameter = "Kt";
    else if ((record.flags & kMetal) != 0)
      type = "disney", parameter = "color";
    text_ += "MakeNamedMaterial \"" + name + "\" \"string type\" \"" + std::string(type) + "\"";
    if (type == "disney") text_ += " \"float metallic\" 1";
    if (textured)
      text_ += " \"texture " + std::string(parameter) + "\" \"" + name + " colour\"\n";
    else
      line(" \"rgb " + std::string(parameter) + "\" [", std::span<const float>(record.albedo), "]\n");
  }

  void add_shape(uint32_t geometry, size_t part, uint32_t material) {
    const baked::MaterialRecord& record = file_.sections().materials[material];
    const baked::GeometryRecord& lattice = file_.geometries()[geometry];
    text_ += "AttributeBegin\nNamedMaterial \"" + names_[material] + "\"\n";
    if ((record.flags & kEmissive) != 0)
      text_ += (record.flags & kEmitsBothSides) != 0
                   ? "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" \"true\"\n"
                   : "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n";
    text_ += "Shape \"plymesh\" \"string filename\" \"" + escaped(mesh_file(geometry, part)) +
             "\" \"integer lattice\" [" + std::to_string(lattice.step_mantissa) + " " +
             std::to_string(lattice.step_exponent) + "]";
    if ((record.flags & kAlphaMask) != 0 && record.alpha_mask != baked::kNone)
      text_ += " \"texture alpha\" \"" + names_[material] + " alpha\"";
    if ((record.flags & kShadowAlphaMask) != 0 && record.shadow_alpha_mask != baked::kNone)
      text_ += " \"texture shadowalpha\" \"" + names_[material] + " shadow alpha\"";
    else if ((record.flags & kNoShadow) != 0)
      text_ += " \"float shadowalpha\" 0";
    text_ += "\nAttributeEnd\n";
    ++result_.report.shapes;
  }

  std::string mesh_file(uint32_t geometry, size_t part) const {
    return folder_ + "/mesh_" + std::to_string(geometry) + "_" + std::to_string(part) + ".ply";
  }

  /// Writes all geometries: those in world space as shapes where they are, others as objects with instances.
  void add_geometries() {
    std::vector<std::vector<uint32_t>> users(file_.base_geometry_count());
    for (uint32_t i = 0; i < file_.instances().size(); ++i) users[file_.instances()[i].geometry].push_back(i);
    progress_.begin("writing meshes", users.size());
    for (uint32_t g = 0; g < users.size(); ++g) {
      progress_.check_cancelled();
      if (!users[g].empty()) add_geometry(g, users[g]);
      progress_.advance();
    }
  }

  void add_geometry(uint32_t geometry, const std::vector<uint32_t>& users) {
    const std::vector<PlainPrimitive> parts = plain_primitives(file_, geometry);
    for (size_t p = 0; p < parts.size(); ++p) {
      result_.report.vertices += parts[p].positions.size(), result_.report.triangles += parts[p].triangles.size();
      result_.files.push_back({mesh_file(geometry, p), ply_bytes(parts[p])});
    }
    const bool world = (file_.geometries()[geometry].flags & baked::kWorldSpace) != 0;
    std::map<uint32_t, std::string> objects; // by first slot
    for (const uint32_t i : users) {
      const baked::InstanceRecord& instance = file_.instances()[i];
      const auto add_shapes = [&] {
        for (size_t p = 0; p < parts.size(); ++p)
          add_shape(geometry, p, file_.sections().material_slots[instance.first_slot + parts[p].material_slot]);
      };
      if (world) {
        add_shapes();
        continue;
      }
      const auto [object, added] = objects.try_emplace(instance.first_slot, "object " + std::to_string(geometry) + "." +
                                                                                std::to_string(objects.size()));
      if (added) {
        ++result_.report.objects;
        text_ += "ObjectBegin \"" + object->second + "\"\n";
        add_shapes();
        text_ += "ObjectEnd\n";
      }
      ++result_.report.instances;
      text_ += "AttributeBegin\n";
      matrix("ConcatTransform", DAffine(file_.world_from_object(i)));
      text_ += "ObjectInstance \"" + object->second + "\"\nAttributeEnd\n";
    }
  }

  const BakedFile& file_;
  const std::string folder_;
  Progress& progress_;
  std::vector<std::string> names_; ///< of the materials
  std::string text_;
  SceneExport result_;
};

} // namespace

SceneExport export_pbrt(const BakedFile& file, const std::string& stem, Progress& progress) {
  return PbrtWriter(file, stem, progress).run(stem);
}

} // namespace packtrace
