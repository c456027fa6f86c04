# Headers that an engine includes, and the project's headers that those include. A test compiles them from an installed
# tree, so a missing one is noticed.
set(packtrace_public_headers
  # packtrace::import: plain types, and pbrt-v3 text to a Scene
  pbrt_import/base/diagnostics.h
  pbrt_import/base/error.h
  pbrt_import/base/file_error.h
  pbrt_import/base/memory_budget.h
  pbrt_import/base/progress.h
  pbrt_import/import_scene.h
  pbrt_import/scene/albedo_texture.h
  pbrt_import/scene/alpha_mask.h
  pbrt_import/scene/bounds.h
  pbrt_import/scene/camera_rays.h
  pbrt_import/scene/image_size.h
  pbrt_import/scene/material_flags.h
  pbrt_import/scene/math.h
  pbrt_import/scene/scene.h
  # packtrace::format: baked files and their decoders
  compress/format/cluster/cluster_codec.h
  compress/format/cluster/index_codec.h
  compress/format/cluster/normal_codec.h
  compress/format/cluster/position_grid.h
  compress/format/cluster/uv_codec.h
  compress/format/file/baked_file.h
  compress/format/file/file_summary.h
  compress/format/file/lod_summary.h
  compress/format/layout/baked_format.h
  compress/format/layout/bit_fields.h
  compress/format/layout/bit_stream.h
  compress/format/layout/lod_format.h
  compress/format/layout/packed_node.h
  compress/format/pages/page_codec.h
  compress/format/pages/page_contexts.h
  compress/format/textures/texture_codec.h
  # packtrace::bake: a Scene to a baked file
  compress/bake/bake_config.h
  compress/bake/bake_scene.h
  compress/bake/grid/seam_gaps.h
  # packtrace::vertex16: a baked file to vertex and index buffers
  compress/exchange/vertex16/vertex16.glsl
  compress/exchange/vertex16/vertex16_decode.h
  compress/exchange/vertex16/vertex16_export.h
  compress/exchange/vertex16/vertex16_file.h
  compress/exchange/vertex16/vertex16_format.h
  # packtrace::runtime: tracing, ambient occlusion, denoising, levels of detail, images
  runtime/ao/ao_integrator.h
  runtime/ao/sampler.h
  runtime/camera/gbuffer.h
  runtime/camera/lod_view.h
  runtime/camera/primary_visibility.h
  runtime/denoise/denoiser.h
  runtime/denoise/denoiser_config.h
  runtime/image/background.h
  runtime/image/exr.h
  runtime/image/false_color.h
  runtime/image/image.h
  runtime/image/metrics.h
  runtime/image/png.h
  runtime/image/read_image.h
  runtime/lod/lod_cut.h
  runtime/lod/lod_geometry.h
  runtime/lod/lod_metric.h
  runtime/lod/lod_sharing.h
  runtime/lod/sharing_balance.h
  runtime/lod/sharing_config.h
  runtime/render/renderer.h
  runtime/trace/embree/embree_tracer.h
  runtime/trace/make_tracer.h
  runtime/trace/movers.h
  runtime/trace/ray_tracer.h
  runtime/trace/source/float_source.h
  runtime/trace/source/lod_source.h
  runtime/trace/source/packed_source.h
  runtime/trace/source/scene_source.h
  runtime/trace/unit_space.h)
