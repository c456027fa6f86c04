// Checks the layering of docs/architecture.md against the include lines of the source files.

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
  std::vector<std::string> may_include; ///< folders that it may include from, besides its own
};

// The first match decides, so longer paths come before shorter ones.
const std::vector<Layer> kLayers = {
    {"pbrt_import/scene/", {}},
    {"pbrt_import/", {"pbrt_import/scene/"}},
    {"compress/bvh/", {"pbrt_import/scene/"}},
    {"compress/format/", {"compress/bvh/", "pbrt_import/scene/"}},
    {"compress/bake/", {"compress/bvh/", "compress/format/", "pbrt_import/scene/"}},
    {"compress/exchange/", {"compress/format/", "pbrt_import/scene/"}},
    {"runtime/lod/", {"compress/format/", "pbrt_import/scene/"}},
    {"runtime/commands/",
     {"runtime/", "runtime/lod/", "compress/format/", "compress/bake/", "compress/exchange/", "pbrt_import/",
      "pbrt_import/scene/"}},
    {"runtime/", {"runtime/lod/", "compress/bvh/", "compress/format/", "pbrt_import/scene/"}},
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
