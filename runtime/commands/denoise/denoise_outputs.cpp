#include "runtime/commands/denoise/denoise_outputs.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/option_checks.h"

namespace packtrace {
namespace {

constexpr const char* kInputLayer = "input";

/// Throws if a picture lacks what a layer is made of.
void require_layers(const std::vector<std::string>& aovs, const LayeredResult& result, const std::string& file) {
  for (const std::string& aov : aovs) {
    const bool albedo = aov == "albedo" || aov == "shaded";
    if (!albedo && aov != "hit_distance") continue;
    const LayerRole role = albedo ? LayerRole::kAlbedo : LayerRole::kHitDistance;
    const LayerRoleInfo& info = layer_roles()[static_cast<size_t>(role)];
    if (!result.picture.channels.has(role))
      throw Error(ErrorKind::kUsage,
                  fmt::format("--aov {}: {} has no layer for {}; name it with {}", aov, file, info.name, info.option));
  }
}

} // namespace

DenoiseOutputs::DenoiseOutputs(const std::vector<std::string>& files, const std::vector<std::string>& aovs,
                               const std::vector<NumberedInput>& inputs, AvailableLayers available, bool last_only,
                               bool force, const PreviewStyle& style)
    : available_(available), names_(separate_image_files(files)), aovs_(aovs), last_only_(last_only), force_(force),
      style_(style) {
  const bool copies = aovs.empty() || std::erase(aovs_, kInputLayer) > 0;
  if (!aovs_.empty()) aovs_ = chosen_layers(aovs_, available); // reports unknown layers
  for (const std::string& name : names_) {
    const std::string ending = ending_of(name);
    if (name != "-" && ending != ".exr" && ending != ".png")
      throw Error(ErrorKind::kUsage, name + ": image file names must end in .png or .exr");
    Name entry{name, nullptr, copies && ending == ".exr"};
    if (name == "-") to_stdout_ = true;
    if (name.find('%') != std::string::npos) entry.numbered = std::make_unique<NumberedName>(name);
    if (inputs.size() > 1 && !entry.numbered && !last_only)
      throw Error(ErrorKind::kUsage,
                  fmt::format("{}: {} pictures need a number in the name, for example out_%04d.exr; with --still the "
                              "last picture alone can be written",
                              name, inputs.size()));
    entries_.push_back(std::move(entry));
  }
  refuse_inputs(inputs);
  first_ = std::make_unique<Opened>(open(inputs.front().number, inputs.size() == 1));
}

/// Throws for outputs that have the name of an input or, without --force, exist.
void DenoiseOutputs::refuse_inputs(const std::vector<NumberedInput>& inputs) const {
  namespace fs = std::filesystem;
  std::error_code error; // of names that do not exist
  std::set<fs::path> read;
  for (const NumberedInput& input : inputs) read.insert(fs::weakly_canonical(input.file, error));
  for (const Name& entry : entries_)
    for (const NumberedInput& input : inputs) {
      if (entry.name == "-") continue;
      const std::string file = entry.numbered ? entry.numbered->at(input.number) : entry.name;
      if (read.contains(fs::weakly_canonical(file, error)))
        throw Error(ErrorKind::kUsage, file + ": the output would replace an input");
      const bool one_layer = entry.copy || aovs_.size() < 2 || ending_of(file) == ".exr";
      if (!force_ && one_layer && fs::exists(file, error))
        throw Error(ErrorKind::kIo, file + ": exists already; --force replaces it");
      if (!entry.numbered) break;
    }
}

bool DenoiseOutputs::has_views() const { return has_view_layer(aovs_); }

bool DenoiseOutputs::has_copies() const { return std::ranges::any_of(entries_, &Name::copy); }

DenoiseOutputs::Opened DenoiseOutputs::open(uint64_t number, bool last) const {
  Opened opened;
  std::vector<std::string> others;
  for (const Name& entry : entries_) {
    if (!entry.numbered && last_only_ && !last) continue;
    const std::string file = entry.numbered ? entry.numbered->at(number) : entry.name;
    if (entry.copy)
      opened.copies.push_back(std::make_unique<OutputFile>(file, force_));
    else
      others.push_back(file);
  }
  if (!others.empty()) opened.others = std::make_unique<ImageOutputs>(others, aovs_, available_, force_, style_);
  return opened;
}

void DenoiseOutputs::write(const NumberedInput& input, bool last, const LayeredResult& result,
                           const LayerConventions& conventions, const ExrAttributes& attributes) {
  require_layers(aovs_, result, input.file);
  const Opened opened = first_ ? std::move(*std::exchange(first_, nullptr)) : open(input.number, last);
  refuse_to_replace({input.file});
  if (!opened.copies.empty()) {
    std::vector<Layer> added;
    for (const std::string& aov : aovs_)
      if (aov != "ao") added.push_back(exr_layer(result.image, aov)); // ao is in place
    const std::vector<std::byte> bytes = encode_denoised_copy(result, conventions, added);
    for (const auto& file : opened.copies) file->write(bytes);
  }
  if (opened.others) opened.others->write(result.image, attributes);
  for (const auto& file : opened.copies) file->commit();
}

} // namespace packtrace
