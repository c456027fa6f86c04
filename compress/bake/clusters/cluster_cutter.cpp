#include "compress/bake/clusters/cluster_cutter.h"

#include <cassert>

#include "compress/format/cluster/index_codec.h"

namespace packtrace {
namespace {

/// Counts the distinct vertices of the cluster under construction.
class VertexCounter {
public:
  explicit VertexCounter(uint32_t vertex_count) : cluster_of_(vertex_count, 0) {}

  void begin_cluster() { ++cluster_, count_ = 0; }
  /// Adds a triangle's vertices and returns the number of distinct vertices.
  uint32_t add(const Triangle& triangle) {
    for (int corner = 0; corner < 3; ++corner)
      if (uint32_t& cluster = cluster_of_[triangle[corner]]; cluster != cluster_) cluster = cluster_, ++count_;
    return count_;
  }

private:
  std::vector<uint32_t> cluster_of_; ///< per vertex: the last cluster that counted it
  uint32_t cluster_ = 0, count_ = 0;
};

} // namespace

Clusters cut_clusters(std::span<const TreeBox> boxes, std::span<const Triangle> vertices, uint32_t vertex_count) {
  assert(boxes.size() == vertices.size());
  Clusters out;
  const std::vector<uint32_t> parts = cut_boxes(boxes, kMaxClusterTriangles, out.order);
  VertexCounter counter(vertex_count);
  counter.begin_cluster();
  uint32_t begin = 0, part_begin = 0;
  const auto close = [&](uint32_t end) {
    if (end > begin) out.ends.push_back(end);
    begin = end;
    counter.begin_cluster();
  };
  for (const uint32_t part_end : parts) {
    if (part_end - begin > kMaxClusterTriangles) close(part_begin);
    for (uint32_t i = part_begin; i < part_end; ++i) {
      if (counter.add(vertices[out.order[i]]) <= kMaxClusterVertices) continue;
      // Do not split a part to fill the cluster before it. A part is cut only if it exceeds the limit alone.
      const bool alone = begin >= part_begin;
      if (!alone) i = part_begin;
      close(i);
      counter.add(vertices[out.order[i]]);
    }
    part_begin = part_end;
  }
  close(static_cast<uint32_t>(out.order.size()));
  return out;
}

} // namespace packtrace
