"""Restores BVH nodes from their topology; boxes and ray classes follow from the clusters."""

from ptk.checks import TreeBoxes
from ptk.records import INNER_CHILD, NODE, BadFile, unzigzag
from ptk.resident import BakedFile


def read_topology(data, trees):
    """Returns the nodes of each tree, without boxes, from the bytes of node form 1."""
    counts, at = data[: sum(tree["node_count"] for tree in trees)], 0
    of_trees, with_leaves = [], []
    for tree in trees:
        nodes = [new_node() for _ in range(tree["node_count"])]
        for node, count in zip(nodes, counts[at : at + len(nodes)]):
            node["children"] = [INNER_CHILD] * (count - 128) if count >= 128 else [None] * count
        at += len(nodes)
        end, stack = 1, [0] if nodes else []
        while stack:
            node = nodes[stack.pop()]
            if INNER_CHILD in node["children"]:
                node["first_child"] = end
                end += len(node["children"])
                stack += reversed(range(node["first_child"], end))
            else:
                with_leaves.append(node)
        of_trees.append(nodes)
    for node in with_leaves:
        node["children"] = list(data[at : at + len(node["children"])])
        at += len(node["children"])
    count = len(with_leaves)
    for node, first in zip(with_leaves, data[at : at + count]):
        node["first_triangle"] = first
    planes, cluster = data[at + count :], 0
    if len(planes) != 4 * count:
        raise BadFile("the topology of nodes is not as long as it should be")
    for i, node in enumerate(with_leaves):
        cluster += unzigzag(int.from_bytes(planes[i::count], "little"))
        node["cluster"] = cluster
    return of_trees


def new_node():
    return {"origin": (0, 0, 0), "exponents": 0, "ray_classes": 0, "first_triangle": 0, "first_child": 0, "cluster": 0,
            "children": [], "lo": [255] * 24, "hi": [0] * 24}


def fit_boxes(node, boxes):
    """Sets the node's origin and exponents, and the quantised boxes of its children."""
    origin, exponents = [], 0
    for axis in range(3):
        lo, hi = min(box[0][axis] for box in boxes), max(box[1][axis] for box in boxes)
        exponent = 0
        while -(-(hi - lo) // (1 << exponent)) > 255:
            exponent += 1
        origin.append(lo)
        exponents |= exponent << 5 * axis
        for slot, box in enumerate(boxes):
            node["lo"][8 * axis + slot] = box[0][axis] - lo >> exponent
            node["hi"][8 * axis + slot] = -(-(box[1][axis] - lo) // (1 << exponent))
    node["origin"], node["exponents"] = tuple(origin), exponents


def restore_nodes(resident, topology):
    """Returns the bytes of the node section. @param resident the resident form with that section empty"""
    baked = BakedFile(resident, with_nodes=False)
    meshes = [baked.decode(geometry) for geometry in baked.sections["geometries"]]
    boxes = TreeBoxes(baked, meshes)
    out = b""
    for tree, nodes in zip(baked.sections["trees"], read_topology(topology, baked.sections["trees"])):
        below = [None] * len(nodes)
        for number in reversed(range(len(nodes))): # children have higher numbers
            node = nodes[number]
            if INNER_CHILD in node["children"]:
                first, end = node["first_child"], node["first_child"] + len(node["children"])
                children = below[first:end]
                for child in nodes[first:end]:
                    node["ray_classes"] |= child["ray_classes"] & 3
            else:
                children, triangle = [], node["first_triangle"]
                for count in node["children"]:
                    children.append(boxes.leaf_box(tree, node["cluster"], triangle, count))
                    triangle += count
                node["ray_classes"] = boxes.classes_of[node["cluster"]]
            fit_boxes(node, children)
            below[number] = [[pick(box[end][axis] for box in children) for axis in range(3)] for end, pick in ((0, min), (1, max))]
            node["children"] = node["children"] + [0] * (8 - len(node["children"]))
        out += b"".join(map(NODE.write, nodes))
    return out
