#include "compress/exchange/scene/obj_export.h"

#include <array>
#include <span>
#include <vector>

#include "compress/exchange/gltf/plain_primitives.h"
#include "compress/exchange/scene/scene_text.h"
#include "pbrt_import/scene/material_flags.h"

namespace packtrace {
namespace {

template <class T>
void append_vector(std::string& text, std::string_view keyword, std::span<const T> values) {
  text += keyword;
  append_numbers(text, values);
  text += '\n';
}

class ObjWriter {
public:
  ObjWriter(const BakedFile& file, const std::string& stem, Progress& progress, const ByteSink& sink)
      : file_(file), stem_(stem), progress_(progress), sink_(sink) {
    for (uint32_t i = 0; i < file.sections().materials.size(); ++i)
      names_.push_back(plain_name(file.text(file.sections().materials[i].name), i, false));
  }

  SceneExport run() {
    add_images(file_, stem_ + "_files", result_);
    add_materials();
    text_ = "# Exported by packtrace.\n";
    if (!file_.geometries().empty() && (file_.geometries()[0].flags & baked::kWorldSpace) != 0) {
      text_ += "# bake --grid-step-abs ";
      const baked::SummaryRecord& s = file_.summary();
      append_number(text_, PositionGrid{s.world_step_mantissa, s.world_step_exponent}.step());
      text_ += " keeps the lattice of what is not instanced.\n";
    }
    text_ += "mtllib " + stem_ + ".mtl\n";
    progress_.begin("writing meshes", file_.instances().size());
    for (uint32_t i = 0; i < file_.instances().size(); ++i) {
      progress_.check_cancelled();
      add_instance(i);
      progress_.advance();
    }
    flush(0);
    SceneReport& report = result_.report;
    report.materials = names_.size();
    report.moving = !file_.sections().rigid_motion.empty() || !file_.sections().deformation.empty();
    report.losses = find_losses(file_, ExportFormat::kObj);
    for (const ExportedFile& f : result_.files) report.file_bytes += f.bytes.size();
    return std::move(result_);
  }

private:
  void add_materials() {
    std::string text = "# Exported by packtrace.\n";
    for (uint32_t i = 0; i < names_.size(); ++i) {
      const baked::MaterialRecord& record = file_.sections().materials[i];
      text += "newmtl " + names_[i] + "\n";
      constexpr std::array<float, 3> factor{1.0f, 1.0f, 1.0f}; // readers multiply the texture by Kd
      append_vector(text, "Kd ",
                    std::span<const float>(record.albedo_texture != baked::kNone ? factor : record.albedo));
      if ((record.flags & (kMetal | kMirror)) != 0)
        text += (record.flags & kMirror) != 0 ? "Pm 1\nPr 0\n" : "Pm 1\nPr 0.5\n";
      if ((record.flags & kEmissive) != 0) text += "Ke 1 1 1\n";
      if ((record.flags & kTransmissive) != 0) text += "d 0.25\nillum 4\n";
      if (record.albedo_texture != baked::kNone)
        add_map(text, "map_Kd", texture_file(stem_ + "_files", record.albedo_texture),
                file_.texture(record.albedo_texture));
      if ((record.flags & kAlphaMask) != 0 && record.alpha_mask != baked::kNone)
        add_map(text, "map_d", mask_file(stem_ + "_files", record.alpha_mask), file_.mask(record.alpha_mask));
    }
    result_.files.push_back({stem_ + ".mtl", bytes_of_text(text)});
  }

  template <class View>
  static void add_map(std::string& text, std::string_view keyword, const std::string& image, const View& view) {
    text += keyword;
    if (view.wrap != WrapMode::kRepeat) text += " -clamp on";
    if (view.uv_scale != Vec2(1.0f)) {
      text += " -s ";
      append_numbers(text, std::span<const float>(&view.uv_scale.x, 2));
      text += " 1";
    }
    if (view.uv_offset != Vec2(0.0f)) {
      text += " -o ";
      append_numbers(text, std::span<const float>(&view.uv_offset.x, 2));
      text += " 0";
    }
    text += " " + image + "\n";
  }

