#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace packtrace {

/// 16 hexadecimal digits that identify a text.
std::string key_of(const std::string& text);

/// A text that changes with the names, sizes and times of change of files; files that do not exist count as such.
std::string state_of(std::span<const std::filesystem::path> files);

/// Writes a document completely or not at all, and replaces an existing one. Throws Error(kIo).
void write_json(const std::filesystem::path& file, const nlohmann::json& document);
void write_text_file(const std::filesystem::path& file, const std::string& text);

/// The folder of a measurement. Each finished part is a separate file, so that an interrupted measurement continues.
class MeasureFolder {
public:
  /// Opens the folder of an earlier measurement, or creates it.
  /// @param identity text that identifies the scene and the program's version
  /// @param force remove the parts of another identity instead of failing
  /// Throws Error(kIo) if the path is a file, if the folder has other content, belongs to another identity, or cannot
  /// be written.
  MeasureFolder(std::filesystem::path path, const nlohmann::json& identity, bool force);

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

  /// A finished part; none if there is none or it cannot be read.
  std::optional<nlohmann::json> load(const std::string& key) const;
  void save(const std::string& key, const nlohmann::json& part) const;
  /// File of a part's image.
  std::filesystem::path image(const std::string& key) const { return path_ / "points" / (key + ".exr"); }

private:
  std::filesystem::path path_;
};

} // namespace packtrace
