// Compares the voxels of a baked file with an on/off grid of NanoVDB: bytes, and rays per second, over the same voxels
// and rays; and their bits with those of a pointerless octree. Usage: packtrace_voxel_benchmark FILE.ptk [RAYS]; the
// file is baked with --proxy voxels. For a file of --proxy sdf, builds the distance fields again and counts the samples
// that jump flooding has wrong.

#include <algorithm>
#include <bit>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <random>
#include <string>
#include <vector>

#include <nanovdb/util/HDDA.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <nanovdb/util/Ray.h>
#include <openvdb/openvdb.h>

#include "compress/bake/proxies/geometry_field.h"
#include "compress/bake/proxies/occluding_triangles.h"
#include "compress/format/voxels/cell_pyramid.h"
#include "compress/format/voxels/proxy_codec.h"
#include "compress/format/voxels/proxy_section.h"
#include "runtime/voxels/voxel_tracer.h"
#include "tests/benchmarks/thread_cpu_time.h"

namespace packtrace {
namespace {

struct BenchmarkRay {
  glm::vec3 origin, direction;
};

/// From a sphere around the grid to points within it.
std::vector<BenchmarkRay> make_rays(const VoxelIndex& size, size_t count) {
  std::mt19937 random(1);
  const auto uniform = [&] { return static_cast<double>(random()) * 0x1p-32; };
  const glm::dvec3 extent(size[0], size[1], size[2]);
  std::vector<BenchmarkRay> rays;
  for (size_t i = 0; i < count; ++i) {
    const glm::dvec3 out = glm::normalize(glm::dvec3(uniform(), uniform(), uniform()) * 2.0 - 1.0 + 1e-9);
    const glm::dvec3 eye = 0.5 * extent + out * glm::length(extent);
    rays.push_back({glm::vec3(eye), glm::vec3(extent * glm::dvec3(uniform(), uniform(), uniform()) - eye)});
  }
  return rays;
}

/// Bits of an octree of the voxels without pointers or index: 8 bits a node down to the voxels, from a cube of 2^n.
uint64_t octree_bits(const VoxelSet& set) {
  const uint32_t longest = std::max({set.size()[0], set.size()[1], set.size()[2]});
  const auto levels = static_cast<uint32_t>(std::bit_width(longest - 1)) + 1;
  const CellPyramid pyramid(set, levels, nullptr);
  uint64_t nodes = 0;
  for (uint32_t k = 1; k < levels; ++k) nodes += pyramid.any_count(k);
  return 8 * nodes;
}

void compare(const Proxy& proxy, size_t ray_count) {
  const VoxelSet set = decode_occupancy(proxy.voxels);
  openvdb::MaskGrid source; // NanoVDB's own builder makes no grids without values
  {
    auto accessor = source.getAccessor();
    set.for_each([&](VoxelIndex v) {
      accessor.setValueOn(openvdb::Coord(static_cast<int>(v[0]), static_cast<int>(v[1]), static_cast<int>(v[2])));
    });
  }
  const auto handle = nanovdb::openToNanoVDB(source);
  const auto* const grid = handle.grid<nanovdb::ValueMask>();
  const std::vector<BenchmarkRay> rays = make_rays(proxy.voxels.size(), ray_count);
  std::vector<float> ours(rays.size()), theirs(rays.size());
  const VoxelTracer tracer(proxy.voxels);
  const auto trace_ours = [&] {
    for (size_t i = 0; i < rays.size(); ++i) {
      const auto hit = tracer.first_hit(rays[i].origin, rays[i].direction, 0.0f, 1e30f);
      ours[i] = hit ? hit->t : -1.0f;
    }
  };
  const auto trace_theirs = [&] {
    auto accessor = grid->getAccessor();
    using RayT = nanovdb::Ray<float>;
    const auto bbox = grid->tree().bbox();
    for (size_t i = 0; i < rays.size(); ++i) {
      const auto &o = rays[i].origin, &d = rays[i].direction;
      theirs[i] = -1.0f;
      RayT ray(nanovdb::Vec3f(o.x, o.y, o.z), nanovdb::Vec3f(d.x, d.y, d.z), 0.0f, 1e30f);
      if (!ray.clip(bbox)) continue;
      nanovdb::Coord ijk = nanovdb::RoundDown<nanovdb::Coord>(ray.start());
      nanovdb::HDDA<RayT> hdda(ray, accessor.getDim(ijk, ray));
      do {
        ijk = nanovdb::RoundDown<nanovdb::Coord>(ray(hdda.time() + 1e-6f));
        hdda.update(ray, accessor.getDim(ijk, ray));
        if (hdda.dim() > 1 || !accessor.isActive(ijk)) continue;
        theirs[i] = hdda.time();
        break;
      } while (hdda.step());
    }
  };
  const std::vector<double> ms = median_cpu_ms({trace_ours, trace_theirs}, 5);
  uint64_t hits = 0, different = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    hits += ours[i] >= 0.0f;
    different += (ours[i] >= 0.0f) != (theirs[i] >= 0.0f) || std::abs(ours[i] - theirs[i]) > 1e-3f;
  }
  const auto mrays = [&](double seconds) { return static_cast<double>(rays.size()) * 1e-6 / seconds; };
  const VoxelIndex& size = proxy.voxels.size();
  std::printf(
      "{\"size\": [%u, %u, %u], \"voxels\": %llu, \"bits_per_voxel\": %.3f, \"octree_bits_per_voxel\": %.3f, "
      "\"bytes\": {\"packtrace\": %llu, "
      "\"nanovdb\": %llu, \"ratio\": %.4f}, \"mrays_per_s\": {\"packtrace\": %.3f, \"nanovdb\": %.3f, \"ratio\": "
      "%.3f}, \"hits\": %llu, \"different\": %llu}\n",
      size[0], size[1], size[2], static_cast<unsigned long long>(set.count()),
      static_cast<double>(proxy.voxels.bits()) / static_cast<double>(set.count()),
      static_cast<double>(octree_bits(set)) / static_cast<double>(set.count()),
      static_cast<unsigned long long>(proxy.voxels.bits() / 8), static_cast<unsigned long long>(handle.size()),
      static_cast<double>(proxy.voxels.bits() / 8) / static_cast<double>(handle.size()), mrays(1e-3 * ms[0]),
      mrays(1e-3 * ms[1]), ms[1] / ms[0], static_cast<unsigned long long>(hits),
      static_cast<unsigned long long>(different));
}

void count_repairs(const BakedFile& file, const Proxy& proxy) {
  const uint32_t g = proxy.record.geometry;
  ProxyConfig config;
  config.use = ProxyUse::kField, config.field_bits = proxy.field.header().sample_bits;
  config.voxels = std::ranges::max(proxy.field.size()) - 2 * voxels::kFieldMargin;
  const GeometryField built = build_field(occluding_triangles(file, g, material_runs(file.sections())[g]), config,
                                          MemoryBudget(), "a geometry");
  const VoxelIndex& size = built.field.size();
  std::printf("{\"size\": [%u, %u, %u], \"band_samples\": %llu, \"repaired\": %llu, \"repaired_share\": %.3f}\n",
              size[0], size[1], size[2], static_cast<unsigned long long>(built.band_samples),
              static_cast<unsigned long long>(built.repaired),
              static_cast<double>(built.repaired) / static_cast<double>(built.band_samples));
}

} // namespace
} // namespace packtrace

int main(int count, char** arguments) {
  try {
    openvdb::initialize();
    if (count < 2) throw std::runtime_error("usage: packtrace_voxel_benchmark FILE.ptk [RAYS]");
    const packtrace::BakedFile file = packtrace::BakedFile::open(arguments[1]);
    const std::span<const uint8_t> bytes = packtrace::proxy_bytes(file);
    if (bytes.empty()) throw std::runtime_error("the file has no proxies; bake it with --proxy voxels");
    for (const packtrace::Proxy& proxy : packtrace::read_proxies(bytes))
      if (proxy.is_field())
        packtrace::count_repairs(file, proxy);
      else
        packtrace::compare(proxy, count > 2 ? std::stoul(arguments[2]) : 1000000);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
