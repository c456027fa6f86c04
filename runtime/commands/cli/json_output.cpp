#include "runtime/commands/cli/json_output.h"

#include <cstdio>
#include <span>

#include <nlohmann/json.hpp>

#include "pbrt_import/base/file_error.h"
#include "runtime/commands/cli/option_checks.h"

namespace packtrace {
namespace {

const char* name_of(ErrorKind kind) {
  switch (kind) {
  case ErrorKind::kUsage:
    return "usage";
  case ErrorKind::kInput:
    return "input";
  case ErrorKind::kUnsupported:
    return "unsupported";
  case ErrorKind::kLimitExceeded:
    return "limit_exceeded";
  case ErrorKind::kIo:
    return "io";
  case ErrorKind::kCancelled:
    return "cancelled";
  }
  return "internal";
}

nlohmann::json or_null(uint32_t number) { return number > 0 ? nlohmann::json(number) : nlohmann::json(); }

} // namespace

JsonOutput::JsonOutput(const std::string& destination, bool force) : to_stdout_(destination == "-") {
  if (destination.empty() || to_stdout_) return;
  refuse_foreign_ending(destination, {".json"}, "--json", {});
  file_.emplace(destination, force);
}

void JsonOutput::write(const nlohmann::json& document) {
  if (!wanted()) return;
  const std::string text = document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  if (file_) {
    file_->write(std::as_bytes(std::span(text)));
    file_->commit();
  } else if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw Error(ErrorKind::kIo, "cannot write JSON to standard output");
  }
}

nlohmann::json error_json(const std::string& kind, int exit_code, const std::string& message) {
  return {{"kind", kind},    {"exit_code", exit_code}, {"message", message},
          {"file", nullptr}, {"line", nullptr},        {"column", nullptr}};
}

nlohmann::json error_json(const Error& error) {
  nlohmann::json json = error_json(name_of(error.kind()), error.exit_code(), error.what());
  if (const auto* place = dynamic_cast<const FileError*>(&error); place && !place->file().empty()) {
    json["file"] = place->file();
    json["line"] = or_null(place->line());
    json["column"] = or_null(place->column());
  }
  return json;
}

} // namespace packtrace
