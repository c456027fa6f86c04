#pragma once

#include <span>

#include "compress/bake/clusters/clusterize.h"

namespace packtrace {

/// Splits triangles of one kind into clusters twice: grown from neighbour to neighbour (clusterize()), and cut from a
/// tree (cut_clusters()). Returns the clusters that take fewer bits, as estimated from their vertices and extents.
/// @param positions in lattice steps, by the numbers in input.points
/// @param normals whether the vertices have normals
Clusters split_level(const ClusterizeInput& input, std::span<const DVec3> positions, bool normals);

} // namespace packtrace
