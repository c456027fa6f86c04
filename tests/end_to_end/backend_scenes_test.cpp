// Renders every scene with every backend and compares with Embree on the source's floats. Limits:
// tests/end_to_end/backend_limits.json.
//
// Compiled twice: for the scenes in assets/ and, with PACKTRACE_SHARED_SCENES, for those in $PACKTRACE_SCENES.

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "compress/bake/bake_scene.h"
#include "compress/format/file/baked_file.h"
#include "pbrt_import/import_scene.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/trace/embree/embree_tracer.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "runtime/trace/source/float_source.h"
#include "runtime/trace/source/packed_source.h"
#include "tests/runtime/trace/embree_cluster_tracer.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json read_limits() {
  std::ifstream in(fs::path(PACKTRACE_SOURCE_DIR) / "tests/end_to_end/backend_limits.json");
  return json::parse(in);
}

struct Picture {
  GBuffer surfaces;
  AoFrame ao;
};

bool sees_nothing(const Picture& picture) {
  return std::ranges::all_of(picture.surfaces.instance, [](uint32_t instance) { return instance == kNoInstance; });
}

/// Differences between two pictures: fractions of all pixels, and the AO difference of matching pixels.
struct Differences {
  double hits = 0.0;  ///< pixels that hit something in only one picture
  double depth = 0.0; ///< pixels whose depths differ by more than depth_tolerance
  double ao = 0.0;    ///< mean |AO difference| of pixels with matching depth
};

Differences compare(const Picture& a, const Picture& b, double depth_tolerance) {
  const size_t pixels = a.surfaces.instance.size();
  size_t hits = 0, depth = 0, both = 0;
  double ao = 0.0;
  for (size_t i = 0; i < pixels; ++i) {
    const bool in_a = a.surfaces.instance[i] != kNoInstance, in_b = b.surfaces.instance[i] != kNoInstance;
    if (in_a != in_b) ++hits;
    if (!in_a || !in_b) continue;
    const double z = double{b.surfaces.view_z[i]};
    if (!(std::abs(double{a.surfaces.view_z[i]} - z) <= depth_tolerance * z)) {
      ++depth;
      continue;
    }
    ++both;
    ao += std::abs(double{a.ao.ao[i]} - double{b.ao.ao[i]});
  }
  const auto share = [&](size_t count) { return static_cast<double>(count) / static_cast<double>(pixels); };
  return {share(hits), share(depth), both > 0 ? ao / static_cast<double>(both) : 0.0};
}

class View {
public:
  /// @param framed use a camera that frames the whole scene instead of the scene's own
  View(const SceneSource& source, const json& image, bool framed)
      : camera_(camera_of(source, size_of(image), framed), size_of(image)) {
    ao_.radius = default_ao_radius(source.world_bounds());
    ao_.spp = image.at("spp");
  }

  Picture of(const SceneSource& source, const RayTracer& tracer) const {
    Picture picture;
    Progress progress;
    trace_primary(source, tracer, camera_, camera_, picture.surfaces, progress);
    trace_ao(source, tracer, picture.surfaces, ao_, 0, picture.ao, progress);
    return picture;
  }

private:
  static ImageSize size_of(const json& image) { return {image.at("width"), image.at("height")}; }
  static Camera camera_of(const SceneSource& source, ImageSize size, bool framed) {
    return framed || source.cameras().empty() ? framing_camera(source.world_bounds(), size) : source.cameras()[0];
  }

  PrimaryCamera camera_;
  AoConfig ao_;
};

class BackendsOnScene : public testing::TestWithParam<std::string> {
protected:
  void SetUp() override {
#ifdef PACKTRACE_SHARED_SCENES
    const char* const root = std::getenv("PACKTRACE_SCENES");
    if (!root) GTEST_SKIP() << "PACKTRACE_SCENES is not set: " << GetParam() << " is not tried";
    const fs::path file = fs::path(root) / GetParam();
    if (!fs::exists(file)) GTEST_SKIP() << file << " is not there";
#else
    const fs::path file = fs::path(PACKTRACE_SOURCE_DIR) / "assets" / GetParam();
#endif
    limits_ = read_limits();
    Diagnostics diagnostics;
    Progress progress;
    scene_ = import_scene(file, {}, diagnostics, progress).scene;
    file_ = std::make_unique<BakedFile>(BakedFile::from_bytes(bake_to_bytes(scene_, {}, diagnostics, progress).bytes));
  }

