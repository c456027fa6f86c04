#include "runtime/commands/json_output.h"

#include <cstdio>
#include <span>

#include <nlohmann/json.hpp>

#include "pbrt_import/scene/error.h"
#include "pbrt_import/scene/file_bytes.h"

namespace packtrace {

JsonOutput::JsonOutput(const std::string& destination, bool force) : to_stdout_(destination == "-") {
  if (!destination.empty() && !to_stdout_) file_.emplace(destination, force);
}

void JsonOutput::write(const nlohmann::json& document) {
  if (!wanted()) return;
  const std::string text = document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  if (file_) {
    write_file_bytes(file_->path(), std::as_bytes(std::span(text)));
    file_->commit();
  } else if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw Error(ErrorKind::kIo, "cannot write JSON to standard output");
  }
}

} // namespace packtrace
