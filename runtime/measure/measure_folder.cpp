#include "runtime/measure/measure_folder.h"

#include <fstream>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <xxhash.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/output_file.h"

namespace packtrace {
namespace fs = std::filesystem;
namespace {

constexpr const char* kIdentityFile = "measure.json";

std::optional<nlohmann::json> read_json(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  nlohmann::json document = nlohmann::json::parse(in, nullptr, false);
  if (!in || document.is_discarded()) return std::nullopt;
  return document;
}

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
  throw Error(ErrorKind::kIo, path.string() + ": " + why);
}

} // namespace

std::string key_of(const std::string& text) { return fmt::format("{:016x}", XXH3_64bits(text.data(), text.size())); }

std::string state_of(std::span<const fs::path> files) {
  std::string text;
  for (const fs::path& file : files) {
    std::error_code missing;
    const uint64_t bytes = fs::file_size(file, missing);
    const auto time = fs::last_write_time(file, missing).time_since_epoch().count();
    text += file.string() + (missing ? std::string(" -") : fmt::format(" {} {}", bytes, time)) + "\n";
  }
  return text;
}

void write_text_file(const fs::path& file, const std::string& text) {
  OutputFile output(file, true);
  output.write(std::as_bytes(std::span(text)));
  output.commit();
}

void write_json(const fs::path& file, const nlohmann::json& document) {
  write_text_file(file, document.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

MeasureFolder::MeasureFolder(fs::path path, const nlohmann::json& identity, bool force) : path_(std::move(path)) {
  std::error_code error;
  const fs::file_status status = fs::status(path_, error);
  if (fs::exists(status) && !fs::is_directory(status)) refuse(path_, "is a file; -o needs a folder");
  if (fs::exists(status)) {
    const std::optional<nlohmann::json> known = read_json(path_ / kIdentityFile);
    if (!known && !fs::is_empty(path_, error))
      refuse(path_, "has other content, and is not a folder of packtrace measure");
    if (known && *known != identity) {
      if (!force)
        refuse(path_, "belongs to another scene, state of it or version (" + known->value("scene", std::string("?")) +
                          ", " + known->value("version", std::string("?")) + "); --force starts it anew");
      for (const char* part : {"points", "reference", "pictures", "work"}) fs::remove_all(path_ / part, error);
    }
  }
  for (const char* part : {"points", "reference", "pictures", "work"})
    if (fs::create_directories(path_ / part, error); error)
      refuse(path_ / part, "cannot be created: " + error.message());
  write_json(path_ / kIdentityFile, identity);
}

std::optional<nlohmann::json> MeasureFolder::load(const std::string& key) const {
  return read_json(path_ / "points" / (key + ".json"));
}

void MeasureFolder::save(const std::string& key, const nlohmann::json& part) const {
  write_json(path_ / "points" / (key + ".json"), part);
}

} // namespace packtrace
