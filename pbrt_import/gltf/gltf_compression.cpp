#include "pbrt_import/gltf/gltf_compression.h"

#include <limits>
#include <string>

#include <meshoptimizer.h>

namespace packtrace::gltf {

MeshoptView read_meshopt_view(const Value& extension) {
  MeshoptView view;
  view.count = extension.at("count").integer();
  const uint64_t stride = extension.at("byteStride").integer();
  const std::string mode = extension.at("mode").text(), filter = extension.text_or("filter", "NONE");
  if (mode == "ATTRIBUTES")
    view.mode = MeshoptView::Mode::kAttributes;
  else if (mode == "TRIANGLES")
    view.mode = MeshoptView::Mode::kTriangles;
  else if (mode == "INDICES")
    view.mode = MeshoptView::Mode::kIndices;
  else
    extension.fail("has an unknown mode");
  if (filter == "OCTAHEDRAL")
    view.filter = MeshoptView::Filter::kOctahedral;
  else if (filter == "QUATERNION")
    view.filter = MeshoptView::Filter::kQuaternion;
  else if (filter == "EXPONENTIAL")
    view.filter = MeshoptView::Filter::kExponential;
  else if (filter != "NONE")
    extension.fail("has an unknown filter");
  const bool attributes = view.mode == MeshoptView::Mode::kAttributes;
  if (attributes ? stride == 0 || stride > 256 || stride % 4 != 0 : stride != 2 && stride != 4)
    extension.fail("has a byteStride that its mode does not allow");
  if (view.mode == MeshoptView::Mode::kTriangles && view.count % 3 != 0)
    extension.fail("has a count that is not a multiple of 3");
  if (view.count > std::numeric_limits<uint32_t>::max()) extension.fail("has more than 2^32 elements");
  if ((view.filter == MeshoptView::Filter::kOctahedral && stride != 4 && stride != 8) ||
      (view.filter == MeshoptView::Filter::kQuaternion && stride != 8) ||
      (view.filter != MeshoptView::Filter::kNone && !attributes))
    extension.fail("has a filter that does not fit its byteStride and mode");
  view.stride = static_cast<uint32_t>(stride);
  return view;
}

std::vector<std::byte> decode_meshopt(const MeshoptView& view, std::span<const std::byte> compressed,
                                      const Value& extension) {
  std::vector<std::byte> bytes(static_cast<size_t>(view.bytes()));
  const auto* const data = reinterpret_cast<const unsigned char*>(compressed.data());
  const auto count = static_cast<size_t>(view.count);
  int problem = 0;
  switch (view.mode) {
  case MeshoptView::Mode::kAttributes:
    problem = meshopt_decodeVertexBuffer(bytes.data(), count, view.stride, data, compressed.size());
    break;
  case MeshoptView::Mode::kTriangles:
    problem = meshopt_decodeIndexBuffer(bytes.data(), count, view.stride, data, compressed.size());
    break;
  case MeshoptView::Mode::kIndices:
    problem = meshopt_decodeIndexSequence(bytes.data(), count, view.stride, data, compressed.size());
    break;
  }
  if (problem != 0) extension.fail("has damaged data");
  switch (view.filter) {
  case MeshoptView::Filter::kOctahedral:
    meshopt_decodeFilterOct(bytes.data(), count, view.stride);
    break;
  case MeshoptView::Filter::kQuaternion:
    meshopt_decodeFilterQuat(bytes.data(), count, view.stride);
    break;
  case MeshoptView::Filter::kExponential:
    meshopt_decodeFilterExp(bytes.data(), count, view.stride);
    break;
  case MeshoptView::Filter::kNone:
    break;
  }
  return bytes;
}

} // namespace packtrace::gltf
