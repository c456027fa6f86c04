#include "runtime/commands/cli/option_checks.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

/// Extensions that identify a format. Generic ones (.txt, .bin) are not included.
constexpr std::array<std::string_view, 41> kFormatEndings{
    ".ptk",  ".pbrt", ".json", ".v16", ".glb",   ".gltf", ".ply", ".obj", ".fbx",  ".stl", ".usd",
    ".usda", ".usdc", ".usdz", ".abc", ".blend", ".png",  ".exr", ".jpg", ".jpeg", ".tga", ".hdr",
    ".pfm",  ".bmp",  ".gif",  ".tif", ".tiff",  ".webp", ".ppm", ".ktx", ".ktx2", ".dds", ".svg",
    ".pdf",  ".gz",   ".xz",   ".zst", ".zip",   ".7z",   ".tar", ".csv"};

constexpr std::string_view kChoices = "{";

} // namespace

CLI::Validator one_of(std::vector<std::string> names) {
  const std::string listed = std::string(kChoices) + fmt::format("{}", fmt::join(names, ",")) + "}";
  return CLI::Validator(
      [names = std::move(names)](std::string& text) -> std::string {
        if (std::ranges::find(names, text) != names.end()) return {};
        const std::vector<std::string_view> known(names.begin(), names.end());
        return fmt::format("'{}' is not one of {}{}", text, fmt::join(names, ", "),
                           did_you_mean_text(closest_name(text, known)));
      },
      listed);
}

CLI::Validator number_in(double lo, double hi) {
  return CLI::Validator(
      [lo, hi](std::string& text) -> std::string {
        double value = 0.0;
        if (CLI::detail::lexical_cast(text, value) && value >= lo && value <= hi) return {};
        return fmt::format("{} is not a number in [{}, {}]", text, lo, hi);
      },
      fmt::format("[{}, {}]", lo, hi));
}

std::vector<std::string> choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name(); // "TEXT:{a,b}": the descriptions of the checks come last
  const size_t begin = type.find(':' + std::string(kChoices));
  if (begin == std::string::npos || !type.ends_with("}")) return {};
  const size_t first = begin + 1 + kChoices.size();
  return CLI::detail::split(type.substr(first, type.size() - 1 - first), ',');
}

std::string value_name(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  return type.substr(0, type.find(':'));
}

bool has_optional_value(const CLI::Option& option) {
  return option.get_items_expected_min() == 0 && option.get_items_expected_max() > 0;
}

CLI::App* find_verb(CLI::App& app, const std::string& name) {
  const auto found = app.get_subcommands([&](CLI::App* verb) { return verb->get_name() == name; });
  return found.empty() ? nullptr : found.front();
}

std::string display_name(const CLI::Option& option) {
  if (!option.get_lnames().empty()) return "--" + option.get_lnames().front();
  if (!option.get_snames().empty()) return "-" + option.get_snames().front();
  return option.get_name();
}

CLI::Option* add_output_option(CLI::App& verb, std::string& output, const std::string& description) {
  return verb
      .add_option_function<std::vector<std::string>>(
          "-o,--output",
          [&output](const std::vector<std::string>& names) {
            if (names.size() > 1)
              throw CLI::ValidationError("-o", fmt::format("was given {} times, but only one file can be written: {}",
                                                           names.size(), fmt::join(names, ", ")));
            output = names.front();
          },
          description)
      ->type_name("FILE")
      ->allow_extra_args(false);
}

std::string ending_of(const std::filesystem::path& file) { return CLI::detail::to_lower(file.extension().string()); }

void refuse_foreign_ending(const std::filesystem::path& file, std::initializer_list<std::string_view> own,
                           std::string_view writer, const std::string& advice) {
  const std::string ending = ending_of(file);
  if (std::ranges::find(own, ending) != own.end()) return;
  if (std::ranges::find(kFormatEndings, ending) == kFormatEndings.end()) return;
  throw Error(ErrorKind::kUsage, fmt::format("{}: {} writes {} files{}", file.string(), writer, fmt::join(own, " and "),
                                             advice.empty() ? "" : "; " + advice));
}

void refuse_without_effect(const std::vector<std::string>& names, const std::string& what) {
  if (names.empty()) return;
  std::string list = names.front();
  for (size_t i = 1; i < names.size(); ++i) list += (i + 1 < names.size() ? ", " : " and ") + names[i];
  throw Error(ErrorKind::kUsage, list + (names.size() > 1 ? " have" : " has") + " no effect on " + what);
}

std::string shell_word(const std::string& word) {
  const bool plain = !word.empty() && word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                                             "0123456789_-+=:,./@%") == std::string::npos;
  if (plain) return word;
  return "'" + CLI::detail::find_and_replace(word, "'", R"('\'')") + "'";
}

} // namespace packtrace
