"""Decodes pages of codec small."""

from dataclasses import dataclass, field

from ptk.canonical import pack
from ptk.normal_guess import NormalPredictor, sum_of_face_normals
from ptk.normals import NORMAL_ENCODINGS
from ptk.place_guess import PlacePredictor
from ptk.rans import Values
from ptk.records import BadFile

RIGHT, LEFT, RESTART = 0, 1, 2
NEW, FIRST_GUESS, SECOND_GUESS, OF_CLUSTER, OF_PAGE, CREASE = range(6)
FULL = 128
MOST_TRIANGLES = 7


@dataclass
class Point:
    """A vertex position of the page with its border edges, newest first: outgoing ones as (end point, corner that faces
    the edge), incoming ones as start points."""

    place: tuple = None
    known: bool = False
    widths: tuple = (0, 0, 0)  # bits of the errors of its place
    triangles: int = 0  # so far, at most MOST_TRIANGLES
    outward: list = field(default_factory=list)
    inward: list = field(default_factory=list)
    cluster: int = -1  # last cluster with a vertex here
    vertex: int = 0  # newest vertex of that cluster here
    normals: list = field(default_factory=list)  # the last two different normals, newest first
    direction: tuple = None  # the newest, decoded

    def ends(self):
        return [end for end, _ in self.outward]


@dataclass
class Vertex:
    point: int
    before: tuple  # vertices of the preceding corners of the triangle that first uses it
    opposite: int  # point across their edge, or None
    naming: int = NEW  # how its first corner was coded
    direction: tuple = None  # its normal, decoded


@dataclass
class SmallCluster:
    """The decoded values of a cluster; canonical.pack() converts them into its record and streams."""

    slot: int = 0
    has_normals: int = 0
    has_uvs: int = 0
    triangle_count: int = FULL
    chart: int = 0  # common chart of all normals; the number of charts if each normal has its own
    has_palette: int = 0
    turns: list = field(default_factory=list)
    corners: list = field(default_factory=list)  # one or three per triangle: (vertex, whether it is fresh)
    triangles: list = field(default_factory=list)
    places: list = field(default_factory=list)
    normals: list = field(default_factory=list)  # (chart, x, y)
    uvs: list = field(default_factory=list)
    repeats: int = 0  # has the turns and corners of the cluster before


def first_but(ends, other):
    """Returns the newest end, or the second newest if the newest is `other`; None if there is none."""
    newest, before = (ends + [None, None])[:2]
    return newest if newest != other else before


