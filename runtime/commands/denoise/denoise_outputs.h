#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "runtime/commands/denoise/denoise_inputs.h"
#include "runtime/commands/render/image_outputs.h"
#include "runtime/commands/sequence/sequence_names.h"
#include "runtime/layered/layered_denoiser.h"

namespace packtrace {

/// The image files of `denoise`. Construct it before the work starts, so that wrong names are reported at once.
class DenoiseOutputs {
public:
  /// @param files .exr and .png names; for sequences with a place for a number
  /// @param aovs layers of a render, and "input"; empty: "input" for .exr, "ao" for .png
  /// @param available the layers that "all" means
  /// @param last_only whether names without a number get the last picture of a sequence
  /// Throws Error(kUsage) for other names and unknown layers, and for outputs that are inputs; Error(kIo) for files
  /// that exist or cannot be written.
  DenoiseOutputs(const std::vector<std::string>& files, const std::vector<std::string>& aovs,
                 const std::vector<NumberedInput>& inputs, AvailableLayers available, bool last_only, bool force,
                 const PreviewStyle& style);

  /// Whether an output keeps all channels of the input.
  bool has_copies() const;
  /// Whether a layer is a view of intermediate results.
  bool has_views() const;
  bool to_stdout() const { return to_stdout_; }

  /// Writes a picture. Throws Error(kUsage) for layers that the picture does not have.
  void write(const NumberedInput& input, bool last, const LayeredResult& result, const LayerConventions& conventions,
             const ExrAttributes& attributes);

  /// Names as given; "-" is standard output.
  const std::vector<std::string>& targets() const { return names_; }

private:
  struct Name {
    std::string name;
    std::unique_ptr<NumberedName> numbered; ///< null: a name without a number
    bool copy = false;                      ///< an .exr file with all channels of the input
  };
  /// The files of one picture, which appear under their names once all are written.
  struct Opened {
    std::vector<std::unique_ptr<OutputFile>> copies;
    std::unique_ptr<ImageOutputs> others;
  };
  Opened open(uint64_t number, bool last) const;
  void refuse_inputs(const std::vector<NumberedInput>& inputs) const;

  AvailableLayers available_;
  std::vector<Name> entries_;
  std::vector<std::string> names_, aovs_; ///< aovs_: without "input"
  bool last_only_ = false, force_ = false, to_stdout_ = false;
  PreviewStyle style_;
  std::unique_ptr<Opened> first_; ///< opened early
};

} // namespace packtrace