  /// World coordinates in the file's right-handed space. They stay doubles, since far from the origin floats would not
  /// hold the lattice.
  std::array<double, 3> placed(const DAffine& map, Vec3 p) const {
    const DVec3 world = transform_point(map, DVec3(p)) + file_.origin();
    return {0.0 - world.x, world.y, world.z};
  }

  void add_instance(uint32_t number) {
    const baked::InstanceRecord& instance = file_.instances()[number];
    const DAffine map(file_.world_from_object(number));
    const glm::dmat3 normal_map = normal_matrix(map);
    const bool keeps_winding = swaps_handedness(map); // the file's space mirrors once more
    text_ += "o " + plain_name(file_.text(file_.geometries()[instance.geometry].name), number, false) + "\n";
    if (decoded_ != instance.geometry) { // instances of several geometries may alternate; each change decodes again
      parts_ = {};                       // before the next geometry takes memory
      parts_ = plain_primitives(file_, decoded_ = instance.geometry);
    }
    for (const PlainPrimitive& part : parts_) {
      text_ += "usemtl " + names_[file_.sections().material_slots[instance.first_slot + part.material_slot]] + "\n";
      for (const Vec3& p : part.positions) {
        const std::array<double, 3> world = placed(map, p);
        append_vector(text_, "v ", std::span<const double>(world));
        flush(kChunk);
      }
      for (const Vec2& uv : part.uvs) {
        append_vector(text_, "vt ", std::span<const float>(&uv.x, 2));
        flush(kChunk);
      }
      for (const Vec3& n : part.normals) {
        const DVec3 turned = glm::normalize(normal_map * DVec3(n));
        const Vec3 mirrored(-turned.x, turned.y, turned.z);
        append_vector(text_, "vn ", std::span<const float>(&mirrored.x, 3));
        flush(kChunk);
      }
      add_faces(part, keeps_winding);
    }
    ++result_.report.shapes;
  }

  static constexpr size_t kChunk = size_t{1} << 20; // bytes of text that are handed over together

  /// Hands the text over if it is longer than some bytes.
  void flush(size_t above) {
    if (text_.size() <= above) return;
    progress_.check_cancelled();
    sink_(std::as_bytes(std::span(text_)));
    result_.report.file_bytes += text_.size();
    text_.clear();
  }

  void add_faces(const PlainPrimitive& part, bool keeps_winding) {
    for (const Triangle& t : part.triangles) {
      text_ += 'f';
      for (const uint32_t corner : {t.x, keeps_winding ? t.y : t.z, keeps_winding ? t.z : t.y}) {
        text_ += ' ';
        append_number(text_, static_cast<int64_t>(vertices_ + corner + 1));
        if (!part.uvs.empty() || !part.normals.empty()) text_ += '/';
        if (!part.uvs.empty()) append_number(text_, static_cast<int64_t>(uvs_ + corner + 1));
        if (!part.normals.empty()) {
          text_ += '/';
          append_number(text_, static_cast<int64_t>(normals_ + corner + 1));
        }
      }
      text_ += '\n';
      flush(kChunk);
    }
    vertices_ += part.positions.size(), uvs_ += part.uvs.size(), normals_ += part.normals.size();
    result_.report.vertices = vertices_, result_.report.triangles += part.triangles.size();
  }

  const BakedFile& file_;
  const std::string stem_;
  Progress& progress_;
  std::vector<std::string> names_; ///< of the materials
  const ByteSink& sink_;
  std::string text_;                ///< not yet handed over
  uint32_t decoded_ = baked::kNone; ///< geometry of parts_
  std::vector<PlainPrimitive> parts_;
  uint64_t vertices_ = 0, uvs_ = 0, normals_ = 0; ///< written so far
  SceneExport result_;
};

} // namespace

SceneExport export_obj(const BakedFile& file, const std::string& stem, Progress& progress, const ByteSink& sink) {
  return ObjWriter(file, stem, progress, sink).run();
}

std::vector<std::string> obj_companions(const BakedFile& file, const std::string& stem) {
  std::vector<std::string> names = image_files(file, stem + "_files");
  names.push_back(stem + ".mtl");
  return names;
}

} // namespace packtrace