class PageDecoder:
    def __init__(self, page):
        self.values = Values(page)
        self.points = []
        self.corner_points = []  # of all triangles of the page
        self.across = []  # per corner, the one that faces the same edge from the other side
        self.number = 0
        self.last = SmallCluster()
        self.last_vertices = []
        self.place_predictor = PlacePredictor()
        self.predictor = NormalPredictor()

    def cluster(self, encoding):
        self.encoding = encoding
        self.c = SmallCluster()
        self.vertices = []
        first_point, first_corner = len(self.points), len(self.corner_points)
        self.header()
        self.triangles()
        self.places(first_point, first_corner)
        self.c.places = [self.points[vertex.point].place for vertex in self.vertices]
        if self.c.has_normals:
            self.normals()
        if self.c.has_uvs:
            self.uvs()
        self.last, self.last_vertices = self.c, self.vertices
        self.number += 1
        return self.c

    def header(self):
        c, values = self.c, self.values
        c.slot = self.last.slot if values.flag("slot") else values.field(32)
        c.has_normals = values.flag("normals", self.last.has_normals)
        c.has_uvs = values.flag("uvs", self.last.has_uvs)
        if c.has_normals:
            c.chart = values.symbol("chart")
            c.has_palette = values.flag("palette")
        c.repeats = values.flag("repeats", self.last.repeats)
        if c.repeats:
            if not self.last.triangles:
                raise BadFile("the first cluster of a page repeats another")
            c.triangle_count = self.last.triangle_count
        elif not values.flag("full"):
            c.triangle_count = 1 + values.field(7)

    def triangles(self):
        c = self.c
        t, before = (), 0  # corners as vertices; the point of the last corner
        for i in range(c.triangle_count):
            turn = RESTART
            if c.repeats:
                turn = self.last.turns[i]
            elif i > 0:
                a, b, last = (self.vertices[v].point for v in t)
                open_right, open_left = last in self.points[b].ends(), a in self.points[last].ends()
                counts = self.points[a].triangles, self.points[b].triangles
                turn = min(self.values.symbol("turn", counts, open_right, open_left), RESTART)
            c.turns.append(turn)
            if turn == RESTART:
                t = self.first_triangle(before)
            else:
                p, q, o = (t[0], t[2], t[1]) if turn == LEFT else (t[2], t[1], t[0])
                counts = [self.points[self.vertices[v].point].triangles for v in (p, q)]
                model = "strip", min(max(counts[0], 3), 6), counts[1]
                t = p, q, self.third(p, q, self.vertices[o].point, model)
            before = self.vertices[t[2]].point
            c.triangles.append(t)
            self.add_triangle([self.vertices[v].point for v in t])

    def first_triangle(self, before):
        guesses = self.ends_at(before) if self.points else (None, None)
        a = self.corner(guesses, None, (), ("first", 0), 1)
        p = self.vertices[a].point
        b = self.corner(self.ends_at(p), None, (a,), ("first", 1), 2)
        q = self.vertices[b].point
        apex = next((self.corner_points[facing] for end, facing in self.points[q].outward if end == p), None)
        return a, b, self.third(a, b, apex, ("first", 2), kind=3)

    def ends_at(self, point):
        """Returns the start of the newest border edge into the point and the end of the newest one out of it."""
        return first_but(self.points[point].inward, None), first_but(self.points[point].ends(), None)

    def third(self, a, b, opposite, model, kind=0):
        p, q = self.vertices[a].point, self.vertices[b].point
        guesses = first_but(self.points[q].inward, opposite), first_but(self.points[p].ends(), opposite)
        return self.corner(guesses, opposite, (a, b), model, kind)

    def corner(self, guesses, opposite, before, model, kind):
        """Decodes a corner and returns its vertex."""
        values, repeats = self.values, self.c.repeats
        if repeats:
            vertex, fresh = self.last.corners[len(self.c.corners)]
            if not fresh:
                self.c.corners.append((vertex, fresh))
                return vertex
            model = "repeated", self.last_vertices[vertex].naming
        state = tuple(self.state_of(guess) for guess in guesses)
        if guesses[0] == guesses[1]:
            state = state[0], "same"
        naming = values.symbol(*model, state)
        fresh = True
        if naming == NEW:
            point = len(self.points)
            self.points.append(Point())
        elif naming in (FIRST_GUESS, SECOND_GUESS):
            point = guesses[naming - FIRST_GUESS]
            if self.points[point].cluster == self.number and not repeats:
                version = values.symbol("version")
                fresh = version > 1
                vertex = self.points[point].vertex if version == 0 else None
                if version == 1:
                    vertex = len(self.vertices) - 1 - values.magnitude("version back")
        elif naming == CREASE or (naming == OF_CLUSTER and not repeats):
            vertex = len(self.vertices) - 1 - values.magnitude("back", kind)
            point = self.vertices[vertex].point
            fresh = naming == CREASE
        elif naming == OF_PAGE:
            point = len(self.points) - 1 - values.magnitude("page back")
        else:
            raise BadFile("a corner without a name")
        if fresh:
            vertex = len(self.vertices)
            self.vertices.append(Vertex(point, before, opposite, naming))
            self.points[point].cluster, self.points[point].vertex = self.number, vertex
        self.c.corners.append((vertex, fresh))
        return vertex

    def state_of(self, guess):
        if guess is None:
            return "none"
        return "here" if self.points[guess].cluster == self.number else "elsewhere"

    def add_triangle(self, t):
        first = len(self.corner_points)
        self.corner_points += t
        self.across += [None] * 3
        for i in range(3):
            begin, end, facing = t[i], t[(i + 1) % 3], first + (i + 2) % 3
            a, b = self.points[begin], self.points[end]
            a.triangles = min(a.triangles + 1, MOST_TRIANGLES)
            if end in a.inward and begin in b.ends():
                a.inward.remove(end)
                _, other = b.outward.pop(b.ends().index(begin))
                self.across[facing], self.across[other] = other, facing
            else:
                a.outward = [(end, facing)] + a.outward[:1]
                b.inward = [begin] + b.inward[:1]

    def surroundings(self, corner):
        """Returns the next and the previous point of a corner's triangle, and the point across their edge or None."""
        first = corner - corner % 3
        across = self.across[corner]
        following, before = (self.corner_points[first + (corner + i) % 3] for i in (1, 2))
        return following, before, None if across is None else self.corner_points[across]

    def rank(self, corners):
        rank = 0
        for p, q, across in corners:
            known = self.points[p].known + self.points[q].known
            enclosed = known == 2 and across is not None and self.points[across].known
            rank += 256 if enclosed else (0, 1, 16)[known]
        return rank

    def places(self, first_point, first_corner):
        around = {point: [] for point in range(first_point, len(self.points))}
        for corner in range(first_corner, len(self.corner_points)):
            if self.corner_points[corner] >= first_point:
                around[self.corner_points[corner]].append(self.surroundings(corner))
        while around:
            number = max(around, key=lambda point: (self.rank(around[point]), -point))
            self.place(self.points[number], around.pop(number))

    def place(self, point, corners):
        guess = self.place_predictor.predict(self.points, corners)
        errors = []
        for axis in range(3):
            errors.append(self.values.mixed_difference(*self.place_predictor.models(axis)))
            self.place_predictor.learn_error(errors[-1])
        point.place = tuple(g + error for g, error in zip(guess, errors))
        point.widths = tuple((~error if error < 0 else error).bit_length() for error in errors)
        point.known = True
        self.place_predictor.learn_place(point.place)

    def normals(self):
        c = self.c
        sums = sum_of_face_normals(c.places, c.triangles)
        last = 0
        for number, vertex in enumerate(self.vertices):
            point = self.points[vertex.point]
            known = len(point.normals)
            offered = list(dict.fromkeys(point.normals + [c.normals[v] for v in vertex.before]))
            choice = self.values.symbol("normal", last, known, len(offered) - known)
            last = 2 if choice > known else min(choice, 2)
            count = sum(triangle.count(number) for triangle in c.triangles)
            normal = offered[choice - 1] if choice else self.coded_normal(self.predicted(number, sums[number], count))
            vertex.direction = self.encoding.decode(*normal)
            if choice == 0:
                self.predictor.learn(vertex.direction)
            c.normals.append(normal)
            if choice == 0 or choice > known or choice == 2:
                point.normals = [normal] + point.normals[:1]
                point.direction = vertex.direction

    def predicted(self, number, face_sum, triangles):
        vertex, places = self.vertices[number], self.c.places
        neighbours = [self.vertices[v].direction for v in vertex.before]
        edges = [tuple(float(q - p) for p, q in zip(places[v], places[number])) for v in vertex.before]
        opposite = None
        if len(vertex.before) == 2 and vertex.opposite is not None:
            opposite = self.points[vertex.opposite].direction
        return self.predictor.predict(self.encoding, face_sum, triangles, neighbours, edges, opposite)

    def coded_normal(self, guess):
        chart, x, y = guess
        values = self.values
        if self.encoding.charts > 1 and values.flag("seam"):
            chart = values.field(3)
        dx = values.difference("normal x", self.predictor.expected_error())
        dy = values.difference("normal y", min((~dx if dx < 0 else dx).bit_length(), 15))
        return self.encoding.canonical(chart, x + dx, y + dy)

    def uvs(self):
        last = 0, 0
        for vertex in self.vertices:
            base = self.c.uvs[vertex.before[0]] if vertex.before else last
            last = tuple(b + self.values.difference("uv", axis) for axis, b in enumerate(base))
            self.c.uvs.append(last)


def decode_page(page, geometries):
    """Returns the PageClusters of a page. @param geometries the geometry of each cluster"""
    decoder = PageDecoder(page)
    clusters = [pack(decoder.cluster(NORMAL_ENCODINGS[geometry["normal_encoding"]]), geometry) for geometry in geometries]
    if not decoder.values.whole():
        raise BadFile("a page does not use up its bytes")
    return clusters
