"""Clusters of codec fast whose triangles are those of a rectangular grid of quads."""

HAS_DIAGONALS = 128

# The triangles of a quad, by its diagonal: corners counterclockwise, relative to the quad's lowest corner. The lower
# one first.
QUAD_TRIANGLES = ((((0, 0), (1, 0), (1, 1)), ((0, 0), (1, 1), (0, 1))),
                  (((0, 0), (1, 0), (0, 1)), ((1, 0), (1, 1), (0, 1))))


class Grid:
    """A block of quads. Points are numbered row by row, (columns + 1) in a row."""

    def __init__(self, number, triangles):
        self.columns, self.has_diagonals = number & (HAS_DIAGONALS - 1), number & HAS_DIAGONALS
        self.rows = triangles // (2 * self.columns)
        self.diagonals = None  # bits per quad
        self.points = [(x, y) for y in range(self.rows + 1) for x in range(self.columns + 1)]

    def triangles(self):
        """Triangles in strip order, as triples of points."""
        along_rows = self.columns >= self.rows
        length, width = (self.columns, self.rows) if along_rows else (self.rows, self.columns)
        entry = {(1, 0), (1, 1)} if along_rows else {(0, 1), (1, 1)}  # the edge where strips enter a quad
        end = length
        while end:
            begin = 0 if width == 1 or end <= 3 else end - 2
            for strip in range(width):
                for i in reversed(range(begin, end)):
                    x, y = (i, strip) if along_rows else (strip, i)
                    quad = QUAD_TRIANGLES[self.diagonals >> y * self.columns + x & 1]
                    for corners in sorted(quad, key=lambda corners: not entry <= set(corners)):
                        yield tuple((x + dx, y + dy) for dx, dy in corners)
            end = begin

    def strips(self):
        """Returns per triangle whether it begins a strip and whether it follows a left turn, and the corner list."""
        starts, lefts, corners = [], [], []
        triangles = list(self.triangles())
        last = None
        for i, triangle in enumerate(triangles):
            edges = {(triangle[k], triangle[(k + 1) % 3]): triangle[(k + 2) % 3] for k in range(3)}
            right = last and edges.get((last[2], last[1]))
            left = last and edges.get((last[0], last[2]))
            starts.append(int(not right and not left))
            lefts.append(int(not right and bool(left)))
            if right or left:
                last = (last[2], last[1], right) if right else (last[0], last[2], left)
                corners.append(last[2])
                continue
            last = triangle
            if i + 1 < len(triangles):  # by a right turn to the next triangle, if it is a neighbour
                following = {(triangles[i + 1][k], triangles[i + 1][(k + 1) % 3]) for k in range(3)}
                turns = [last[k:] + last[:k] for k in range(3)]
                last = next((turn for turn in turns if (turn[2], turn[1]) in following), last)
            corners += last
        return starts, lefts, corners

    def guess(self, x, y):
        """Points p, q, o (or None) that predict the point (x, y) as p + q - o."""
        if x > 0 and y > 0:
            return (x - 1, y), (x, y - 1), (x - 1, y - 1)
        if x > 1:
            return (x - 1, 0), (x - 1, 0), (x - 2, 0)
        if y > 1:
            return (0, y - 1), (0, y - 1), (0, y - 2)
        return (0, 0) if x + y else None, None, None

    def border(self, number):
        """Points of the left column (0) or the lowest row (1)."""
        return [(0, y) for y in range(self.rows + 1)] if number == 0 else [(x, 0) for x in range(self.columns + 1)]

    def opposite_border(self, number):
        if number == 0:
            return [(self.columns, y) for y in range(self.rows + 1)]
        return [(x, self.rows) for x in range(self.columns + 1)]
