// Traces ambient occlusion of a .ptk file frame by frame, denoises it, and writes the last frame as a picture.
// Usage: trace_ao FILE.ptk OUT.png

#include <cstdio>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/error.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/denoise/denoiser.h"
#include "runtime/image/png.h"
#include "runtime/trace/make_tracer.h"
#include "runtime/trace/source/packed_source.h"

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::fprintf(stderr, "usage: trace_ao FILE.ptk OUT.png\n");
    return 2;
  }
  // Each refers to the one before it, which must outlive it.
  const packtrace::BakedFile file = packtrace::BakedFile::open(argv[1]);
  const packtrace::PackedSource source(file);
  packtrace::TracerConfig tracing;
  tracing.backend = packtrace::Backend::kPacked;
  const auto tracer = make_tracer(source, &file, tracing);

  const packtrace::ImageSize size{320, 180};
  const packtrace::Camera camera = source.cameras().empty()
                                       ? framing_camera(source.world_bounds(), size, source.cameras())
                                       : source.cameras().front();
  const packtrace::AoConfig ao;

  packtrace::Progress progress;
  packtrace::GBuffer gbuffer;
  packtrace::AoFrame noisy;
  packtrace::AoDenoiser denoiser;
  const packtrace::DenoisedAo* denoised = nullptr;
  for (uint32_t frame = 0; frame < 8; ++frame) {
    // A camera that moves passes the previous frame's view as well.
    const packtrace::PrimaryCamera view(camera, size);
    trace_primary(source, *tracer, view, view, gbuffer, progress);
    trace_ao(source, *tracer, gbuffer, ao, frame, noisy, progress); // one sample per pixel
    denoised = &denoiser.next_frame(gbuffer, noisy);
  }

  packtrace::Image picture(size, 1, 1.0f);
  double sum = 0.0;
  size_t hits = 0;
  for (size_t pixel = 0; pixel < size.pixels(); ++pixel) {
    if (gbuffer.view_z[pixel] == 0.0f) continue; // the camera ray hits nothing
    picture.data[pixel] = denoised->ao[pixel];
    sum += static_cast<double>(denoised->ao[pixel]), ++hits;
  }
  write_png(argv[2], picture, packtrace::PngTransfer::kSrgb);
  std::printf("%s: %zu of %zu pixels show a surface, mean visibility %.3f, kernels %.*s\n", argv[2], hits,
              size.pixels(), hits ? sum / static_cast<double>(hits) : 0.0, static_cast<int>(tracer->isa().size()),
              tracer->isa().data());
  return 0;
} catch (const packtrace::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return error.exit_code();
}
