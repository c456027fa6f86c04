#include <optional>
#include <utility>
#include <vector>

#include "compress/bake/bake_scene.h"
#include "compress/format/file/baked_file.h"
#include "tests/benchmarks/packing_benchmark_codecs.h"
#include "tests/benchmarks/packing_benchmark_vertex.h"

namespace packtrace {
namespace {

/// Texels across [0,1]^2 of the mask that makes the bake keep texture coordinates.
constexpr float kMaskTexels = 1024.0f;

Scene one_shape_scene(const Mesh& mesh, bool keep_uvs) {
  Scene scene;
  scene.meshes.push_back(mesh);
  Material& material = scene.materials.emplace_back();
  if (keep_uvs) { // a mask of one texel, repeated kMaskTexels times
    material.flags = kAlphaMask;
    material.alpha_mask = 0;
    AlphaMask& mask = scene.masks.emplace_back();
    mask.width = mask.height = 1;
    mask.uv_scale = Vec2(kMaskTexels);
    mask.words = {1};
  }
  scene.shapes.emplace_back(0, 0, false, DAffine(1.0));
  return scene;
}

class PacktraceCodec : public PackingCodec {
public:
  explicit PacktraceCodec(const PacktraceFile& wanted) : wanted_(wanted) {}

  std::string name() const override {
    return "packtrace, codec " + std::string(name_of(wanted_.codec)) + (wanted_.keep_uvs ? ", uvs kept" : "") +
           (wanted_.trees ? ", with trees" : "");
  }

  size_t encode(const Mesh& mesh, const PackingPrecision& precision) override {
    BakeConfig config;
    config.precision_kind = PrecisionKind::kAbsolute;
    config.precision = precision.step;
    config.choose_codec(wanted_.codec);
    config.trees = wanted_.trees;
    Diagnostics diagnostics;
    Progress progress;
    file_.reset();
    baked_ = bake_to_bytes(one_shape_scene(mesh, wanted_.keep_uvs), config, diagnostics, progress);
    return baked_.bytes.size();
  }

  bool has_open() const override { return true; }
  void open() override { file_.emplace(BakedFile::borrow_bytes(baked_.bytes)); }

  void decode() override {
    const baked::GeometryRecord& geometry = file_->geometries()[0];
    decoded_.positions.resize(geometry.vertex_count);
    decoded_.normals.resize(geometry.vertex_count);
    decoded_.uvs.resize(wanted_.keep_uvs ? geometry.vertex_count : 0);
    decoded_.triangles.resize(geometry.triangle_count);
    size_t vertex = 0, triangle = 0;
    for (uint32_t c = 0; c < geometry.cluster_count; ++c) {
      const ClusterView cluster = file_->cluster(0, c);
      decode_positions(cluster, std::span(decoded_.positions).subspan(vertex));
      decode_indices(cluster, static_cast<uint32_t>(vertex), std::span(decoded_.triangles).subspan(triangle));
      if (cluster.has_normals()) decode_normals(cluster, std::span(decoded_.normals).subspan(vertex));
      if (cluster.has_uvs()) decode_uvs(cluster, std::span(decoded_.uvs).subspan(vertex));
      vertex += cluster.vertex_count();
      triangle += cluster.triangle_count();
    }
  }

  PackingErrors errors(const Mesh& source, const PackingPrecision&) override {
    PackingErrors errors;
    errors.position = baked_.report.max_position_error;
    if (!source.normals.empty()) {
      errors.normal_max_degrees = baked_.report.max_normal_error_degrees;
      errors.normal_mean_degrees = baked_.report.mean_normal_error_degrees;
    }
    if (wanted_.keep_uvs) errors.uv = baked_.report.max_uv_error;
    errors.lost_triangles = source.triangles.size() - decoded_.triangles.size();
    return errors;
  }

private:
  PacktraceFile wanted_;
  BakedScene baked_;
  std::optional<BakedFile> file_;
  PlainMesh decoded_;
};

} // namespace

std::unique_ptr<PackingCodec> packtrace_codec(const PacktraceFile& wanted) {
  return std::make_unique<PacktraceCodec>(wanted);
}

} // namespace packtrace
