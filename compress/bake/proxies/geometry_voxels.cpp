#include "compress/bake/proxies/geometry_voxels.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "compress/bake/lod/bound/triangle_distance.h"
#include "compress/bake/proxies/cancellation.h"
#include "compress/bake/proxies/matched_voxels.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr uint32_t kFineBits = 24; // of a lattice that is divided exactly

/// The grid of voxels over a lattice, in fine units: N to a rounded step.
struct FineGrid {
  uint32_t shift = 0; // of lattice coordinates
  int64_t scale = 1;  // N
  int64_t edge = 1;   // of a voxel, fine units
  VoxelIndex size{};

  FineGrid(const LatticePoint& extent, uint32_t voxels) : scale(voxels) {
    const int64_t longest = *std::max_element(extent.begin(), extent.end());
    const auto bits = static_cast<uint32_t>(std::bit_width(static_cast<uint64_t>(longest)));
    shift = bits > kFineBits ? bits - kFineBits : 0;
    edge = std::max<int64_t>(rounded(longest), 1);
    for (size_t a = 0; a < 3; ++a)
      size[a] = static_cast<uint32_t>(std::clamp<int64_t>((rounded(extent[a]) * scale + edge - 1) / edge, 1, scale));
  }

  int64_t rounded(int64_t p) const { return shift == 0 ? p : (p + (int64_t{1} << (shift - 1))) >> shift; }
  FineTriangle triangle(const OccludingTriangle& t) const {
    FineTriangle fine;
    for (size_t i = 0; i < 3; ++i)
      for (size_t a = 0; a < 3; ++a) fine[i][a] = rounded(t.corners[i][a]) * scale;
    return fine;
  }
  /// Of a voxel, in steps of the lattice.
  double edge_steps() const {
    return static_cast<double>(edge) / static_cast<double>(scale) * std::ldexp(1.0, static_cast<int>(shift));
  }
};

