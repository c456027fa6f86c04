// Builds the trees of baked files and reports their quality, size and build time. Usage:
//
//   build/release/bin/tree_benchmark house.ptk ...

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "compress/format/file/baked_file.h"
#include "compress/format/trees/packed_trees.h"
#include "pbrt_import/base/error.h"
#include "tests/benchmarks/benchmark_options.h"

namespace packtrace {
namespace {

/// Half the surface area of the bounds of children [first, last), on the node's grid.
double half_area(const baked::PackedNode& node, size_t first, size_t last) {
  std::array<double, 3> extent{};
  for (uint32_t axis = 0; axis < 3; ++axis) {
    uint32_t lo = 255, hi = 0;
    for (size_t slot = first; slot < last; ++slot)
      lo = std::min<uint32_t>(lo, node.lo[axis][slot]), hi = std::max<uint32_t>(hi, node.hi[axis][slot]);
    extent[axis] = (hi - lo) * static_cast<double>(1u << node.exponent(axis));
  }
  return extent[0] * extent[1] + extent[1] * extent[2] + extent[2] * extent[0];
}

/// Sums over trees. Visits, batches and tests are expected values for a random line that hits the root's bounds,
/// weighted by the triangles of each tree.
struct Figures {
  uint64_t nodes = 0, leaf_nodes = 0, leaves = 0, children = 0, triangles = 0;
  uint32_t depth = 0;
  double inner_visits = 0, leaf_node_visits = 0, leaf_visits = 0, batches = 0, triangle_tests = 0;
  std::array<uint64_t, 17> sizes{};
};

void add_tree(const PackedTrees& trees, const baked::TreeRecord& tree, Figures& out) {
  if (tree.node_count == 0) return;
  const auto nodes = std::span(trees.nodes).subspan(static_cast<size_t>(tree.first_node), tree.node_count);
  Figures f;
  const double root = std::max(half_area(nodes[0], 0, 8), 1e-300);
  for (const baked::PackedNode& node : nodes) {
    uint32_t used = 0;
    while (used < 8 && node.children[used] != baked::kNoChild) ++used;
    const double area = half_area(node, 0, used) / root;
    (node.has_leaves() ? f.leaf_node_visits : f.inner_visits) += area;
    f.children += node.has_leaves() ? 0 : used;
    f.leaf_nodes += node.has_leaves();
    for (uint32_t slot = 0; node.has_leaves() && slot < used; ++slot) {
      const double leaf = half_area(node, slot, slot + 1) / root;
      const uint32_t count = node.children[slot];
      f.leaf_visits += leaf, f.batches += leaf * ((count + 7) / 8), f.triangle_tests += leaf * count;
      ++f.leaves, ++f.sizes[count];
      f.triangles += count;
    }
  }
  out.nodes += tree.node_count, out.leaf_nodes += f.leaf_nodes, out.leaves += f.leaves, out.children += f.children;
  out.triangles += f.triangles;
  out.depth = std::max(out.depth, tree.depth);
  const auto weight = static_cast<double>(f.triangles);
  out.inner_visits += weight * f.inner_visits, out.leaf_node_visits += weight * f.leaf_node_visits;
  out.leaf_visits += weight * f.leaf_visits, out.batches += weight * f.batches;
  out.triangle_tests += weight * f.triangle_tests;
  for (size_t i = 0; i < out.sizes.size(); ++i) out.sizes[i] += f.sizes[i];
}

double seconds_to_build(const BakedFile& file, const TreeCosts& costs, int repeats) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    const PackedTrees trees = build_packed_trees(file.sections(), costs);
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

nlohmann::ordered_json measure(const std::string& path, const TreeCosts& costs, int repeats) {
  const BakedFile file = BakedFile::open(path);
  const PackedTrees trees = build_packed_trees(file.sections(), costs);
  Figures f;
  for (const baked::TreeRecord& tree : trees.trees) add_tree(trees, tree, f);
  const auto triangles = static_cast<double>(f.triangles);
  nlohmann::ordered_json out;
  out["file"] = path;
  out["triangles"] = f.triangles;
  out["trees"] = trees.trees.size();
  out["nodes"] = f.nodes;
  out["depth"] = f.depth;
  out["node_bytes_per_triangle"] = static_cast<double>(f.nodes * sizeof(baked::PackedNode)) / triangles;
  out["triangles_per_leaf"] = triangles / static_cast<double>(f.leaves);
  out["leaves_per_node"] = static_cast<double>(f.leaves) / static_cast<double>(f.leaf_nodes);
  out["children_per_inner_node"] =
      static_cast<double>(f.children) / std::max(1.0, static_cast<double>(f.nodes - f.leaf_nodes));
  out["sah_inner_nodes"] = f.inner_visits / triangles;
  out["sah_leaf_nodes"] = f.leaf_node_visits / triangles;
  out["sah_leaves"] = f.leaf_visits / triangles;
  out["sah_batches"] = f.batches / triangles;
  out["sah_triangles"] = f.triangle_tests / triangles;
  out["sah_cost"] =
      (costs.node * (f.inner_visits + f.leaf_node_visits) + costs.leaf * f.leaf_visits + costs.batch * f.batches) /
      triangles;
  out["leaf_sizes"] = f.sizes;
  if (repeats > 0) {
    out["million_triangles_per_second"] = triangles * 1e-6 / seconds_to_build(file, costs, repeats);
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
    out["million_triangles_per_second_one_thread"] = triangles * 1e-6 / seconds_to_build(file, costs, repeats);
  }
  return out;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) {
  using namespace packtrace;
  BenchmarkOptions command_line("Builds the trees of baked files and measures them.");
  std::vector<std::string> files;
  TreeCosts costs;
  int repeats = 3;
  command_line.add("files", files, ".ptk files").required();
  command_line.add("--repeats", repeats, "builds to time; the fastest counts; 0: none");
  command_line.add("--node", costs.node, "cost of a node");
  command_line.add("--leaf", costs.leaf, "cost of a leaf");
  command_line.add("--batch", costs.batch, "cost of eight triangles");
  command_line.add("--extra-node", costs.extra_node, "cost of one more node for all else");
  command_line.add("--max-leaf", costs.max_leaf_triangles, "triangles of a leaf at most").range(1u, 16u);
  if (const auto code = command_line.parse(argc, argv)) return *code;
  try {
    nlohmann::ordered_json out = nlohmann::ordered_json::array();
    for (const std::string& file : files) out.push_back(measure(file, costs, repeats));
    fmt::print("{}\n", out.dump(1));
  } catch (const Error& error) {
    fmt::print(stderr, "tree_benchmark: {}\n", error.what());
    return 1;
  }
  return 0;
}
