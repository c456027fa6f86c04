// Exports a .ptk file to GPU buffers with 16 bytes per vertex. decode_vertex16.vert decodes them on the GPU; this
// program decodes them on the CPU, with the same functions from vertex16_decode.h, and compares them with the stored
// bounds. Usage: decode_vertex16 FILE.ptk

#include <algorithm>
#include <cstdio>

#include "compress/exchange/vertex16/vertex16_export.h"
#include "compress/exchange/vertex16/vertex16_file.h"
#include "pbrt_import/base/error.h"

namespace v16 = packtrace::vertex16;

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fprintf(stderr, "usage: decode_vertex16 FILE.ptk\n");
    return 2;
  }
  const packtrace::BakedFile file = packtrace::BakedFile::open(argv[1]);
  packtrace::Progress progress;
  const packtrace::Vertex16Export exported = export_vertex16(file, progress);
  const v16::Sections buffers = v16::validate(exported.bytes, argv[1]); // spans into exported.bytes

  // What a renderer uploads: storage buffers for binding 0 and 1 of the shader, index buffers, one draw per record.
  std::printf("binding 0, vertices: %zu bytes; binding 1, instances: %zu bytes\n", buffers.vertices.size_bytes(),
              buffers.instances.size_bytes());
  std::printf("indices of 16 bits: %zu bytes; of 32 bits: %zu bytes; draws: %zu\n", buffers.indices16.size_bytes(),
              buffers.indices32.size_bytes(), buffers.draws.size());

  // Each geometry's frame (32 bytes) is the shader's push constant.
  double outside = 0.0; // largest distance of a decoded vertex from its geometry's bounds
  size_t vertices = 0, flat = 0;
  for (const v16::GeometryRecord& geometry : buffers.geometries) {
    for (const glm::uvec4& vertex : buffers.vertices.subspan(geometry.first_vertex, geometry.vertex_count)) {
      const glm::vec3 position = v16::vertex16_position(vertex, geometry.frame);
      for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<size_t>(axis);
        outside = std::max({outside, static_cast<double>(geometry.bounds_lo[i] - position[axis]),
                            static_cast<double>(position[axis] - geometry.bounds_hi[i])});
      }
      ++vertices, flat += v16::vertex16_is_flat(vertex) ? 1 : 0;
    }
  }
  std::printf("decoded %zu vertices, %zu of them flat; positions differ by at most %g from those of the .ptk file\n",
              vertices, flat, exported.report.max_position_error);
  return outside <= 0.0 ? 0 : 1;
} catch (const packtrace::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return error.exit_code();
}
