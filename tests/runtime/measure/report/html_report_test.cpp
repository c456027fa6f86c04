#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "runtime/image/png.h"
#include "runtime/measure/html_report.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

using nlohmann::json;

constexpr size_t kLimit = 2'000'000;

/// Text between two markers.
std::string between(const std::string& text, const std::string& begin, const std::string& end) {
  const size_t from = text.find(begin);
  if (from == text.npos) return "";
  const size_t to = text.find(end, from + begin.size());
  return text.substr(from + begin.size(), to - from - begin.size());
}

/// The data of a page, as its script reads it.
json data_of(const std::string& page) {
  return json::parse(between(page, R"(<script type="application/json" id="data">)", "</script>"));
}

size_t count_of(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++count;
  return count;
}

/// Decodes a data: URI.
Image picture_of(const std::string& uri) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const std::string text = uri.substr(uri.find(',') + 1);
  std::vector<std::byte> bytes;
  uint32_t bits = 0, count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<uint32_t>(kDigits.find(c));
    count += 6;
    if (count >= 8) bytes.push_back(static_cast<std::byte>(bits >> (count -= 8) & 255));
  }
  return decode_png(bytes, "picture", PngTransfer::kRaw);
}

/// Noise does not compress.
void write_noise(const std::filesystem::path& path, uint32_t width, uint32_t height, uint32_t seed) {
  std::mt19937 random(seed);
  Image image({width, height}, 3);
  for (float& sample : image.data) sample = static_cast<float>(random() % 256) / 255.0f;
  write_png(path, image, PngTransfer::kRaw);
}

/// A report with `count` pictures of noise in a folder.
json with_pictures(const std::filesystem::path& folder, uint32_t count, uint32_t width, uint32_t height) {
  json report{{"pictures", json::array()}};
  for (uint32_t i = 0; i < count; ++i) {
    const std::string name = "packed" + std::to_string(i) + ".png";
    write_noise(folder / name, width, height, i);
    report["pictures"].push_back({{"id", "p" + std::to_string(i)}, {"packed", name}});
  }
  return report;
}

json with_points(size_t count, const std::string& label = "") {
  json geometries = json::array();
  for (int i = 0; i < 10; ++i) geometries.push_back({{"name", "a geometry with a name"}, {"max_distance", 1e-5 * i}});
  json report{{"points", json::array()}};
  for (size_t i = 0; i < count; ++i)
    report["points"].push_back(
        {{"id", "p" + std::to_string(i)},
         {"label", label},
         {"flags", {{"default", i == 0}, {"fronts", i % 10 == 1 ? json{"bytes-error"} : json::array()}}},
         {"histograms", {{"ao", {{"edges", std::vector<int>(65, 123456)}, {"counts", std::vector<int>(64, 123456)}}}}},
         {"worst_geometries", {{"by_error", geometries}, {"by_bytes", geometries}}}});
  return report;
}

TEST(HtmlReport, NamesOfTheSceneCannotAddMarkup) {
  const std::string hostile = "</script><script>alert(1)</script><!-- \"'&<img src=x onerror=alert(2)> {{script}}";
  const std::string page = html_report({{"scene", {{"name", hostile}}}, {"command", hostile}}, ".");
  EXPECT_EQ(data_of(page)["scene"]["name"], hostile);
  EXPECT_EQ(data_of(page)["command"], hostile);
  EXPECT_EQ(page.find("<script>alert"), page.npos);
  EXPECT_EQ(page.find("<img src=x"), page.npos);
  EXPECT_EQ(count_of(page, "<script"), 2u) << "the data and the page's own script";
  EXPECT_EQ(count_of(page, "</script"), 2u);
  EXPECT_EQ(between(page, "<title>", "</title>").substr(0, 22), "&#60;/script&#62;&#60;");
}

TEST(HtmlReport, BytesThatAreNotUtf8AreReplaced) {
  const std::string latin = "caf\xe9 \xff.ply", replaced = "caf\xef\xbf\xbd \xef\xbf\xbd.ply";
  const std::string page = html_report({{"scene", {{"name", latin}}}}, ".");
  EXPECT_EQ(data_of(page)["scene"]["name"], replaced);
  EXPECT_EQ(between(page, "<title>", "</title>").substr(0, replaced.size()), replaced);
}

TEST(HtmlReport, PolicyAllowsItsOwnStyleAndScriptAlone) {
  const std::string page = html_report(json::object(), ".");
  const std::string policy = between(page, "http-equiv=\"Content-Security-Policy\" content=\"", "\">");
  EXPECT_TRUE(policy.starts_with("default-src 'none'; img-src data:; style-src 'sha256-")) << policy;
  EXPECT_EQ(count_of(policy, "'sha256-"), 2u);
  EXPECT_EQ(policy.find("unsafe"), policy.npos);
  // Base64 of 32 bytes: 43 digits and one "=".
  EXPECT_EQ(between(policy, "script-src 'sha256-", "'").size(), 44u);
  EXPECT_LT(page.find(policy), page.find("<style>"));
  EXPECT_EQ(page.find("{{"), page.npos) << "a placeholder remains";
}

TEST(HtmlReport, NothingRefersToOtherFiles) {
  const std::string page = html_report(json::object(), ".");
  for (const char* reference : {"https:", "http://", "@import", "url(", "src=\"", "<link"}) {
    const size_t at = page.find(reference);
    const bool is_namespace = at != page.npos && page.compare(at, 18, "http://www.w3.org/") == 0;
    EXPECT_TRUE(at == page.npos || is_namespace) << reference;
  }
}

