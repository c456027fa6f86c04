// Memory of Draco data.

#include <string>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#pragma GCC diagnostic pop

#include "pbrt_import/base/error.h"
#include "tests/pbrt_import/gltf_builder.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;

/// A document whose only primitive has these Draco data.
GltfBuilder with_draco(const std::string& data) {
  GltfBuilder gltf;
  const size_t view = gltf.view(data);
  const size_t positions = gltf.accessor({{"componentType", 5126}, {"type", "VEC3"}, {"count", 3}});
  gltf.mesh(
      {{"attributes", {{"POSITION", positions}}},
       {"extensions", {{"KHR_draco_mesh_compression", {{"bufferView", view}, {"attributes", {{"POSITION", 0}}}}}}}});
  gltf.node({{"mesh", 0}});
  return gltf;
}

void add_number(std::string& data, uint32_t number) {
  for (; number >= 128; number >>= 7) data += static_cast<char>(number | 128);
  data += static_cast<char>(number);
}

enum class Method : char { kSequential = 0, kEdgebreaker = 1 };

/// Draco data of version 2.2 that end behind the number of their triangles and what else comes before those.
std::string claim(Method method, uint32_t triangles, uint8_t attributes = 1) {
  std::string data("DRACO\2\2\1", 8);
  data += static_cast<char>(method);
  data += std::string(method == Method::kEdgebreaker ? 3 : 2, '\0'); // flags; the standard traversal
  if (method == Method::kEdgebreaker) add_number(data, triangles);   // vertices
  add_number(data, triangles);
  if (method == Method::kSequential) {
    add_number(data, triangles); // vertices
    data += '\0';                // compressed indices
  } else {
    data += static_cast<char>(attributes);
    add_number(data, triangles); // symbols
    add_number(data, 0);         // splits
  }
  return data + "damaged";
}

/// A strip of triangles with an attribute of some components.
std::string strip(uint32_t triangles, int8_t components, bool sequential) {
  draco::TriangleSoupMeshBuilder soup;
  soup.Start(static_cast<int>(triangles));
  const int position = soup.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int more = soup.AddAttribute(draco::GeometryAttribute::GENERIC, components, draco::DT_FLOAT32);
  const std::vector<float> zeros(static_cast<size_t>(components));
  for (uint32_t i = 0; i < triangles; ++i) {
    float corners[3][3];
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t v = i + k;
      corners[k][0] = static_cast<float>(v / 2), corners[k][1] = static_cast<float>(v % 2), corners[k][2] = 0.0f;
    }
    const size_t second = i % 2 == 0 ? 1 : 2;
    soup.SetAttributeValuesForFace(position, draco::FaceIndex(i), corners[0], corners[second], corners[3 - second]);
    soup.SetAttributeValuesForFace(more, draco::FaceIndex(i), zeros.data(), zeros.data(), zeros.data());
  }
  draco::Encoder encoder;
  if (sequential) encoder.SetEncodingMethod(draco::MESH_SEQUENTIAL_ENCODING);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::GENERIC, 8);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*soup.Finalize(), &buffer).ok());
  return {buffer.data(), buffer.size()};
}

/// What importing a file ends with under a limit of memory; empty: nothing.
std::string memory_problem(const std::string& draco, uint64_t mebibytes) {
  const SceneFolder folder;
  ImportOptions options;
  options.memory = MemoryBudget(mebibytes << 20);
  try {
    import_file(folder.write("a.glb", with_draco(draco).binary()), options);
  } catch (const MemoryError& error) {
    return error.what();
  } catch (const Error& error) {
    return std::string("another problem: ") + error.what();
  }
  return {};
}

TEST(DracoMemory, ClaimedTrianglesAreReservedBeforeTheyAreAllocated) {
  for (const Method method : {Method::kSequential, Method::kEdgebreaker}) {
    const std::string small = claim(method, 1'000'000);
    ASSERT_LT(small.size(), 40u);
    const std::string problem = memory_problem(small, 32);
    EXPECT_NE(problem.find("decoding Draco data needs"), std::string::npos) << problem;
    EXPECT_EQ(memory_problem(small, 1024), "") << "the primitive is left out";
  }
  // Corner tables of attributes with seams of their own.
  EXPECT_EQ(memory_problem(claim(Method::kEdgebreaker, 10'000, 1), 32), "");
  EXPECT_NE(memory_problem(claim(Method::kEdgebreaker, 10'000, 255), 32).find("decoding Draco data"),
            std::string::npos);
}

TEST(DracoMemory, ValuesOfAttributesAreReservedBeforeTheyAreAllocated) {
  for (const bool sequential : {false, true}) {
    const std::string narrow = strip(5'000, 1, sequential), wide = strip(5'000, 120, sequential);
    EXPECT_LT(wide.size(), 300'000u); // 9.6 MB when decoded
    EXPECT_EQ(memory_problem(narrow, 8), "");
    const std::string problem = memory_problem(wide, 8);
    EXPECT_NE(problem.find("decoding Draco data needs"), std::string::npos) << problem;
    EXPECT_EQ(memory_problem(wide, 256), "");
  }
}

TEST(DracoMemory, EveryPrefixEndsWell) {
  for (const bool sequential : {false, true}) {
    const std::string whole = strip(12, 2, sequential);
    const SceneFolder folder;
    for (size_t bytes = 0; bytes < whole.size(); ++bytes) {
      const Imported imported = import_file(folder.write("a.glb", with_draco(whole.substr(0, bytes)).binary()), {});
      EXPECT_TRUE(imported.reported("has damaged Draco data")) << bytes << imported.text();
    }
    EXPECT_EQ(import_file(folder.write("a.glb", with_draco(whole).binary()), {}).text(), "");
  }
}

} // namespace
} // namespace packtrace
