// report.json and report.csv have the keys that docs/measure.md lists, and no others.

#include <cctype>
#include <filesystem>
#include <map>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "runtime/measure/stability.h"
#include "tests/end_to_end/measured_report.h"

namespace packtrace::test {
namespace {

using Json = nlohmann::json;

/// The documented keys of an object, or of the objects of an array; none for other values.
struct Shape {
  std::map<std::string, Shape> keys;
  std::string like; ///< name of the point's value that has the same keys
};

/// Parses "{a: {b}, c: [{d}], e: ao}".
class ShapeParser {
public:
  explicit ShapeParser(std::string_view text) : text_(text) {}

  Shape object() {
    Shape shape;
    expect('{');
    do {
      const std::string name = word();
      EXPECT_FALSE(name.empty()) << text_;
      Shape& value = shape.keys[name];
      if (skip(':')) value = skip('[') ? array() : next() == '{' ? object() : Shape{{}, word()};
    } while (skip(','));
    expect('}');
    return shape;
  }

private:
  Shape array() {
    Shape shape = object();
    expect(']');
    return shape;
  }
  char next() {
    while (at_ < text_.size() && text_[at_] == ' ') ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool skip(char c) {
    if (next() != c) return false;
    ++at_;
    return true;
  }
  void expect(char c) { EXPECT_TRUE(skip(c)) << c << " missing at " << at_ << " of " << text_; }
  std::string word() {
    std::string name;
    for (next(); at_ < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[at_])) || text_[at_] == '_');
         ++at_)
      name += text_[at_];
    return name;
  }

  std::string_view text_;
  size_t at_ = 0;
};

std::vector<std::string> code_spans(const std::string& text) {
  std::vector<std::string> spans;
  const std::regex span("`([^`]*)`");
  for (std::sregex_iterator it(text.begin(), text.end(), span), end; it != end; ++it) spans.push_back((*it)[1]);
  return spans;
}

/// Keys that a row's second cell describes.
Shape described(const std::string& cell) {
  std::smatch match;
  if (std::regex_search(cell, match, std::regex("^like `(\\w+)` of a point"))) return {{}, match[1]};
  Shape shape;
  for (const std::string& span : code_spans(cell)) {
    const size_t brace = span.find('{');
    if (brace > 1 || span.size() < 3) continue; // "{" or "[{"
    const Shape found = ShapeParser(std::string_view(span).substr(brace)).object();
    if (!shape.keys.empty()) { // "`{a, b}`, each of `{c}`"
      for (auto& [name, value] : shape.keys) value = found;
      break;
    }
    shape = found;
    if (cell.find(", each of") == std::string::npos) break;
  }
  return shape;
}

/// The report that the document describes.
Shape documented_report() {
  const std::string text = read_text(std::filesystem::path(PACKTRACE_SOURCE_DIR) / "docs/measure.md");
  std::istringstream lines(
      text.substr(text.find("\n## report.json"), text.find("\n## report.csv") - text.find("\n## report.json")));
  Shape report;
  Shape* object = &report;
  std::smatch match;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("### ")) object = nullptr;
    if (line == "### reference") object = &report.keys["reference"];
    if (line == "### A point") object = &report.keys["points"];
    if (object && std::regex_match(line, match, std::regex("\\| (`.*?`) \\| (.*) \\|")))
      for (const std::string& name : code_spans(match[1])) object->keys[name] = described(match[2]);
    if (std::regex_search(line, match, std::regex("`(\\w+)` is an array of `(\\{[^`]*\\})`")))
      report.keys[match[1]] = ShapeParser(match[2].str()).object();
  }
  return report;
}

void add_objects(const Json& value, std::vector<const Json*>& objects) {
  if (value.is_object()) objects.push_back(&value);
  if (value.is_array())
    for (const Json& element : value) add_objects(element, objects);
}

/// Compares the keys of all values at a place.
void compare(const Shape& shape, const Shape& point, const std::vector<const Json*>& values, const std::string& place) {
  const Shape& expected = shape.like.empty() ? shape : point.keys.at(shape.like);
  std::vector<const Json*> objects;
  for (const Json* value : values) add_objects(*value, objects);
  for (const Json* object : objects)
    for (const auto& [key, value] : object->items())
      EXPECT_TRUE(expected.keys.contains(key)) << place << key << " is not documented";
  if (objects.empty()) return;
  for (const auto& [key, part] : expected.keys) {
    std::vector<const Json*> parts;
    for (const Json* object : objects) {
      EXPECT_TRUE(object->contains(key)) << place << key << " is documented, but missing in "
                                         << object->dump().substr(0, 200);
      if (object->contains(key)) parts.push_back(&object->at(key));
    }
    compare(part, point, parts, place + key + ".");
  }
}

TEST(ReportSchema, HasExactlyTheDocumentedKeys) {
  const Workbench& bench = measured_report().bench;
  ASSERT_EQ(measured_report().continued.exit_code, 0);
  const Shape documented = documented_report();
  ASSERT_GT(documented.keys.size(), 20u);
  ASSERT_GT(documented.keys.at("points").keys.size(), 20u);
  const Json report = Json::parse(read_text(bench / "report/report.json"));
  compare(documented, documented.keys.at("points"), {&report}, "");
  const Json stability = to_json(StabilityResult{}); // empty with --quick
  compare(documented.keys.at("stability"), {}, {&stability}, "stability.");
  const Json& median_edge = report.at("scene").at("median_edge");
  EXPECT_GT(median_edge.get<double>(), 0.0);

  const std::string document = read_text(std::filesystem::path(PACKTRACE_SOURCE_DIR) / "docs/measure.md");
  std::string columns;
  for (const std::string& name : code_spans(document.substr(document.find("Columns:"))))
    columns += (columns.empty() ? "" : ",") + name;
  const std::string csv = read_text(bench / "report/report.csv");
  EXPECT_EQ(csv.substr(0, csv.find('\n')), columns);
}

} // namespace
} // namespace packtrace::test
