#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "runtime/view/pane.h"

namespace packtrace {

/// Contents of a pane's file and memory for tracing it, for a panel.
struct FileContents {
  using Rows = std::vector<std::pair<std::string, uint64_t>>;
  Rows streams;                  ///< bytes of the file by stream, without those that are empty; empty for a .pbrt scene
  Rows resident;                 ///< bytes that stay allocated for tracing, by purpose
  std::vector<std::string> plan; ///< levels of detail of the last frame, in words; empty without levels
  Rows traced;                   ///< triangles in memory by geometry, most first; empty without levels
};

/// @param pane of the file, after a frame
FileContents file_contents(const ViewFile& file, const PaneRenderer& pane);

} // namespace packtrace
