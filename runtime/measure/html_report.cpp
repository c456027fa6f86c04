#include "runtime/measure/html_report.h"

#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "runtime/measure/measure_folder.h"

namespace packtrace {
namespace {

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return result;
}

} // namespace

void write_html_report(const nlohmann::json& report_json, const std::filesystem::path& /*pictures*/,
                       const std::filesystem::path& out) {
  std::string html =
      fmt::format("<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>packtrace measure: {0}"
                  "</title><h1>{0}</h1>\n",
                  escaped(report_json.at("/scene/name"_json_pointer).get<std::string>()));
  for (const nlohmann::json& answer : report_json.at("answers"))
    html += fmt::format("<h2>{}</h2><p>{}</p>\n", escaped(answer.at("question").get<std::string>()),
                        escaped(answer.at("text").get<std::string>()));
  write_text_file(out, html + "</html>\n");
}

} // namespace packtrace
