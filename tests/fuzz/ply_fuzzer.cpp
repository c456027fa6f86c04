// Fuzzes read_ply(): its result satisfies the contract of Mesh and is bounded by the file's size.

#include <span>

#include "pbrt_import/base/error.h"
#include "pbrt_import/files/ply.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scene_contract.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace packtrace;
  uint64_t reports = 0;
  const auto count_report = [&](Severity, uint32_t, const std::string& message) {
    fuzz::require(!message.empty(), "empty report");
    ++reports;
  };
  try {
    const PlyMesh ply = read_ply(std::as_bytes(std::span(data, size)), count_report);
    fuzz::require_mesh_contract(ply.mesh);
    fuzz::require(ply.dropped_triangles == 0 || reports > 0, "triangles dropped in silence");
    // A corner takes at least one byte, and each corner of a polygon after the second makes a triangle.
    fuzz::require(ply.mesh.triangles.size() + ply.dropped_triangles <= size, "more triangles than bytes");
    fuzz::require(ply.mesh.positions.size() <= size, "more vertices than bytes");
  } catch (const Error& error) {
    fuzz::require(error.kind() == ErrorKind::kInput, "kind of error");
  }
  return 0;
}
