#include "tests/fuzz/scene_files.h"

#include <algorithm>
#include <fstream>
#include <stdexcept>

namespace packtrace::fuzz {
namespace {

constexpr std::string_view kMark = "\n#file ";

bool is_name(std::string_view text) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
  constexpr size_t kMaxName = 64;
  return !text.empty() && text.size() <= kMaxName && text.find_first_not_of(kLetters) == std::string_view::npos &&
         text.find_first_not_of('.') != std::string_view::npos;
}

std::filesystem::path memory_folder() {
  const std::filesystem::path memory = "/dev/shm";
  return std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path();
}

} // namespace

std::vector<SceneFile> split_scene(std::string_view text) {
  std::vector<SceneFile> files{{"scene.pbrt", text}};
  for (size_t mark = text.find(kMark); mark != std::string_view::npos; mark = text.find(kMark, mark + 1)) {
    const size_t name_start = mark + kMark.size();
    const size_t name_end = text.find('\n', name_start);
    if (name_end == std::string_view::npos) continue;
    const std::string_view name = text.substr(name_start, name_end - name_start);
    if (!is_name(name)) continue;
    std::string_view& last = files.back().content;
    const auto last_start = static_cast<size_t>(last.data() - text.data());
    last = text.substr(last_start, mark < last_start ? 0 : mark - last_start);
    if (files.size() == kMaxSceneFiles) break;
    files.push_back({name, text.substr(name_end + 1)});
  }
  return files;
}

SceneFilesFolder::SceneFilesFolder() : folder_(memory_folder()) {}

std::filesystem::path SceneFilesFolder::write(std::string_view text) {
  for (const auto& file : files_) std::filesystem::remove(file);
  files_.clear();
  for (const SceneFile& file : split_scene(text)) {
    files_.push_back(folder_ / std::string(file.name));
    std::ofstream out(files_.back(), std::ios::binary);
    out.write(file.content.data(), static_cast<std::streamsize>(file.content.size()));
    if (!out.flush()) throw std::runtime_error("cannot write " + files_.back().string());
  }
  return files_.front();
}

} // namespace packtrace::fuzz
