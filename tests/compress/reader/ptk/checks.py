"""Checks the invariants of LOD levels and BVH trees."""

from ptk.records import INNER_CHILD, LOD_LEVEL, NONE, BadFile


def check_levels(baked, meshes):
    """Checks that the cut at each level's error has at most the triangle count in the level's record, and that it is
    closed if level 0 is closed. Raises BadFile."""
    geometries = baked.sections["geometries"]
    for base, geometry in enumerate(geometries):
        levels = baked.levels(base)
        if levels and geometry["flags"] & LOD_LEVEL:
            raise BadFile("a level of detail has levels")
        for number, level in enumerate(levels):
            if level["level"] != number or bool(geometries[level["geometry"]]["flags"] & LOD_LEVEL) != (number > 0):
                raise BadFile("levels of detail are not in order")
        was_closed = bool(levels) and is_closed(baked, baked.cut(base, 0.0), meshes)
        for level in levels:
            chosen = baked.cut(base, level["error"])
            triangles = sum(baked.clusters(geometries[g])[c]["triangle_count"] for g, c in chosen)
            if triangles > level["triangles"]: # fewer if group errors are below the level's
                raise BadFile("a cut has more triangles than the level of its error")
            if was_closed and not is_closed(baked, chosen, meshes):
                raise BadFile("a cut through levels of a closed surface is open")


def is_closed(baked, chosen, meshes):
    count = {}
    for number, c in chosen:
        mesh, cluster = meshes[number], baked.clusters(baked.sections["geometries"][number])[c]
        first = cluster["first_triangle"]
        for triangle in mesh.triangles[first : first + cluster["triangle_count"]]:
            for a, b in zip(triangle, triangle[1:] + triangle[:1]):
                a, b = mesh.lattice[a], mesh.lattice[b]
                count[a, b] = count.get((a, b), 0) + 1
                count[b, a] = count.get((b, a), 0) - 1
    return not any(count.values())


class TreeBoxes:
    """What trees derive from clusters: their ray classes, and bounding boxes of their triangles on a tree's grid."""

    def __init__(self, baked, meshes):
        self.baked, self.meshes = baked, meshes
        self.geometry_of, self.classes_of = [], []  # by cluster
        for number, geometry in enumerate(baked.sections["geometries"]):
            self.geometry_of += [number] * geometry["cluster_count"]
            for material_class, count in enumerate(geometry["class_clusters"]):
                # bits: visible to the camera, occludes, needs a mask lookup
                self.classes_of += [(~material_class & 3) | (material_class & 4)] * count

    def leaf_box(self, tree, cluster, first, count):
        """Returns the corners of a leaf's box on the tree's grid, rounded outwards if that grid is coarser."""
        number = self.geometry_of[cluster]
        geometry, mesh = self.baked.sections["geometries"][number], self.meshes[number]
        start = self.baked.sections["clusters"][cluster]["first_triangle"] + first
        points = [mesh.lattice[corner] for triangle in mesh.triangles[start : start + count] for corner in triangle]
        shift = geometry["step_exponent"] - tree["step_exponent"]
        scale = (lambda q: q << shift) if shift >= 0 else (lambda q: q >> -shift)
        return [[pick(sign * scale(sign * point[axis]) - tree["origin"][axis] for point in points) for axis in range(3)]
                for pick, sign in ((min, 1), (max, -1))]


class TreeCheck:
    """Walks the trees of a file and checks that each triangle visible to some ray lies in exactly one leaf, and that
    each box encloses its subtree and is no larger than rounding requires. Raises BadFile."""

    def __init__(self, baked, meshes):
        self.baked, self.meshes = baked, meshes
        self.boxes = TreeBoxes(baked, meshes)
        self.geometry_of, self.classes_of = self.boxes.geometry_of, self.boxes.classes_of
        self.leaves_of = [[0] * cluster["triangle_count"] for cluster in baked.sections["clusters"]]

    def run(self):
        trees = self.baked.sections["trees"]
        own = {tree["geometry"] for tree in trees}
        for tree in trees:
            self.tree = tree
            self.nodes = self.baked.sections["nodes"][tree["first_node"] : tree["first_node"] + tree["node_count"]]
            self.members = {number for number in range(len(self.meshes))
                            if number == tree["geometry"] or (tree["geometry"] == NONE and number not in own)}
            if self.nodes and self.walk(0)[1] != tree["depth"]:
                raise BadFile("a tree's depth is not what its record says")
        for cluster, leaves in enumerate(self.leaves_of):
            wanted = 1 if trees and self.classes_of[cluster] & 3 else 0
            if any(count != wanted for count in leaves):
                raise BadFile(f"triangles of cluster {cluster} are not in one leaf each")

    def walk(self, number):
        """Returns the exact bounding box of a node's subtree and its depth in nodes."""
        node = self.nodes[number]
        below, depth, classes = [], 0, 0
        triangle = node["first_triangle"]
        for slot, child in enumerate(node["children"]):
            if child == INNER_CHILD:
                box, levels = self.walk(node["first_child"] + len(below))
                classes |= self.nodes[node["first_child"] + len(below)]["ray_classes"] & 3
                depth = max(depth, levels)
            elif child:
                box = self.leaf_box(node["cluster"], triangle, child)
                triangle += child
                classes = self.classes_of[node["cluster"]]
            else:
                continue
            below.append(box)
            for axis in range(3):
                unit = 1 << (node["exponents"] >> 5 * axis & 31)
                lo, hi = (node["origin"][axis] + node[end][8 * axis + slot] * unit for end in ("lo", "hi"))
                if not (lo <= box[0][axis] < lo + unit and hi - unit < box[1][axis] <= hi):
                    raise BadFile(f"a box of node {number} is not that of what lies below")
        if classes != node["ray_classes"]:
            raise BadFile(f"the rays that see node {number} are not those of what lies below")
        return [[pick(box[end][axis] for box in below) for axis in range(3)] for end, pick in ((0, min), (1, max))], depth + 1

    def leaf_box(self, cluster, first, count):
        number = self.geometry_of[cluster]
        if number not in self.members:
            raise BadFile("a leaf of another tree's geometry")
        for triangle in range(first, first + count):
            self.leaves_of[cluster][triangle] += 1
        return self.boxes.leaf_box(self.tree, cluster, first, count)
