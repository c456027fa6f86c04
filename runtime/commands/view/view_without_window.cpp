#include "pbrt_import/base/error.h"
#include "runtime/commands/view/view_window.h"

namespace packtrace {
namespace {

[[noreturn]] void fail_without_window(const std::string& what) {
  throw Error(ErrorKind::kUnsupported,
              what + ": this program was built without windows, because libglfw3-dev, libimgui-dev, libopengl-dev or "
                     "libtomlplusplus-dev was missing; --headless SCRIPT and --profile FRAMES need no window");
}

} // namespace

void show_in_window(ImageSize, const std::function<std::unique_ptr<ViewSession>(const Progress::Observer&)>&,
                    const ViewOptions& options, const GlobalOptions&, ViewOutputs&) {
  fail_without_window(options.files.front());
}

void restore_settings(const std::string& file, ViewSession&) { fail_without_window(file); }

} // namespace packtrace
