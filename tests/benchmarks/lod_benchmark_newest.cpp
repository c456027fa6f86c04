#include "tests/benchmarks/lod_benchmark_newest.h"

#include <array>
#include <cstdlib>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

template <typename T>
void write_all(std::ostream& out, std::span<const T> values) {
  out.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size_bytes()));
}

template <typename T>
std::vector<T> read_all(std::istream& in, size_t count) {
  std::vector<T> values(count);
  in.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(T)));
  return values;
}

} // namespace

SimplifierResult simplify_with_newest_meshoptimizer(const BareMesh& mesh, uint32_t target_triangles,
                                                    const std::filesystem::path& package) {
  const TemporaryFolder folder;
  const std::filesystem::path input = folder / "in", output = folder / "out";
  {
    std::ofstream out(input, std::ios::binary);
    const std::array<uint32_t, 3> counts = {static_cast<uint32_t>(mesh.positions.size()),
                                            static_cast<uint32_t>(mesh.triangles.size()), target_triangles};
    const std::vector<Vec3> positions(mesh.positions.begin(), mesh.positions.end());
    write_all(out, std::span<const uint32_t>(counts));
    write_all(out, std::span<const Vec3>(positions));
    write_all(out, std::span<const Triangle>(mesh.triangles));
  }
  const std::string command = fmt::format("node '{}/tests/benchmarks/lod_benchmark_newest.mjs' '{}' '{}' '{}'",
                                          PACKTRACE_SOURCE_DIR, package.string(), input.string(), output.string());
  std::ifstream in;
  if (std::system(command.c_str()) == 0) in.open(output, std::ios::binary);
  const auto counts = read_all<uint32_t>(in, 2);
  SimplifierResult result;
  for (const Vec3& p : read_all<Vec3>(in, counts[0])) result.mesh.positions.emplace_back(p);
  result.mesh.triangles = read_all<Triangle>(in, counts[1]);
  if (!in) throw Error(ErrorKind::kIo, "meshoptimizer of " + package.string() + " did not simplify; see above");
  return result;
}

} // namespace packtrace
