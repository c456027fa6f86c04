#include "tests/runtime/trace/embree_cluster_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "compress/format/trees/box_tree.h"
#include "pbrt_import/base/progress.h"
#include "runtime/trace/embree/embree_device.h"
#include "runtime/trace/embree/embree_rays.h"

namespace packtrace {
namespace {

/// Boxes grow by this times the tree's largest coordinate C. Origins lie within 4 C (kFar in enter.h). With M = 4 C and
/// u = 2^-24, hits lie at most 10 u M off their ray (see kBoxPad in ray_group.h). Embree's box test adds, relative to
/// distances of at most 5 C, a direction rounded twice (2 u), its own reciprocal (3 u), a product (1 u) and a
/// difference (1 u). The sum is less than 80 u C, and 256 u C are taken.
constexpr double kBoxPad = 0x1p-16;

/// The leaf nodes of one tree, sorted by cluster, and their partition into user primitives.
struct ClusterNodes {
  std::vector<uint32_t> nodes;  ///< numbers of the tree's leaf nodes
  std::vector<uint32_t> begins; ///< by primitive: its first element in nodes; followed by the end
  const packed::TraceTree* tree = nullptr;

  uint32_t primitive_count() const { return static_cast<uint32_t>(begins.size()) - 1; }
  std::span<const uint32_t> of(uint32_t primitive) const {
    return std::span(nodes).subspan(begins[primitive], begins[primitive + 1] - begins[primitive]);
  }
  uint64_t bytes() const { return (nodes.size() + begins.size()) * sizeof(uint32_t) + sizeof(ClusterNodes); }
};

ClusterNodes nodes_of(const packed::TraceTree& tree, uint32_t node_count, ClusterPrimitives primitives) {
  ClusterNodes out;
  out.tree = &tree;
  for (uint32_t i = 0; i < node_count; ++i)
    if (tree.nodes[i].has_leaves()) out.nodes.push_back(i);
  std::stable_sort(out.nodes.begin(), out.nodes.end(),
                   [&](uint32_t a, uint32_t b) { return tree.nodes[a].cluster < tree.nodes[b].cluster; });
  const bool each = primitives == ClusterPrimitives::kLeafNodes;
  for (uint32_t i = 0; i < out.nodes.size(); ++i)
    if (each || i == 0 || tree.nodes[out.nodes[i]].cluster != tree.nodes[out.nodes[i - 1]].cluster)
      out.begins.push_back(i);
  out.begins.push_back(static_cast<uint32_t>(out.nodes.size()));
  out.nodes.shrink_to_fit();
  out.begins.shrink_to_fit();
  return out;
}

void extend(const baked::PackedNode& node, double (&lo)[3], double (&hi)[3]) {
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const double unit = std::ldexp(1.0, static_cast<int>(node.exponent(axis)));
    for (uint32_t child = 0; child < baked::kNodeWidth && node.children[child] != baked::kNoChild; ++child) {
      lo[axis] = std::min(lo[axis], node.origin[axis] + node.lo[axis][child] * unit);
      hi[axis] = std::max(hi[axis], node.origin[axis] + node.hi[axis][child] * unit);
    }
  }
}

float below(double x) { return std::nextafter(static_cast<float>(x), -INFINITY); }
float above(double x) { return std::nextafter(static_cast<float>(x), INFINITY); }

void cluster_bounds(const RTCBoundsFunctionArguments* args) {
  const auto& tree = *static_cast<const ClusterNodes*>(args->geometryUserPtr);
  double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (const uint32_t node : tree.of(args->primID)) extend(tree.tree->nodes[node], lo, hi);
  const double pad = kBoxPad * double{tree.tree->max_coordinate};
  RTCBounds& out = *args->bounds_o;
  out.lower_x = below(lo[0] - pad), out.lower_y = below(lo[1] - pad), out.lower_z = below(lo[2] - pad);
  out.upper_x = above(hi[0] + pad), out.upper_y = above(hi[1] + pad), out.upper_z = above(hi[2] + pad);
}

/// No rays are masked out by Embree: the kernels check the ray classes of clusters.
constexpr uint32_t kAllRays = ~0u;

struct SearchQuery : EmbreeQuery {
  const packed::TreeSearch& search;

