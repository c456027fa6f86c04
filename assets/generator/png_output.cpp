#include "assets/generator/png_output.h"

#include <cassert>

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace packtrace::scenegen {

void write_png(BufferedFile& file, uint32_t width, uint32_t height, uint32_t channels,
               std::span<const uint8_t> texels) {
  assert(texels.size() == uint64_t{width} * height * channels);
  const auto sink = [](void* context, void* bytes, int size) {
    static_cast<BufferedFile*>(context)->write({static_cast<const char*>(bytes), static_cast<size_t>(size)});
  };
  const auto signed_of = [](uint32_t value) { return static_cast<int>(value); };
  stbi_write_png_to_func(sink, &file, signed_of(width), signed_of(height), signed_of(channels), texels.data(),
                         signed_of(width * channels));
}

} // namespace packtrace::scenegen
