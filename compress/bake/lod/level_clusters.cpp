#include "compress/bake/lod/level_clusters.h"

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "compress/bake/clusters/cluster_cutter.h"
#include "compress/format/layout/baked_format.h"

namespace packtrace {
namespace {

constexpr double kTypicalNormalBits = 15.0; // of a vertex in a typical level
constexpr double kRecordBits = 8.0 * (sizeof(baked::ClusterRecord) + sizeof(baked::LodLinkRecord));

std::vector<TreeBox> boxes_of(std::span<const Triangle> points, std::span<const DVec3> positions) {
  std::vector<TreeBox> boxes(points.size());
  for (size_t i = 0; i < points.size(); ++i)
    for (int corner = 0; corner < 3; ++corner) {
      const DVec3& p = positions[points[i][corner]];
      TreeBox point;
      for (size_t axis = 0; axis < 3; ++axis)
        point.lo[axis] = point.hi[axis] = static_cast<float>(p[static_cast<int>(axis)]);
      if (corner == 0)
        boxes[i] = point;
      else
        boxes[i].extend(point);
    }
  return boxes;
}

/// Estimates the bits of clusters, without those of the triangles, which all splits have in common.
class BitEstimate {
public:
  BitEstimate(const ClusterizeInput& input, std::span<const TreeBox> boxes, bool normals)
      : input_(input), boxes_(boxes), vertex_bits_(normals ? kTypicalNormalBits : 0.0), last_of_(input.vertex_count) {}

  double operator()(const Clusters& clusters) {
    double sum = 0.0;
    uint32_t begin = 0;
    for (const uint32_t end : clusters.ends) {
      sum += of_cluster(std::span(clusters.order).subspan(begin, end - begin));
      begin = end;
    }
    return sum;
  }

private:
  double of_cluster(std::span<const uint32_t> triangles) {
    ++cluster_;
    TreeBox box = boxes_[triangles.front()];
    uint32_t vertices = 0;
    for (const uint32_t triangle : triangles) {
      box.extend(boxes_[triangle]);
      for (int corner = 0; corner < 3; ++corner)
        if (uint32_t& last = last_of_[input_.vertices[triangle][corner]]; last != cluster_) last = cluster_, ++vertices;
    }
    double bits = vertex_bits_;
    for (size_t axis = 0; axis < 3; ++axis) {
      int width = 0;
      std::frexp(box.hi[axis] - box.lo[axis], &width); // extents are whole numbers: the width of their field
      bits += width;
    }
    return kRecordBits + vertices * bits;
  }

  const ClusterizeInput& input_;
  std::span<const TreeBox> boxes_;
  double vertex_bits_;
  std::vector<uint32_t> last_of_; ///< per vertex: the last cluster that counted it
  uint32_t cluster_ = 0;
};

} // namespace

Clusters split_level(const ClusterizeInput& input, std::span<const DVec3> positions, bool normals) {
  const std::vector<TreeBox> boxes = boxes_of(input.points, positions);
  Clusters grown = clusterize(input), cut = cut_clusters(boxes, input.vertices, input.vertex_count);
  BitEstimate bits(input, boxes, normals);
  return bits(cut) < bits(grown) ? std::move(cut) : std::move(grown);
}

} // namespace packtrace
