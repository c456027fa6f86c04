#include "pbrt_import/ply_sequence.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/files/frame_pattern.h"
#include "pbrt_import/files/ply.h"
#include "pbrt_import/text/input_file.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMaxPlyBytes = std::numeric_limits<uint64_t>::max() / 2;
constexpr int64_t kMaxNumber = 999'999'999'999'999'999; // 18 digits, as FramePattern writes and reads

[[noreturn]] void fail_frame(const std::string& frame, const std::string& what) {
  std::string message = frame;
  message.append(": ").append(what);
  throw Error(ErrorKind::kInput, message);
}

/// Reads a frame; its name is used in messages only.
Mesh read_frame(const fs::path& file, const std::string& name) {
  std::string problem; // the first one that changes positions or triangles
  const ReportFn report = [&](Severity severity, uint32_t, std::string message) {
    if (problem.empty() && severity != Severity::kNote && message.find("position not finite") != std::string::npos)
      problem = std::move(message);
  };
  try {
    PlyMesh ply = read_ply(read_whole_file(file, kMaxPlyBytes, nullptr), report);
    if (!problem.empty()) fail_frame(name, problem + "; every frame needs finite positions");
    return std::move(ply.mesh);
  } catch (const Error& error) {
    const std::string what = error.what();
    if (what.starts_with(name)) throw;
    throw Error(error.kind(), what.find(file.string()) != std::string::npos ? what : name + ": " + what);
  }
}

class PlyFrames final : public MeshFrames {
public:
  PlyFrames(FramePattern pattern, int64_t first, uint32_t count, std::vector<Triangle> triangles, size_t vertices)
      : pattern_(std::move(pattern)), first_(first), count_(count), triangles_(std::move(triangles)),
        vertices_(vertices) {}

  uint32_t count() const override { return count_; }

  std::string name(uint32_t frame) const override {
    std::string name = "frame " + std::to_string(first_ + frame);
    name.append(" (").append(pattern_.file(first_ + frame).string()).append(")");
    return name;
  }

  std::vector<Vec3> positions(uint32_t frame) const override {
    Mesh mesh = read_frame(pattern_.file(first_ + frame), name(frame));
    check_topology(mesh, frame);
    return std::move(mesh.positions);
  }

private:
  void check_topology(const Mesh& mesh, uint32_t frame) const {
    const auto differ = [&](const char* what, size_t here, size_t in_first) {
      std::string text = std::to_string(here);
      text.append(" ").append(what).append(", but ").append(name(0)).append(" has ").append(std::to_string(in_first));
      fail_frame(name(frame), text.append("; all frames need the same topology"));
    };
    if (mesh.positions.size() != vertices_) differ("vertices in triangles", mesh.positions.size(), vertices_);
    if (mesh.triangles.size() != triangles_.size()) differ("triangles", mesh.triangles.size(), triangles_.size());
    const auto [here, there] = std::ranges::mismatch(mesh.triangles, triangles_);
    if (here == mesh.triangles.end()) return;
    const auto list = [](const Triangle& t) {
      std::string text = std::to_string(t.x);
      text.append(" ").append(std::to_string(t.y)).append(" ").append(std::to_string(t.z));
      return text;
    };
    std::string text = "triangle " + std::to_string(here - mesh.triangles.begin());
    text.append(" has the vertices ").append(list(*here)).append(", but ").append(list(*there)).append(" in ");
    fail_frame(name(frame), text.append(name(0)).append("; all frames need the same topology"));
  }

  const FramePattern pattern_;
  const int64_t first_;
  const uint32_t count_;
  const std::vector<Triangle> triangles_;
  const size_t vertices_;
};

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code error;
  const bool same = fs::equivalent(a, b, error);
  return !error && same;
}

