#include "runtime/commands/view/view_outputs.h"

#include <cstdio>
#include <span>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/output_file.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/render/image_outputs.h"
#include "runtime/image/png.h"

namespace packtrace {

void ViewOutputs::save_pane(ViewSession& session, size_t pane, const std::vector<std::string>& files) {
  for (const std::string& file : files)
    if (file == "-") throw Error(ErrorKind::kUsage, "pictures need a file name");
  const RenderedImage& image = session.shown_image(pane);
  const FrameConfig& config = session.rendered_config(pane);
  const AvailableLayers available{config.detail.camera_uses_levels(), config.denoise, true, config.shades()};
  ImageOutputs outputs(files, {session.pane(pane).image_layer()}, available, globals_.force,
                       {std::nullopt, true, session.pane(pane).config.display()});
  outputs.write(image, render_attributes(config, session.last().still_frames));
}

void ViewOutputs::save_screen(ViewSession& session, const std::string& file) {
  if (ending_of(file) != ".png") throw Error(ErrorKind::kUsage, file + ": the screen is saved as .png");
  OutputFile output(file, globals_.force);
  output.write(encode_png(session.picture(), PngTransfer::kRaw));
  output.commit();
}

void ViewOutputs::save_text(const std::string& file, const std::string& text) {
  OutputFile output(file, globals_.force);
  output.write(std::as_bytes(std::span(text)));
  output.commit();
}

void ViewOutputs::report(const nlohmann::json& result) {
  const std::lock_guard lock(mutex_);
  const bool json_to_stdout = globals_.json == "-";
  if (!globals_.quiet && !json_to_stdout)
    print_printable(result.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + "\n");
  std::fflush(stdout); // programs that read the output get each line at once
  results_.push_back(result);
}

std::string command_text(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : " ").append(shell_word(word));
  return text;
}

} // namespace packtrace
