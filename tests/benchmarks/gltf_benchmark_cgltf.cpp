#include "tests/benchmarks/gltf_benchmark_cgltf.h"

#include <memory>

#if __has_include(<cgltf.h>)
#define CGLTF_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <cgltf.h>
#pragma GCC diagnostic pop
#endif

#include "pbrt_import/base/error.h"

namespace packtrace {

#if __has_include(<cgltf.h>)

bool has_cgltf() { return true; }

void load_with_cgltf(const std::string& file) {
  const cgltf_options options{};
  cgltf_data* parsed = nullptr;
  const auto require = [&](cgltf_result result) {
    if (result != cgltf_result_success)
      throw Error(ErrorKind::kInput, file + ": cgltf's result " + std::to_string(static_cast<int>(result)));
  };
  require(cgltf_parse_file(&options, file.c_str(), &parsed));
  const std::unique_ptr<cgltf_data, decltype(&cgltf_free)> data(parsed, cgltf_free);
  require(cgltf_load_buffers(&options, data.get(), file.c_str()));
  require(cgltf_validate(data.get()));
}

#else

bool has_cgltf() { return false; }

void load_with_cgltf(const std::string& file) {
  throw Error(ErrorKind::kUsage, file + ": the benchmark was built without cgltf.h");
}

#endif

} // namespace packtrace
