#pragma once

#include <string>

namespace packtrace {

/// Whether the benchmark was built with cgltf.h.
bool has_cgltf();

/// Parses a file with cgltf, loads its buffers and validates it; images stay coded. Throws Error(kInput) if cgltf
/// refuses the file, Error(kUsage) without cgltf.
void load_with_cgltf(const std::string& file);

} // namespace packtrace