  /// Limit of this scene, or the common one if this scene has none.
  double limit(const std::string& name) const {
    const json& all = limits_.at("against_floats");
    const json& own = all.at("scenes");
    return own.contains(GetParam()) && own.at(GetParam()).contains(name) ? own.at(GetParam()).at(name)
                                                                         : all.at("others").at(name);
  }

  void expect_close(const Picture& picture, const Picture& floats, const Picture& same_file, std::string_view name) {
    const double tolerance = limits_.at("image").at("depth_tolerance");
    const Differences to_floats = compare(picture, floats, tolerance);
    EXPECT_LE(to_floats.hits, limit("hits")) << name << " against floats";
    EXPECT_LE(to_floats.depth, limit("depth")) << name << " against floats";
    EXPECT_LE(to_floats.ao, limit("ao")) << name << " against floats";
    const json& tracing = limits_.at("against_embree_on_the_same_file");
    const Differences to_file = compare(picture, same_file, tolerance);
    EXPECT_LE(to_file.hits, tracing.at("hits").get<double>()) << name << " against Embree on the same file";
    EXPECT_LE(to_file.depth, tracing.at("depth").get<double>()) << name << " against Embree on the same file";
    EXPECT_LE(to_file.ao, tracing.at("ao").get<double>()) << name << " against Embree on the same file";
    if (std::getenv("PACKTRACE_PRINT_DIFFERENCES"))
      std::printf("%s, %s: against floats %.6f %.6f %.6f, the same file %.6f %.6f %.6f\n", GetParam().c_str(),
                  std::string(name).c_str(), to_floats.hits, to_floats.depth, to_floats.ao, to_file.hits, to_file.depth,
                  to_file.ao);
  }

  json limits_;
  Scene scene_;
  std::unique_ptr<BakedFile> file_;
};

TEST_P(BackendsOnScene, ShowWhatEmbreeShowsOfFloats) {
  const FloatSource float_source(scene_);
  const EmbreeTracer float_tracer(float_source, {});
  View view(float_source, limits_.at("image"), false);
  Picture floats = view.of(float_source, float_tracer);
  if (sees_nothing(floats)) {
    view = View(float_source, limits_.at("image"), true);
    floats = view.of(float_source, float_tracer);
  }
  const PackedSource source(*file_);
  const Picture embree = view.of(source, EmbreeTracer(source, {}));
  expect_close(embree, floats, embree, "embree");
  for (const PackedIsa isa : {PackedIsa::kScalar, PackedIsa::kAvx2, PackedIsa::kAvx512}) {
    if (!isa_supported(isa)) continue;
    const PackedTracer tracer(*file_, source, isa);
    expect_close(view.of(source, tracer), floats, embree, "packed, " + std::string(tracer.isa()));
  }
  expect_close(view.of(source, EmbreeClusterTracer(*file_, source)), floats, embree, "embree-clusters");
}

std::vector<std::string> scenes() {
#ifdef PACKTRACE_SHARED_SCENES
  return {"house/scene.pbrt", "spaceship/scene.pbrt", "killeroo/killeroo-simple.pbrt", "bunny/scene.pbrt",
          "volumetric-caustic/scene.pbrt"};
#else
  std::vector<std::string> result = {"room/room.pbrt", "town/town.pbrt", "textured/textured.pbrt",
                                     "extreme/extreme.pbrt"};
  for (const auto& entry : fs::directory_iterator(fs::path(PACKTRACE_SOURCE_DIR) / "assets/features"))
    if (entry.path().extension() == ".pbrt") result.push_back("features/" + entry.path().filename().string());
  std::ranges::sort(result);
  return result;
#endif
}

std::string test_name(const testing::TestParamInfo<std::string>& info) {
  std::string name = info.param.substr(0, info.param.rfind('.'));
  std::ranges::replace_if(name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Scenes, BackendsOnScene, testing::ValuesIn(scenes()), test_name);

} // namespace
} // namespace packtrace
