// Checks that the include lines of the tree follow the rooms of docs/architecture.md.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace {

namespace fs = std::filesystem;

struct Room {
  std::string folder;
  std::vector<std::string> may_include; ///< folders, besides its own
};

/// In the order of the pipeline.
const std::vector<Room> kRooms = {
    {"pbrt_import/base", {}},
    {"pbrt_import/scene", {"pbrt_import/base"}},
    {"pbrt_import/text", {"pbrt_import/base", "pbrt_import/scene", "pbrt_import/language"}},
    {"pbrt_import/files", {"pbrt_import/base", "pbrt_import/scene", "pbrt_import/text", "pbrt_import/shapes"}},
    {"pbrt_import/language", {"pbrt_import/base", "pbrt_import/scene", "pbrt_import/text", "pbrt_import/files"}},
    {"pbrt_import/shapes", {"pbrt_import/base", "pbrt_import/scene"}},
    {"pbrt_import/builder",
     {"pbrt_import/base", "pbrt_import/scene", "pbrt_import/text", "pbrt_import/files", "pbrt_import/language",
      "pbrt_import/shapes", "pbrt_import"}},
    {"pbrt_import/mesh_files",
     {"pbrt_import/base", "pbrt_import/scene", "pbrt_import/text", "pbrt_import/language", "pbrt_import/builder",
      "pbrt_import/gltf", "pbrt_import"}},
    {"pbrt_import/gltf",
     {"pbrt_import/base", "pbrt_import/scene", "pbrt_import/text", "pbrt_import/files", "pbrt_import/language",
      "pbrt_import/mesh_files"}},
    {"pbrt_import",
     {"pbrt_import/base", "pbrt_import/scene", "pbrt_import/text", "pbrt_import/files", "pbrt_import/language",
      "pbrt_import/builder", "pbrt_import/mesh_files"}},
    {"compress/format/layout", {"pbrt_import/scene"}},
    {"compress/format/cluster", {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout"}},
    {"compress/format/textures", {"pbrt_import/scene", "compress/format/layout"}},
    {"compress/format/shading", {"pbrt_import/base", "pbrt_import/scene"}},
    {"compress/format/voxels",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/file"}},
    {"compress/format/trees",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/cluster",
      "compress/format/file"}},
    {"compress/format/motion",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/deformation",
      "compress/format/file"}},
    {"compress/format/deformation",
     {"pbrt_import/base", "compress/format/layout", "compress/format/cluster", "compress/format/motion",
      "compress/format/file"}},
    {"compress/format/pages",
     {"pbrt_import/base", "compress/format/layout", "compress/format/cluster", "compress/format/trees",
      "compress/format/file"}},
    {"compress/format/file",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/cluster",
      "compress/format/textures", "compress/format/trees", "compress/format/motion", "compress/format/deformation",
      "compress/format/pages", "compress/format/shading", "compress/format/voxels"}},
    {"compress/bake/proxies",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/file",
      "compress/format/cluster", "compress/format/deformation", "compress/format/voxels", "compress/bake/lod/bound"}},
    {"compress/bake/plan",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/cluster",
      "compress/format/deformation", "compress/bake"}},
    {"compress/bake/grid",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/cluster", "compress/format/file", "compress/bake/plan",
      "compress/bake"}},
    {"compress/bake/clusters",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/cluster",
      "compress/format/trees", "compress/bake/plan", "compress/bake/grid", "compress/bake"}},
    {"compress/bake/lod/simplify", {"pbrt_import/base", "pbrt_import/scene"}},
    {"compress/bake/lod/bound",
     {"pbrt_import/base", "pbrt_import/scene", "compress/bake/clusters", "compress/bake/lod/simplify"}},
    {"compress/bake/lod",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/cluster",
      "compress/bake/clusters", "compress/bake/lod/simplify", "compress/bake/lod/bound"}},
    {"compress/bake/sequence",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/deformation",
      "compress/bake/plan", "compress/bake/grid", "compress/bake/clusters", "compress/bake"}},
    {"compress/bake/write",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/cluster",
      "compress/format/textures", "compress/format/trees", "compress/format/motion", "compress/format/file",
      "compress/format/shading", "compress/bake/plan", "compress/bake/clusters", "compress/bake/lod"}},
    {"compress/bake",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/cluster",
      "compress/format/textures", "compress/format/pages", "compress/format/file", "compress/format/deformation",
      "compress/bake/plan", "compress/bake/grid", "compress/bake/clusters", "compress/bake/lod",
      "compress/bake/sequence", "compress/bake/proxies", "compress/bake/write"}},
    {"compress/exchange/gltf",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/cluster", "compress/format/file"}},
    {"compress/exchange/scene",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/file", "compress/exchange/gltf"}},
    {"compress/exchange/shader",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/textures", "compress/format/voxels"}},
    {"compress/exchange/vertex16",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/cluster",
      "compress/format/textures", "compress/format/file"}},
    {"runtime/lod", {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout"}},
    {"runtime/motion",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/cluster", "compress/format/deformation",
      "compress/format/motion", "compress/format/file"}},
    {"runtime/trace/source",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/cluster", "compress/format/textures",
      "compress/format/shading", "compress/format/file", "runtime/lod"}},
    {"runtime/trace/packed/kernels", {"pbrt_import/base", "compress/format/layout"}},
    {"runtime/trace/packed/traversal", {"runtime/trace/packed/kernels"}},
    {"runtime/trace/packed/scene",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/cluster",
      "compress/format/trees", "compress/format/file", "compress/format/deformation", "runtime/trace/source",
      "runtime/trace/packed/kernels", "runtime/trace", "runtime"}},
    {"runtime/gpu/device", {"pbrt_import/base", "runtime/gpu/shaders", "runtime/gpu"}},
    {"runtime/gpu/shaders", {}},
    {"runtime/gpu/records", {"compress/format/cluster", "runtime/trace/packed/kernels", "runtime/denoise/kernels"}},
    {"runtime/gpu/structures",
     {"pbrt_import/base", "runtime/gpu/device", "runtime/gpu/records", "runtime/gpu/shaders", "runtime/gpu"}},
    {"runtime/gpu",
     {"pbrt_import/base", "runtime/gpu/device", "runtime/gpu/records", "runtime/gpu/shaders",
      "runtime/gpu/structures"}},
    {"runtime/trace/gpu",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/cluster",
      "compress/format/file", "runtime/lod", "runtime/gpu", "runtime/gpu/records", "runtime/gpu/structures",
      "runtime/trace/packed/scene", "runtime/trace"}},
    {"runtime/trace/embree",
     {"pbrt_import/base", "compress/format/trees", "runtime/trace/source", "runtime/trace/packed/scene",
      "runtime/trace"}},
    {"runtime/trace",
     {"pbrt_import/base", "pbrt_import/scene", "runtime/trace/source", "runtime/trace/packed/scene",
      "runtime/trace/embree", "runtime/trace/gpu", "runtime/gpu"}},
    {"runtime/camera",
     {"pbrt_import/base", "pbrt_import/scene", "runtime/lod", "runtime/trace/source", "runtime/trace/packed/kernels",
      "runtime/trace/packed/scene", "runtime/trace", "runtime"}},
    {"runtime/ao", {"pbrt_import/base", "pbrt_import/scene", "runtime/trace", "runtime/camera", "runtime"}},
    {"runtime/shade",
     {"pbrt_import/base", "pbrt_import/scene", "runtime/trace/source", "runtime/trace", "runtime/camera", "runtime/ao",
      "runtime"}},
    {"runtime/voxels",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/layout", "compress/format/file",
      "compress/format/voxels", "runtime/trace/source", "runtime/trace", "runtime/camera", "runtime/ao", "runtime"}},
    {"runtime/denoise/kernels", {"pbrt_import/base"}},
    {"runtime/denoise",
     {"pbrt_import/base", "runtime/camera", "runtime/denoise/kernels", "runtime/denoise/reference",
      "runtime/denoise/gpu", "runtime/gpu", "runtime"}},
    {"runtime/denoise/gpu", {"runtime/denoise", "runtime/gpu"}},
    {"runtime/denoise/reference", {"pbrt_import/base", "runtime/camera", "runtime/denoise", "runtime"}},
    {"runtime/frame",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/deformation", "compress/format/file", "runtime/lod",
      "runtime/trace/source", "runtime/trace/packed/scene", "runtime/trace", "runtime/camera", "runtime/ao",
      "runtime/voxels", "runtime/shade", "runtime/denoise", "runtime/image", "runtime/motion", "runtime"}},
    {"runtime/image", {"pbrt_import/base", "pbrt_import/scene", "runtime/camera"}},
    {"runtime/layered",
     {"pbrt_import/base", "pbrt_import/scene", "runtime/camera", "runtime/denoise", "runtime/frame", "runtime/image",
      "runtime"}},
    {"runtime/view",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/file", "runtime/trace/source", "runtime/camera",
      "runtime/denoise", "runtime/frame", "runtime/image", "runtime/motion", "runtime"}},
    {"runtime/view/window", {"pbrt_import/base", "runtime/view"}},
    {"runtime", {}},
    {"runtime/measure",
     {"pbrt_import/base", "pbrt_import/scene", "compress/bake", "compress/format/file", "runtime/trace/source",
      "runtime/trace/embree", "runtime/trace/packed/scene", "runtime/camera", "runtime/ao", "runtime/image",
      "runtime"}},
    {"runtime/commands/cli",
     {"pbrt_import/base", "pbrt_import/scene", "pbrt_import/text", "pbrt_import", "compress/format/file",
      "runtime/trace/source", "runtime/measure", "runtime/commands"}},
    {"runtime/commands/reports", {"pbrt_import/scene", "compress/format/file", "compress/bake/grid", "runtime/frame"}},
    {"runtime/commands/bake",
     {"pbrt_import/base", "pbrt_import/scene", "pbrt_import", "compress/format/voxels", "compress/format/deformation",
      "compress/bake/proxies", "compress/bake", "runtime/motion", "runtime", "runtime/measure", "runtime/commands",
      "runtime/commands/cli", "runtime/commands/reports"}},
    {"runtime/commands/compare",
     {"pbrt_import/base", "pbrt_import", "runtime/image", "runtime/measure", "runtime/commands",
      "runtime/commands/cli"}},
    {"runtime/commands/export",
     {"pbrt_import/base", "pbrt_import/text", "pbrt_import/files", "compress/format/voxels", "compress/format/file",
      "compress/bake/proxies", "compress/exchange/gltf", "compress/exchange/scene", "compress/exchange/shader",
      "compress/exchange/vertex16", "runtime/commands", "runtime/commands/cli", "runtime/commands/reports",
      "runtime/commands/bake"}},
    {"runtime/commands/render",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/file", "runtime/lod", "runtime/motion",
      "runtime/trace/packed/scene", "runtime/trace", "runtime/voxels", "runtime/denoise", "runtime/frame",
      "runtime/image", "runtime/layered", "runtime/view", "runtime", "runtime/commands", "runtime/commands/cli",
      "runtime/commands/reports", "runtime/commands/sequence"}},
    {"runtime/commands/sequence",
     {"pbrt_import/base", "pbrt_import/scene", "runtime/frame", "runtime/image", "runtime", "runtime/commands/cli",
      "runtime/commands/render"}},
    {"runtime/commands/denoise",
     {"pbrt_import/base", "runtime/layered", "runtime/view", "runtime", "runtime/commands", "runtime/commands/cli",
      "runtime/commands/render", "runtime/commands/sequence"}},
    {"runtime/commands/view",
     {"pbrt_import/base", "pbrt_import/scene", "compress/format/file", "runtime/motion", "runtime/image",
      "runtime/view", "runtime/view/window", "runtime", "runtime/commands", "runtime/commands/cli",
      "runtime/commands/reports", "runtime/commands/render"}},
    {"runtime/commands",
     {"pbrt_import/base", "pbrt_import/scene", "compress/bake/grid", "runtime/trace/source", "runtime/measure",
      "runtime/commands/cli", "runtime/commands/reports", "runtime/commands/compare"}},
    {"runtime/python",
     {"pbrt_import/base", "pbrt_import/scene", "pbrt_import", "compress/format/file", "compress/bake",
      "runtime/trace/source", "runtime/trace", "runtime/denoise", "runtime/frame", "runtime/commands/reports"}},
};