/// Numbers of the pattern's frames that are files of the scene.
std::vector<int64_t> numbers_in_scene(const FramePattern& pattern, std::span<const fs::path> files) {
  std::vector<int64_t> numbers;
  for (const fs::path& file : files)
    if (const std::optional<int64_t> number = pattern.number_of(file.filename().string()))
      if (same_file(pattern.file(*number), file)) numbers.push_back(*number);
  std::ranges::sort(numbers);
  return numbers;
}

[[noreturn]] void fail_without_mesh(const std::string& wanted, std::span<const fs::path> files,
                                    const fs::path& main_file) {
  std::vector<std::string> names;
  for (const fs::path& file : files)
    if (const std::string name = file.filename().string(); name.find(".ply") != std::string::npos)
      names.push_back(name);
  std::ranges::sort(names);
  std::string message = main_file.string() + ": no shape uses the mesh " + wanted;
  if (names.empty()) {
    message += "; the scene has no PLY meshes";
  } else {
    const std::vector<std::string_view> views(names.begin(), names.end());
    std::string_view nearest = closest_name(fs::path(wanted).filename().string(), views);
    if (nearest.empty()) nearest = views.front();
    message.append("; did you mean ").append(nearest).append("?");
  }
  throw Error(ErrorKind::kInput, message);
}

/// Number of frames from `first` on. Throws Error(kInput) if one is missing before others.
uint32_t count_frames(const FramePattern& pattern, int64_t first) {
  int64_t end = first;
  std::error_code error;
  while (end < kMaxNumber && fs::exists(pattern.file(end), error)) ++end;
  std::optional<int64_t> later;
  const fs::path folder = pattern.folder().empty() ? fs::path(".") : pattern.folder();
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (const auto number = pattern.number_of(entry.path().filename().string()); number && *number > end)
      later = std::min(later.value_or(*number), *number);
  if (later)
    fail_frame("frame " + std::to_string(end) + " (" + pattern.file(end).string() + ")",
               "the file is missing, but that of frame " + std::to_string(*later) + " exists");
  if (end - first < 2)
    fail_frame("sequence '" + pattern.text() + "'",
               "it has one frame only, " + pattern.file(first).string() + "; a sequence needs at least two");
  if (end - first > std::numeric_limits<uint32_t>::max()) fail_frame(pattern.text(), "too many frames");
  return static_cast<uint32_t>(end - first);
}

} // namespace

MeshSequence find_mesh_sequence(const Scene& scene, std::span<const fs::path> files, const fs::path& main_file,
                                const std::string& text, std::optional<int64_t> start, double frames_per_second) {
  FramePattern pattern(text);
  if (start && (*start < 0 || *start >= kMaxNumber))
    throw Error(ErrorKind::kUsage, "the number of a sequence's first frame must be 0 .. 10^18 - 2");
  std::vector<int64_t> numbers = numbers_in_scene(pattern, files);
  if (numbers.empty()) {
    const FramePattern beside = pattern.below(main_file.parent_path());
    numbers = numbers_in_scene(beside, files);
    if (!numbers.empty()) pattern = beside;
  }
  const std::string wanted = start ? pattern.file(*start).string() : "of any frame of '" + text + "'";
  if (numbers.empty() || (start && !std::ranges::binary_search(numbers, *start)))
    fail_without_mesh(wanted, files, main_file);
  const int64_t first = start.value_or(numbers.front());
  const fs::path file = pattern.file(first);
  std::string frame = "frame " + std::to_string(first);
  frame.append(" (").append(file.string()).append(")");
  const Mesh mesh = read_frame(file, frame);
  for (uint32_t i = 0; i < scene.meshes.size(); ++i) {
    const Mesh& own = scene.meshes[i];
    if (own.name != file.filename().string() || own.positions != mesh.positions || own.triangles != mesh.triangles)
      continue;
    const uint32_t count = count_frames(pattern, first);
    return {i, std::make_shared<PlyFrames>(pattern, first, count, mesh.triangles, mesh.positions.size()),
            frames_per_second, first};
  }
  fail_without_mesh(file.string(), files, main_file);
}

} // namespace packtrace
