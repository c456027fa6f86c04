#include "pbrt_import/gltf_sequence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "pbrt_import/base/error.h"
#include "pbrt_import/language/transforms.h"

namespace packtrace {
namespace {

/// Frames in memory. A frame without positions of its own equals the one before.
class GltfFrames final : public MeshFrames {
public:
  GltfFrames(const Mesh& mesh, double frames_per_second, const MemoryBudget& memory)
      : name_(mesh.name), frames_per_second_(frames_per_second), memory_(memory), frames_{mesh.positions} {}

  /// Adds frames that equal the last one, until there are as many.
  void repeat(uint32_t count) { frames_.resize(count); }
  void add(std::vector<Vec3> positions) {
    memory_.resize(memory_.bytes() + positions.size() * sizeof(Vec3), "the frames of " + name_);
    frames_.push_back(std::move(positions));
  }

  uint32_t count() const override { return static_cast<uint32_t>(frames_.size()); }
  std::vector<Vec3> positions(uint32_t frame) const override {
    while (frames_[frame].empty()) --frame;
    return frames_[frame];
  }
  std::string name(uint32_t frame) const override {
    return name_ + " at " + to_text(static_cast<double>(frame) / frames_per_second_) + " s";
  }

private:
  const std::string name_;
  const double frames_per_second_;
  MemoryReservation memory_;
  std::vector<std::vector<Vec3>> frames_;
};

/// The meshes at a time, which the scene's own are deformed to.
std::vector<Mesh> meshes_at(std::span<const std::filesystem::path> files, const Scene& scene, ImportOptions options,
                            double time) {
  options.pose_time = time;
  options.strict = false; // what there is to report was reported of the scene
  Diagnostics diagnostics;
  Progress progress;
  ImportResult read = import_mesh_files(files, options, diagnostics, progress);
  bool same = read.scene.meshes.size() == scene.meshes.size();
  for (size_t i = 0; same && i < scene.meshes.size(); ++i)
    same = read.scene.meshes[i].triangles == scene.meshes[i].triangles &&
           read.scene.meshes[i].positions.size() == scene.meshes[i].positions.size();
  if (!same)
    throw Error(ErrorKind::kInput,
                files[0].string() + ": at " + to_text(time) + " s it has other triangles than at 0 s");
  return std::move(read.scene.meshes);
}

} // namespace

std::vector<MeshSequence> find_gltf_sequences(const ImportResult& imported,
                                              std::span<const std::filesystem::path> files,
                                              const ImportOptions& options, double frames_per_second,
                                              Progress& progress) {
  const double duration = imported.statistics.deforming_s;
  if (!(duration > 0.0))
    throw Error(ErrorKind::kInput, files[0].string() + ": no animation deforms its meshes by morph targets or skins");
  const double wanted = std::max(2.0, std::floor(duration * frames_per_second + 0.5));
  if (!(wanted <= double{std::numeric_limits<uint32_t>::max()}))
    throw Error(ErrorKind::kLimitExceeded, files[0].string() + ": too many frames");
  const auto count = static_cast<uint32_t>(wanted);
  const std::vector<Mesh>& meshes = imported.scene.meshes;
  std::map<uint32_t, std::shared_ptr<GltfFrames>> deforming;
  progress.begin("posing frames", count - 1);
  for (uint32_t frame = 1; frame < count; ++frame) {
    progress.check_cancelled();
    std::vector<Mesh> posed = meshes_at(files, imported.scene, options, static_cast<double>(frame) / frames_per_second);
    for (uint32_t i = 0; i < posed.size(); ++i) {
      std::shared_ptr<GltfFrames>& frames = deforming[i];
      if (!frames && posed[i].positions == meshes[i].positions) continue;
      if (!frames) frames = std::make_shared<GltfFrames>(meshes[i], frames_per_second, options.memory);
      frames->repeat(frame);
      if (posed[i].positions != frames->positions(frame - 1)) frames->add(std::move(posed[i].positions));
    }
    progress.advance();
  }
  std::vector<MeshSequence> sequences;
  for (const auto& [mesh, frames] : deforming) {
    if (!frames) continue;
    frames->repeat(count);
    sequences.push_back({mesh, frames, frames_per_second, 0});
  }
  if (sequences.empty()) throw Error(ErrorKind::kInput, files[0].string() + ": its animation does not deform any mesh");
  return sequences;
}

} // namespace packtrace