const Room* room_of(const std::string& path) {
  const std::string folder = fs::path(path).parent_path().generic_string();
  for (const Room& room : kRooms)
    if (folder == room.folder) return &room;
  return nullptr;
}

std::vector<std::string> project_includes(const fs::path& file) {
  std::vector<std::string> result;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("#include \"")) continue;
    const size_t end = line.find('"', 10);
    result.push_back(line.substr(10, end - 10));
  }
  return result;
}

std::vector<std::string> broken_rules(const std::string& path, const std::vector<std::string>& includes) {
  std::vector<std::string> broken;
  const Room* from = room_of(path);
  if (!from) return {path + " is in no room"};
  for (const std::string& include : includes) {
    const Room* to = room_of(include);
    if (!to) {
      broken.push_back(path + " includes " + include + ", which is in no room");
    } else if (to != from &&
               std::find(from->may_include.begin(), from->may_include.end(), to->folder) == from->may_include.end()) {
      broken.push_back(path + " includes " + include);
    }
  }
  return broken;
}

TEST(Architecture, IncludesFollowTheDataFlow) {
  const fs::path root = PACKTRACE_SOURCE_DIR;
  size_t files = 0;
  for (const char* top : {"pbrt_import", "compress", "runtime"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cpp") continue;
      ++files;
      const std::string path = fs::relative(entry.path(), root).generic_string();
      for (const std::string& broken : broken_rules(path, project_includes(entry.path()))) ADD_FAILURE() << broken;
    }
  }
  EXPECT_GT(files, 40u) << "the tree was not found";
}

TEST(Architecture, TheCheckSeesABrokenRule) {
  EXPECT_EQ(broken_rules("compress/format/x.cpp", {"compress/bake/bake_scene.h"}).size(), 1u);
  EXPECT_EQ(broken_rules("runtime/trace/x.cpp", {"pbrt_import/language/parser.h"}).size(), 1u);
  EXPECT_EQ(broken_rules("runtime/trace/x.cpp", {"parser.h"}).size(), 1u);
  EXPECT_TRUE(broken_rules("compress/bake/x.cpp", {"compress/format/file/baked_file.h", "compress/bake/y.h"}).empty());
}

} // namespace