  SearchQuery(RTCIntersectContextFlags order, const packed::TreeSearch& rays) : EmbreeQuery(order), search(rays) {}
};

/// Tests the active rays of a callback against the leaf nodes of a primitive, and shortens the rays that hit. A ray's
/// id is its number in the search.
template <typename Arguments>
void visit_cluster(const Arguments* args, RTCRayN* rays) {
  const packed::TreeSearch& search = static_cast<const SearchQuery*>(args->context)->search;
  const auto& tree = *static_cast<const ClusterNodes*>(args->geometryUserPtr);
  uint64_t active = 0;
  for (uint32_t i = 0; i < args->N; ++i)
    if (args->valid[i] == -1) active |= uint64_t{1} << RTCRayN_id(rays, args->N, i);
  const std::span<const uint32_t> nodes = tree.of(args->primID);
  const uint64_t looking = search.visit(search, nodes.data(), static_cast<uint32_t>(nodes.size()), active);
  for (uint32_t i = 0; i < args->N; ++i) {
    if (args->valid[i] != -1) continue;
    const uint32_t number = RTCRayN_id(rays, args->N, i);
    float& tfar = RTCRayN_tfar(rays, args->N, i);
    if (search.any == 0)
      tfar = -search.limits[number][1];
    else if ((looking >> number & 1u) == 0)
      tfar = -INFINITY;
  }
}

void intersect_cluster(const RTCIntersectFunctionNArguments* args) {
  visit_cluster(args, RTCRayHitN_RayN(args->rayhit, args->N));
}
void occluded_cluster(const RTCOccludedFunctionNArguments* args) { visit_cluster(args, args->ray); }

static_assert(sizeof(Ray) == sizeof(packed::KernelRay) && offsetof(Ray, tfar) == offsetof(packed::KernelRay, tfar));

using SearchRays = std::array<Ray, packed::TreeSearch::kMaxRays>;

std::span<const Ray> copy_rays(const packed::TreeSearch& search, SearchRays& rays) {
  std::memcpy(rays.data(), search.rays, search.count * sizeof(Ray));
  return {rays.data(), search.count};
}

/// Uses a stream with the coherent flag: all rays of a search have the same octant, so Embree forms packets.
void find_closest(RTCScene scene, const packed::TreeSearch& search) {
  SearchQuery context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT, search);
  alignas(64) RTCRayHit stream[packed::TreeSearch::kMaxRays];
  SearchRays copied;
  const std::span<const Ray> rays = copy_rays(search, copied);
  for (uint32_t i = 0; i < search.count; ++i) {
    set_ray(rays[i], kAllRays, stream[i]);
    stream[i].ray.id = search.number[i];
  }
  rtcIntersect1M(scene, &context, stream, search.count, sizeof(RTCRayHit));
}

/// Does not set the coherent flag, because rtcOccluded16 may hang with it (see embree_queries.cpp).
void find_any(RTCScene scene, const packed::TreeSearch& search) {
  SearchQuery context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT, search);
  RayPacket16 packet;
  RTCRay16 lanes;
  set_constants(kAllRays, lanes);
  SearchRays copied;
  const std::span<const Ray> rays = copy_rays(search, copied);
  for (uint32_t first = 0; first < search.count; first += RayPacket16::kRays) {
    const uint32_t count = std::min<uint32_t>(RayPacket16::kRays, search.count - first);
    packet.load(rays.subspan(first, count), lanes);
    std::copy_n(search.number + first, count, lanes.id);
    rtcOccluded16(packet.valid, scene, &context, &lanes);
  }
}

} // namespace

struct EmbreeClusterTracer::Trees {
  std::vector<ClusterNodes> nodes; ///< by tree
  EmbreeDevice device;
  std::vector<RtcPtr<RTCSceneTy>> scenes; ///< by tree; null for trees without clusters

  RtcPtr<RTCSceneTy> build(ClusterNodes& tree) {
    RtcPtr<RTCGeometryTy> geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_USER));
    RtcPtr<RTCSceneTy> scene(rtcNewScene(device.get()));
    device.check();
    rtcSetGeometryUserPrimitiveCount(geometry.get(), tree.primitive_count());
    rtcSetGeometryUserData(geometry.get(), &tree);
    rtcSetGeometryBoundsFunction(geometry.get(), cluster_bounds, nullptr);
    rtcSetGeometryIntersectFunction(geometry.get(), intersect_cluster);
    rtcSetGeometryOccludedFunction(geometry.get(), occluded_cluster);
    rtcSetGeometryMask(geometry.get(), kAllRays);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene.get(), geometry.get());
    rtcSetSceneProgressMonitorFunction(scene.get(), [](void*, double) { return !Progress::cancelled(); }, nullptr);
    rtcCommitScene(scene.get());
    device.check();
    return scene;
  }
};

EmbreeClusterTracer::EmbreeClusterTracer(const BakedFile& file, const SceneSource& source, PackedIsa isa,
                                         ClusterPrimitives primitives)
    : packed_(file, source, isa), trees_(std::make_unique<Trees>()) {
  if (rtcGetDeviceProperty(trees_->device.get(), RTC_DEVICE_PROPERTY_USER_GEOMETRY_SUPPORTED) == 0)
    throw Error(ErrorKind::kUnsupported, "this Embree was built without user geometry");
  const std::span<const packed::TraceTree> trees = packed_.trees();
  for (uint32_t i = 0; i < trees.size(); ++i)
    trees_->nodes.push_back(nodes_of(trees[i], packed_.tree_records()[i].node_count, primitives));
  for (ClusterNodes& nodes : trees_->nodes) {
    Progress().check_cancelled();
    trees_->scenes.push_back(nodes.primitive_count() > 0 ? trees_->build(nodes) : nullptr);
  }
  packed_.set_tree_search(
      [](const void* searcher, const packed::TreeSearch& search) {
        const RTCScene scene = static_cast<const Trees*>(searcher)->scenes[search.tree].get();
        search.any != 0 ? find_any(scene, search) : find_closest(scene, search);
      },
      trees_.get());
}

EmbreeClusterTracer::~EmbreeClusterTracer() = default;

std::vector<ResidentPart> EmbreeClusterTracer::resident() const {
  std::vector<ResidentPart> parts = packed_.resident();
  uint64_t tables = 0;
  for (const ClusterNodes& nodes : trees_->nodes) tables += nodes.bytes() + sizeof(RtcPtr<RTCSceneTy>);
  parts.push_back({"bvh", trees_->device.bytes()});
  parts.push_back({"cluster nodes", tables});
  return parts;
}

} // namespace packtrace