TEST(HtmlReport, PicturesAreEmbeddedUnchangedAndOnce) {
  const TemporaryFolder folder;
  json report = with_pictures(folder.path(), 1, 5, 4);
  report["pictures"].push_back(report["pictures"][0]);
  const std::string page = html_report(report, folder.path());
  EXPECT_EQ(count_of(page, "data:image/png;base64,iVBORw0KGgo"), 1u) << "the signature of PNG files in base64";
  EXPECT_EQ(data_of(page)["embedded"]["picture_scale"], 1.0);
  EXPECT_EQ(data_of(page)["embedded"]["pictures_missing"], 0);
}

TEST(HtmlReport, PicturesThatCannotBeReadAreCounted) {
  const TemporaryFolder folder;
  json report = with_pictures(folder.path(), 1, 5, 4);
  std::ofstream(folder.path() / "text.png") << "<svg onload=alert(1)>";
  for (const char* path : {"text.png", "missing.png", "."}) report["pictures"].push_back({{"packed", path}});
  const json embedded = data_of(html_report(report, folder.path()))["embedded"];
  EXPECT_EQ(embedded["pictures_missing"], 3);
  EXPECT_EQ(embedded["pictures"].size(), 1u);
}

TEST(HtmlReport, LargePicturesAreReducedToKeepTheLimit) {
  const TemporaryFolder folder;
  const json report = with_pictures(folder.path(), 8, 400, 300); // about 360 kB each, 480 kB in base64
  const std::string page = html_report(report, folder.path());
  EXPECT_LE(page.size(), kLimit);
  const json embedded = data_of(page)["embedded"];
  EXPECT_EQ(embedded["picture_scale"], 0.5);
  EXPECT_EQ(embedded["pictures_missing"], 0);
}

TEST(HtmlReport, TheLeastImportantPicturesAreLeftOut) {
  const TemporaryFolder folder;
  const json report = with_pictures(folder.path(), 8, 400, 300);
  const size_t limit = html_report(json::object(), ".").size() + 100'000;
  const std::string page = html_report(report, folder.path(), limit);
  EXPECT_LE(page.size(), limit);
  const json embedded = data_of(page)["embedded"];
  EXPECT_EQ(embedded["picture_scale"], 0.25);
  EXPECT_GT(embedded["pictures_missing"], 0);
  EXPECT_TRUE(embedded["pictures"].contains("packed0.png"));
  EXPECT_FALSE(embedded["pictures"].contains("packed7.png"));
  EXPECT_EQ(embedded["pictures"].size() + embedded["pictures_missing"].get<size_t>(), 8u);
}

TEST(HtmlReport, ReducedPicturesAverageTheirPixels) {
  const TemporaryFolder folder;
  Image stripes({601, 301}, 1); // odd sides: the last column and row are blocks of their own
  for (uint32_t y = 0; y < 301; ++y)
    for (uint32_t x = 0; x < 601; ++x) stripes.pixel(x, y)[0] = x % 2 == 0 ? 0.0f : 1.0f;
  write_png(folder.path() / "stripes.png", stripes, PngTransfer::kRaw);
  const json report{{"pictures", {{{"packed", "stripes.png"}}}}};
  const size_t whole = html_report(report, folder.path()).size();
  const std::string page = html_report(report, folder.path(), whole - 1);
  const json embedded = data_of(page)["embedded"];
  EXPECT_EQ(embedded["picture_scale"], 0.5);
  const Image image = picture_of(embedded["pictures"]["stripes.png"]);
  ASSERT_EQ(image.size.width, 301u);
  ASSERT_EQ(image.size.height, 151u);
  EXPECT_NEAR(image.data[0], 0.5f, 1.0f / 255.0f);
  EXPECT_EQ(image.data[300], 0.0f) << "the last column is one black column of the source";
}

TEST(HtmlReport, DataOfDominatedPointsIsLeftOutFirst) {
  const json document = data_of(html_report(with_points(600), "."));
  EXPECT_FALSE(document["embedded"]["data_left_out"].empty());
  ASSERT_EQ(document["points"].size(), 600u);
  EXPECT_TRUE(document["points"][0].contains("worst_geometries")) << "the default keeps all";
  EXPECT_FALSE(document["points"][5].contains("worst_geometries"));
}

TEST(HtmlReport, ManyPointsKeepTheLimit) {
  const std::string page = html_report(with_points(1000, std::string(2000, 'x')), ".");
  EXPECT_LE(page.size(), kLimit);
  EXPECT_LT(data_of(page)["points"].size(), 1000u);
  EXPECT_TRUE(data_of(page)["points"][0].contains("histograms"));
}

TEST(HtmlReport, FailsIfNothingMoreCanBeLeftOut) {
  try {
    html_report({{"command", std::string(10'000, 'x')}}, ".", 10'000);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kLimitExceeded);
  }
}

TEST(HtmlReport, WritesAndReplacesTheFile) {
  const TemporaryFolder folder;
  const std::filesystem::path out = folder.path() / "report.html";
  for (const char* name : {"first", "second"}) {
    const json report{{"scene", {{"name", name}}}};
    write_html_report(report, folder.path(), out);
    std::ifstream file(out, std::ios::binary);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), html_report(report, folder.path()));
  }
}

TEST(HtmlReport, NumbersAreRoundedToSixDigits) {
  const json document = data_of(html_report({{"seconds", 1.0 / 3}, {"triangles", 1234567890123}}, "."));
  EXPECT_EQ(document["seconds"], 0.333333);
  EXPECT_EQ(document["triangles"], 1234567890123);
}

} // namespace
} // namespace packtrace