DVec3 vec(const LatticePoint& p) {
  return DVec3(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
}

/// A hash of a voxel's index, in [0, 1).
double any_of(VoxelIndex v) {
  uint32_t hash = v[0] * 0x8da6b343u ^ v[1] * 0xd8163841u ^ v[2] * 0xcb1ab31fu;
  hash = (hash ^ hash >> 15) * 0x2c1b3c6du;
  return static_cast<double>(hash ^ hash >> 13) * 0x1p-32;
}

/// Numbers the voxels of a set in its order.
class VoxelNumbers {
public:
  explicit VoxelNumbers(const VoxelSet& set) : set_(set) {
    const VoxelIndex size = set.size();
    rows_.reserve(size_t{size[1]} * size[2]);
    for (uint32_t z = 0; z < size[2]; ++z)
      for (uint32_t y = 0; y < size[1]; ++y) {
        rows_.push_back(count_);
        for (uint32_t w = 0; w < set.row_words(); ++w) count_ += static_cast<uint64_t>(std::popcount(set.row(y, z)[w]));
      }
  }
  size_t operator[](VoxelIndex v) const {
    const uint64_t* const row = set_.row(v[1], v[2]);
    uint64_t number = rows_[size_t{v[2]} * set_.size()[1] + v[1]];
    for (uint32_t w = 0; w < v[0] / 64; ++w) number += static_cast<uint64_t>(std::popcount(row[w]));
    return static_cast<size_t>(
        number + static_cast<uint64_t>(std::popcount(row[v[0] / 64] & ((uint64_t{1} << (v[0] % 64)) - 1))));
  }
  uint64_t count() const { return count_; }

private:
  const VoxelSet& set_;
  std::vector<uint64_t> rows_;
  uint64_t count_ = 0;
};

/// Bytes of voxelize() and of the encoding for a grid; measured on large meshes and rounded up.
uint64_t working_bytes(const FineGrid& grid) { return 4 * VoxelSet::bytes_for(grid.size) + (uint64_t{1} << 20); }

MemoryReservation reserve(const LatticePoint& extent, uint32_t voxels, const MemoryBudget& budget,
                          const std::string& what) {
  const FineGrid grid(extent, voxels);
  if (working_bytes(grid) > budget.left()) {
    uint32_t fits = voxels;
    while (fits > 1 && working_bytes(FineGrid(extent, fits)) > budget.left()) --fits;
    throw MemoryError("voxels of " + what + ": a grid of " + std::to_string(grid.size[0]) + " x " +
                      std::to_string(grid.size[1]) + " x " + std::to_string(grid.size[2]) + " needs " +
                      std::to_string(working_bytes(grid) >> 20) + " MiB of memory, of " +
                      std::to_string(budget.left() >> 20) + " MiB left; the largest that fits is --proxy-voxels " +
                      std::to_string(fits));
  }
  return MemoryReservation(budget, working_bytes(grid), "voxels of " + what);
}

class Voxelizer {
public:
  Voxelizer(const BakedFile& file, std::span<const uint32_t> runs, const OccludingTriangles& source,
            const ProxyConfig& config, const MemoryBudget& budget, const std::string& what)
      : file_(file), runs_(runs), source_(source), config_(config), budget_(budget), what_(what),
        grid_(source.extent, config.voxels) {}

  GeometryVoxels run() {
    result_.set = VoxelSet(grid_.size);
    result_.frame = voxel_frame(source_, config_.voxels);
    for_each_pair([&](const OccludingTriangle&, VoxelIndex v) { result_.set.set(v); });
    if (config_.rule == VoxelRule::kSeparating) keep_small_parts();
    const VoxelSet surface = result_.set;
    if (config_.rule == VoxelRule::kMatched)
      match();
    else if (config_.fill && source_.closed)
      fill();
    measure_voxels();
    measure_surface(config_.rule == VoxelRule::kMatched ? result_.set : surface);
    return std::move(result_);
  }

private:
  /// Visits each triangle with each voxel that it sets: visit(triangle, voxel).
  template <class Visit>
  void for_each_pair(const Visit& visit) const {
    const double edge = grid_.edge_steps();
    for (const OccludingTriangle& t : source_.triangles)
      TriangleVoxels(grid_.triangle(t), grid_.edge, grid_.size, config_.rule)
          .for_each_row([&](uint32_t y, uint32_t z, uint32_t first, uint32_t last) {
            stop_if_cancelled();
            for (uint32_t x = first; x <= last; ++x)
              if (!t.masked || opaque_within(file_, runs_, t, edge * DVec3(x, y, z), edge))
                visit(t, VoxelIndex{x, y, z});
          });
  }

  /// The separating rule sets no voxel for a small part in a corner of one: sets the voxel of each triangle around
  /// which no other is set.
  void keep_small_parts() {
    const VoxelSet before = result_.set;
    const VoxelIndex size = before.size();
    for (const OccludingTriangle& t : source_.triangles) {
      stop_if_cancelled();
      if (t.masked) continue;
      const DVec3 center = (vec(t.corners[0]) + vec(t.corners[1]) + vec(t.corners[2])) / (3.0 * grid_.edge_steps());
      const DVec3 own = glm::clamp(glm::floor(center), DVec3(0.0), DVec3(size[0] - 1.0, size[1] - 1.0, size[2] - 1.0));
      const auto x = static_cast<int64_t>(own.x), y = static_cast<int64_t>(own.y), z = static_cast<int64_t>(own.z);
      if (!near_any(before, x, y, z))
        result_.set.set({static_cast<uint32_t>(own.x), static_cast<uint32_t>(own.y), static_cast<uint32_t>(own.z)});
    }
  }

  void fill() {
    result_.set.merge(inside_voxels(source_, config_.voxels));
    result_.filled = true;
  }

  /// Selects voxels until they block the same number of lines as the triangles. Voxels whose centres are deepest inside
  /// a closed surface, or nearest to an open one, come first.
  void match() {
    const VoxelSet surface = result_.set;
    result_.set = source_.closed ? inside_voxels(source_, config_.voxels) : VoxelSet(grid_.size);
    result_.filled = source_.closed;
    const VoxelNumbers numbers(surface);
    const uint64_t bytes = numbers.count() * sizeof(float) + source_.triangles.size() * sizeof(DVec3) * 3;
    const MemoryReservation memory(budget_, bytes, "the matched voxels of " + what_);
    std::vector<float> depths = center_distances(surface, numbers);
    surface.for_each([&](VoxelIndex v) {
      float& depth = depths[numbers[v]];
      depth = (result_.set.test(v) ? -depth : depth) + static_cast<float>(kTieBreak * grid_.edge_steps() * any_of(v));
    });
    const double per_voxel = 1.0 / grid_.edge_steps();
    std::vector<std::array<DVec3, 3>> triangles;
    for (const OccludingTriangle& t : source_.triangles)
      triangles.push_back(
          {per_voxel * vec(t.corners[0]), per_voxel * vec(t.corners[1]), per_voxel * vec(t.corners[2])});
    LineScene scene{grid_.size, triangles, {}, {}};
    scene.opaque = [&](size_t t, DVec3 point) {
      constexpr double kPart = 0.25; // of a voxel, in which a mask must leave something
      const OccludingTriangle& triangle = source_.triangles[t];
      return !triangle.masked ||
             opaque_within(file_, runs_, triangle, (point - 0.5 * kPart) / per_voxel, kPart / per_voxel);
    };
    scene.depth = [&](VoxelIndex v) {
      constexpr float kNever = std::numeric_limits<float>::infinity();
      if (surface.test(v)) return depths[numbers[v]];
      return result_.set.test(v) ? -kNever : kNever;
    };
    const float most = matching_depth(scene);
    surface.for_each([&](VoxelIndex v) { depths[numbers[v]] <= most ? result_.set.set(v) : result_.set.clear(v); });
    keep_near(surface);
  }

  /// Sets voxels of a surface that are more than one voxel away from any that is set.
  void keep_near(const VoxelSet& surface) {
    surface.for_each([&](VoxelIndex v) {
      const auto [x, y, z] = std::array<int64_t, 3>{v[0], v[1], v[2]};
      if (!near_any(result_.set, x, y, z)) result_.set.set(v);
    });
  }

  /// Whether a voxel or one of the 26 around it is set.
  static bool near_any(const VoxelSet& set, int64_t x, int64_t y, int64_t z) {
    for (int64_t k = -1; k <= 1; ++k)
      for (int64_t j = -1; j <= 1; ++j)
        for (int64_t i = -1; i <= 1; ++i)
          if (set.contains(x + i, y + j, z + k)) return true;
    return false;
  }

  /// Distances in lattice steps from the centres of a set's voxels to the nearest of the triangles that set them.
  /// @param slots receives the material slot of each voxel's nearest triangle; may be null
  std::vector<float> center_distances(const VoxelSet& set, const VoxelNumbers& numbers,
                                      std::vector<uint32_t>* slots = nullptr) const {
    const double edge = grid_.edge_steps();
    std::vector<float> distances(static_cast<size_t>(numbers.count()), kNoDistance);
    for_each_pair([&](const OccludingTriangle& t, VoxelIndex v) {
      if (!set.test(v)) return;
      const DVec3 center = edge * (DVec3(v[0], v[1], v[2]) + 0.5);
      const DVec3 nearest = nearest_point(center, vec(t.corners[0]), vec(t.corners[1]), vec(t.corners[2]));
      const auto distance = static_cast<float>(glm::distance(center, nearest));
      const size_t number = numbers[v];
      if (!(distance < distances[number])) return;
      distances[number] = distance;
      if (slots != nullptr) (*slots)[number] = t.slot;
    });
    return distances;
  }

  void measure_voxels() {
    const VoxelNumbers numbers(result_.set);
    // Surface voxels are within working_bytes().
    const uint64_t bytes = numbers.count() * (sizeof(float) + (config_.materials ? sizeof(result_.slots[0]) : 0));
    const MemoryReservation memory(budget_, result_.filled ? bytes : 0, "the filled voxels of " + what_);
    if (config_.materials) result_.slots.resize(static_cast<size_t>(numbers.count()));
    for (const float d : center_distances(result_.set, numbers, config_.materials ? &result_.slots : nullptr))
      if (d != kNoDistance) result_.voxel_error = std::max(result_.voxel_error, double{d});
    result_.voxel_error *= source_.step;
  }

  void measure_surface(const VoxelSet& surface) {
    double largest = 0.0; // squared, in voxels
    const double per_voxel = 1.0 / grid_.edge_steps();
    for (const OccludingTriangle& t : source_.triangles) {
      if (t.masked) continue; // where it is absent, no voxel is near
      const DVec3 a = vec(t.corners[0]) * per_voxel, ab = vec(t.corners[1]) * per_voxel - a,
                  ac = vec(t.corners[2]) * per_voxel - a;
      const double longest = std::max({glm::length(ab), glm::length(ac), glm::length(ab - ac)});
      const int steps = std::max(1, static_cast<int>(std::ceil(2.0 * longest)));
      for (int u = 0; u <= steps; ++u) {
        stop_if_cancelled();
        for (int v = 0; u + v <= steps; ++v)
          largest = std::max(largest, nearest_squared(surface, a + (ab * double(u) + ac * double(v)) / double(steps)));
      }
    }
    if (!std::isfinite(largest))
      throw Error(ErrorKind::kUsage, "voxels of " + what_ + ": parts of the geometry are far from any voxel");
    result_.surface_error = std::sqrt(largest) * result_.frame.edge;
  }

  /// Squared distance to the centre of the voxel of a point, or else of the nearest one around; in voxels.
  static double nearest_squared(const VoxelSet& set, DVec3 p) {
    const glm::dvec3 top(set.size()[0] - 1.0, set.size()[1] - 1.0, set.size()[2] - 1.0);
    const DVec3 own = glm::clamp(glm::floor(p), DVec3(0.0), top);
    const auto squared = [&](DVec3 v) { return glm::dot(v + 0.5 - p, v + 0.5 - p); };
    const auto x = static_cast<int64_t>(own.x), y = static_cast<int64_t>(own.y), z = static_cast<int64_t>(own.z);
    if (set.contains(x, y, z)) return squared(own);
    for (int64_t reach = 1;; ++reach) {
      double best = std::numeric_limits<double>::infinity();
      for (int64_t k = -reach; k <= reach; ++k)
        for (int64_t j = -reach; j <= reach; ++j)
          for (int64_t i = -reach; i <= reach; ++i)
            if (set.contains(x + i, y + j, z + k)) best = std::min(best, squared(own + DVec3(i, j, k)));
      if (best < std::numeric_limits<double>::infinity() || reach > 8) return best;
    }
  }

  static constexpr double kTieBreak = 1.0 / 64.0; // in voxels; breaks ties between equally deep voxels
  static constexpr float kNoDistance = std::numeric_limits<float>::infinity(); // inside: no triangle sets the voxel

  const BakedFile& file_;
  std::span<const uint32_t> runs_;
  const OccludingTriangles& source_;
  const ProxyConfig& config_;
  const MemoryBudget& budget_;
  const std::string& what_;
  FineGrid grid_;
  GeometryVoxels result_;
};

} // namespace

GeometryVoxels voxelize(const BakedFile& file, std::span<const uint32_t> runs, const OccludingTriangles& source,
                        const ProxyConfig& config, const MemoryBudget& budget, const std::string& what) {
  if (config.voxels < 1 || config.voxels > kMaxGridSize)
    throw Error(ErrorKind::kUsage,
                "voxels: a grid has 1 to " + std::to_string(kMaxGridSize) + " voxels along its longest side");
  const MemoryReservation memory = reserve(source.extent, config.voxels, budget, what);
  return Voxelizer(file, runs, source, config, budget, what).run();
}

VoxelFrame voxel_frame(const OccludingTriangles& source, uint32_t voxels) {
  const FineGrid grid(source.extent, voxels);
  return {vec(source.low) * source.step, grid.edge_steps() * source.step, grid.size};
}

VoxelSet inside_voxels(const OccludingTriangles& source, uint32_t voxels) {
  const FineGrid grid(source.extent, voxels);
  VoxelSet inside(grid.size);
  for (const OccludingTriangle& t : source.triangles) {
    stop_if_cancelled();
    add_crossings(grid.triangle(t), grid.edge, inside);
  }
  prefix_parity(inside);
  return inside;
}

} // namespace packtrace
