#include "runtime/trace/embree_cluster_tracer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "compress/bvh/box_tree.h"
#include "pbrt_import/scene/progress.h"
#include "runtime/trace/embree_device.h"
#include "runtime/trace/embree_rays.h"

namespace packtrace {
namespace {

/// Boxes grow by this times the tree's largest coordinate C. Origins lie within 4 C (RayGroup's kFar), so with M = 4 C
/// and u = 2^-24 hits lie at most 10 u M off their ray (RayGroup's kBoxPad says why). To that Embree adds a direction
/// twice rounded, 2 u on at most 5 C, and its own reciprocal (3 u), product (1 u M) and difference (1 u) on as much: in
/// all less than 80 u C. 256 are taken.
constexpr double kBoxPad = 0x1p-16;

/// The leaf nodes of one tree, by cluster.
struct ClusterNodes {
  std::vector<uint32_t> nodes;  ///< numbers in the tree
  std::vector<uint32_t> begins; ///< into nodes, by primitive; and the end
  const packed::TraceTree* tree = nullptr;

  uint32_t primitive_count() const { return static_cast<uint32_t>(begins.size()) - 1; }
  std::span<const uint32_t> of(uint32_t primitive) const {
    return std::span(nodes).subspan(begins[primitive], begins[primitive + 1] - begins[primitive]);
  }
  uint64_t bytes() const { return (nodes.size() + begins.size()) * sizeof(uint32_t) + sizeof(ClusterNodes); }
};

ClusterNodes nodes_of(const packed::TraceTree& tree, uint32_t node_count) {
  ClusterNodes out;
  out.tree = &tree;
  for (uint32_t i = 0; i < node_count; ++i)
    if (tree.nodes[i].has_leaves()) out.nodes.push_back(i);
  std::stable_sort(out.nodes.begin(), out.nodes.end(),
                   [&](uint32_t a, uint32_t b) { return tree.nodes[a].cluster < tree.nodes[b].cluster; });
  for (uint32_t i = 0; i < out.nodes.size(); ++i)
    if (i == 0 || tree.nodes[out.nodes[i]].cluster != tree.nodes[out.nodes[i - 1]].cluster) out.begins.push_back(i);
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

struct SearchQuery : EmbreeQuery {
  const packed::TreeSearch& search;

  SearchQuery(RTCIntersectContextFlags order, const packed::TreeSearch& rays) : EmbreeQuery(order), search(rays) {}
};

/// Shows a cluster to the rays of a callback, whose ids are their numbers, and shortens those that hit.
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

void set_ray(const packed::TreeSearch& search, uint32_t i, RTCRay& out) {
  const packed::KernelRay& in = search.rays[i];
  out.org_x = in.origin[0], out.org_y = in.origin[1], out.org_z = in.origin[2], out.tnear = in.tnear;
  out.dir_x = in.direction[0], out.dir_y = in.direction[1], out.dir_z = in.direction[2], out.time = 0.0f;
  out.tfar = in.tfar, out.mask = ~0u, out.id = search.number[i], out.flags = 0;
}

int mode() { static const int m = getenv("CLMODE") ? atoi(getenv("CLMODE")) : 0; return m; }

void search_scene(RTCScene scene, const packed::TreeSearch& search) {
  const int how = mode();
  SearchQuery context(how & 4 ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT, search);
  if ((how & 3) == 0) {
    if (search.any) {
      alignas(64) RTCRay r[64];
      for (uint32_t i = 0; i < search.count; ++i) set_ray(search, i, r[i]);
      rtcOccluded1M(scene, &context, r, search.count, sizeof(RTCRay));
    } else {
      alignas(64) RTCRayHit r[64];
      for (uint32_t i = 0; i < search.count; ++i) { set_ray(search, i, r[i].ray); r[i].hit.geomID = r[i].hit.instID[0] = RTC_INVALID_GEOMETRY_ID; }
      rtcIntersect1M(scene, &context, r, search.count, sizeof(RTCRayHit));
    }
  } else if ((how & 3) == 1) {
    for (uint32_t i = 0; i < search.count; ++i) {
      if (search.any) {
        alignas(16) RTCRay r;
        set_ray(search, i, r);
        if (r.tnear <= r.tfar) rtcOccluded1(scene, &context, &r);
      } else {
        alignas(16) RTCRayHit r;
        set_ray(search, i, r.ray);
        r.hit.geomID = r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        if (r.ray.tnear <= r.ray.tfar) rtcIntersect1(scene, &context, &r);
      }
    }
  } else {
    alignas(64) int valid[16];
    alignas(64) RTCRayHit16 p;
    for (uint32_t first = 0; first < search.count; first += 16) {
      for (uint32_t k = 0; k < 16; ++k) {
        const uint32_t i = first + k < search.count ? first + k : first;
        RTCRay r;
        set_ray(search, i, r);
        valid[k] = first + k < search.count && r.tnear <= r.tfar ? -1 : 0;
        p.ray.org_x[k] = r.org_x; p.ray.org_y[k] = r.org_y; p.ray.org_z[k] = r.org_z; p.ray.tnear[k] = r.tnear;
        p.ray.dir_x[k] = r.dir_x; p.ray.dir_y[k] = r.dir_y; p.ray.dir_z[k] = r.dir_z; p.ray.time[k] = 0;
        p.ray.tfar[k] = r.tfar; p.ray.mask[k] = r.mask; p.ray.id[k] = r.id; p.ray.flags[k] = 0;
      }
      forget_hits(p.hit);
      if (search.any) rtcOccluded16(valid, scene, &context, &p.ray);
      else rtcIntersect16(valid, scene, &context, &p);
    }
  }
}

} // namespace

struct EmbreeClusterTracer::Trees {
  std::vector<ClusterNodes> nodes; ///< by tree
  EmbreeDevice device;
  std::vector<RtcPtr<RTCSceneTy>> scenes; ///< by tree; null where there is nothing to hit

