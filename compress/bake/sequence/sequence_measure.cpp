#include "compress/bake/sequence/sequence_measure.h"

#include <array>
#include <bit>
#include <string>
#include <unordered_map>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/weld_table.h"

namespace packtrace {
namespace {

constexpr size_t kGrainVertices = 1u << 14;

/// Two hashes of the positions of a vertex in all frames. They are equal for different paths with a probability of
/// about 2^-100 for a million vertices; SequencePacker compares all positions of vertices that it merges.
using PathHash = std::array<uint64_t, 2>;

void extend_path(PathHash& path, Vec3 p) {
  p += Vec3(0.0f); // -0 is 0
  const uint64_t xy = std::bit_cast<uint32_t>(p.x) | uint64_t{std::bit_cast<uint32_t>(p.y)} << 32,
                 z = std::bit_cast<uint32_t>(p.z);
  path = {mix_words(path[0], xy, z), mix_words(z + 0x9e3779b97f4a7c15, path[1], xy)};
}

struct HashOfPath {
  size_t operator()(const PathHash& path) const { return static_cast<size_t>(path[0]); }
};

} // namespace

SequenceMeasure measure_sequence(const Scene& scene, const MeshSequence& sequence, Progress& progress) {
  const Mesh& mesh = scene.meshes[sequence.mesh];
  const MeshFrames& frames = *sequence.frames;
  if (frames.count() < 2) throw Error(ErrorKind::kInput, "the sequence of " + mesh.name + " has one frame only");
  SequenceMeasure result;
  std::vector<PathHash> paths(mesh.positions.size(), PathHash{1, 2});
  for (uint32_t frame = 0; frame < frames.count(); ++frame) {
    progress.check_cancelled();
    const std::vector<Vec3> positions = frames.positions(frame);
    if (positions.size() != paths.size() || (frame == 0 && positions != mesh.positions))
      throw Error(ErrorKind::kInput, frames.name(frame) + ": its vertices are not those of " + mesh.name);
    tbb::parallel_for(tbb::blocked_range<size_t>(0, paths.size(), kGrainVertices), [&](const auto& range) {
      for (size_t v = range.begin(); v < range.end(); ++v) extend_path(paths[v], positions[v]);
    });
    for (const Vec3& p : positions)
      if (!is_finite(p)) throw Error(ErrorKind::kInput, frames.name(frame) + ": a vertex position is not finite");
    result.bounds.extend(bounds_of(positions));
    progress.advance();
  }
  std::unordered_map<PathHash, uint32_t, HashOfPath> first_with;
  first_with.reserve(paths.size());
  for (uint32_t v = 0; v < paths.size(); ++v)
    result.same_path.push_back(first_with.try_emplace(paths[v], v).first->second);
  return result;
}

} // namespace packtrace
