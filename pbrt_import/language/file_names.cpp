#include "pbrt_import/language/file_names.h"

#include <algorithm>
#include <system_error>

#include "pbrt_import/text/reporter.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

bool file_exists(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::exists(path, error) && !error;
}

} // namespace

FileNames::FileNames(std::filesystem::path folder, bool allow_outside)
    : folder_(std::move(folder)), allow_outside_(allow_outside) {}

void FileNames::mention(std::string_view raw) {
  bool unknown_escape = false;
  if (const std::string name = unescape(raw, unknown_escape); !name.empty())
    named_.insert((folder_ / name).lexically_normal().string());
}

std::vector<std::filesystem::path> FileNames::take_named() {
  std::vector<std::filesystem::path> paths;
  while (!named_.empty()) paths.emplace_back(std::move(named_.extract(named_.begin()).value()));
  return paths;
}

std::filesystem::path FileNames::resolve(std::string_view raw, const Place& place, Reporter& reporter) {
  bool unknown_escape = false;
  const std::string name = unescape(raw, unknown_escape);
  if (name.empty()) {
    reporter.error(place, "empty file name; nothing is read");
    return {};
  }
  if (embedded_.contains(name)) return name;
  if (accepted_.contains(name)) {
    named_.insert(name);
    return name;
  }
  std::filesystem::path path = (folder_ / name).lexically_normal();
  if (raw.find('\\') != std::string_view::npos && !file_exists(path)) {
    // The backslashes are literal separators: "textures\brick.png" does not contain a backspace.
    std::string slashes;
    for (const char c : raw)
      if (c != '\\')
        slashes += c;
      else if (slashes.empty() || slashes.back() != '/')
        slashes += '/';
    if (const std::filesystem::path candidate = (folder_ / slashes).lexically_normal();
        file_exists(candidate) || unknown_escape) {
      path = candidate;
      reporter.warning(place, "file names have back-slashes, " + in_quotes(raw) + "; read as slashes");
    }
  }
  if (!allow_outside_) {
    std::error_code error;
    const auto real_folder = std::filesystem::weakly_canonical(folder_.empty() ? "." : folder_, error);
    const auto relative = std::filesystem::weakly_canonical(path, error).lexically_relative(real_folder);
    if (error || relative.empty() || *relative.begin() == "..") {
      reporter.error(place, "file name " + in_quotes(raw) + " leads out of the scene's folder; it is not read");
      return {};
    }
  }
  named_.insert(path.string());
  return path;
}

} // namespace packtrace