  RtcPtr<RTCSceneTy> build(ClusterNodes& tree) {
    RtcPtr<RTCGeometryTy> geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_USER));
    RtcPtr<RTCSceneTy> scene(rtcNewScene(device.get()));
    device.check();
    rtcSetGeometryUserPrimitiveCount(geometry.get(), tree.primitive_count());
    rtcSetGeometryUserData(geometry.get(), &tree);
    rtcSetGeometryBoundsFunction(geometry.get(), [](const auto* args) { cluster_bounds(args); }, nullptr);
    rtcSetGeometryIntersectFunction(geometry.get(), intersect_cluster);
    rtcSetGeometryOccludedFunction(geometry.get(), occluded_cluster);
    rtcSetGeometryMask(geometry.get(), ~0u); // leaves know their ray classes
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene.get(), geometry.get());
    rtcSetSceneProgressMonitorFunction(
        scene.get(), [](void*, double) { return !Progress::cancelled(); }, nullptr);
    rtcCommitScene(scene.get());
    device.check();
    return scene;
  }
};

EmbreeClusterTracer::EmbreeClusterTracer(const BakedFile& file, const SceneSource& source, PackedIsa isa)
    : packed_(file, source, isa), trees_(std::make_unique<Trees>()) {
  if (rtcGetDeviceProperty(trees_->device.get(), RTC_DEVICE_PROPERTY_USER_GEOMETRY_SUPPORTED) == 0)
    throw Error(ErrorKind::kUnsupported, "this Embree was built without user geometry");
  const std::span<const packed::TraceTree> trees = packed_.trees();
  for (uint32_t i = 0; i < trees.size(); ++i)
    trees_->nodes.push_back(nodes_of(trees[i], packed_.tree_records()[i].node_count));
  for (ClusterNodes& nodes : trees_->nodes) {
    Progress().check_cancelled();
    trees_->scenes.push_back(nodes.primitive_count() > 0 ? trees_->build(nodes) : nullptr);
  }
  packed_.search_trees(
      [](const void* searcher, const packed::TreeSearch& search) {
        search_scene(static_cast<const Trees*>(searcher)->scenes[search.tree].get(), search);
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
