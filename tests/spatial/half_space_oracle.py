#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes half_space_sets.txt: sets of half-spaces n.x <= o with integer coefficients, and what their intersections are, by
exact rational arithmetic. Run it without arguments: `python3 half_space_oracle.py` writes the file beside itself, always the
same one, and prints how many sets of each kind are in it.

Each set is a line

    set NAME DIMENSION COUNT AFFINE_DIMENSION BOUNDED VERTICES FACETS VOLUME

and COUNT lines `n_1 ... n_d o`. The affine dimension of an empty set is -1, and it is bounded. Vertices are extreme points,
also of unbounded sets; a set that contains a line has none. Facets and volume are 0 unless the set is bounded and has the
affine dimension d.
"""
import collections
import decimal
import fractions
import itertools
import math
import pathlib

Fraction = fractions.Fraction

MOST_HALF_SPACES = 14


# Exact linear algebra


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def reduced(rows):
    """The rows in reduced echelon form, without zero rows, the columns of their pivots, and the product of the pivots: for a
    square matrix of full rank, its determinant."""
    rows = [[Fraction(x) for x in row] for row in rows]
    pivots, product = [], Fraction(1)
    for column in range(len(rows[0]) if rows else 0):
        top = len(pivots)
        found = next((r for r in range(top, len(rows)) if rows[r][column]), None)
        if found is None:
            continue
        if found != top:
            rows[top], rows[found] = rows[found], rows[top]
            product = -product
        pivot = rows[top][column]
        product *= pivot
        rows[top] = [x / pivot for x in rows[top]]
        for r, row in enumerate(rows):
            if r != top and row[column]:
                factor = row[column]
                rows[r] = [x - factor * y for x, y in zip(row, rows[top])]
        pivots.append(column)
    return rows[:len(pivots)], pivots, product


def rank(rows):
    return len(reduced(rows)[1])


def affine_rank(points):
    """The dimension of the affine hull; -1 for no points."""
    points = list(points)
    return rank([[x - y for x, y in zip(p, points[0])] for p in points[1:]]) if points else -1


def determinant(rows):
    _, pivots, product = reduced(rows)
    return product if len(pivots) == len(rows) else Fraction(0)


def common_point(half_spaces):
    """The only point on the boundaries of d half-spaces, or None."""
    d = len(half_spaces[0][0])
    rows, pivots, _ = reduced([[*n, o] for n, o in half_spaces])
    return tuple(row[d] for row in rows) if pivots == list(range(d)) else None


def in_cone(generators, target):
    """Whether the target is a sum of nonnegative multiples of the generators.

    By the first phase of the simplex method, with Bland's rule. Either answer comes with a proof, which is checked: the
    multiples, or a hyperplane between the target and the generators.
    """
    height, width = len(target), len(generators)
    signs = [-1 if t < 0 else 1 for t in target]
    rows = [[Fraction(s * g[r]) for g in generators] + [Fraction(r == k) for k in range(height)] + [Fraction(s * target[r])]
            for r, s in enumerate(signs)]
    costs = [-sum(row[c] for row in rows) for c in range(width)] + [Fraction(0)] * height + [-sum(row[-1] for row in rows)]
    basis = list(range(width, width + height))
    while True:
        entering = next((c for c in range(width) if costs[c] < 0), None)
        if entering is None:
            break
        # The sum of the artificial variables is bounded, so there always is one that leaves.
        _, _, leaving = min((rows[r][-1] / rows[r][entering], basis[r], r) for r in range(height) if rows[r][entering] > 0)
        pivot = rows[leaving][entering]
        rows[leaving] = [x / pivot for x in rows[leaving]]
        for row in (*rows[:leaving], *rows[leaving + 1:], costs):
            factor = row[entering]
            if factor:
                row[:] = [x - factor * y for x, y in zip(row, rows[leaving])]
        basis[leaving] = entering

    if costs[-1] == 0:
        multiples = {basis[r]: rows[r][-1] for r in range(height) if basis[r] < width}
        assert all(m >= 0 for m in multiples.values())
        assert all(sum(m * generators[c][r] for c, m in multiples.items()) == target[r] for r in range(height))
        return True
    hyperplane = [s * (1 - cost) for s, cost in zip(signs, costs[width:])]
    assert all(dot(hyperplane, g) <= 0 for g in generators) and dot(hyperplane, target) > 0
    return False


# What the intersection is


def is_empty(half_spaces, d):
    """By Farkas' lemma: whether a sum of the half-spaces says 0 <= -1."""
    return in_cone([(*n, o) for n, o in half_spaces], (0,) * d + (-1,))


def is_bounded(normals, d):
    """Whether a nonempty intersection is: its recession cone is the origin if and only if the normals span all directions."""
    return all(in_cone(normals, [sign * (k == j) for j in range(d)]) for k in range(d) for sign in (1, -1))


def affine_dimension(half_spaces, d):
    """Of a nonempty intersection: all but the half-spaces whose boundaries contain it, whose opposites are thus implied."""
    implied = [(*n, o) for n, o in half_spaces] + [(0,) * d + (1,)]
    return d - rank([n for n, o in half_spaces if in_cone(implied, [-x for x in (*n, o)])])


def vertices_of(half_spaces, d):
    found = {}
    for chosen in itertools.combinations(half_spaces, d):
        point = common_point(chosen)
        if point is not None and point not in found and all(dot(n, point) <= o for n, o in half_spaces):
            found[point] = None
    return list(found)


def primitive(half_space):
    """The half-space without a common factor of its coefficients."""
    n, o = half_space
    divisor = math.gcd(*n, o)
    return tuple(x // divisor for x in n), o // divisor


class polytope:
    """The faces of a bounded intersection of affine dimension d, as sets of indices of its vertices."""

    def __init__(self, half_spaces, vertices):
        self.d = len(vertices[0])
        self.vertices = vertices
        self.boundaries = {frozenset(i for i, v in enumerate(vertices) if dot(n, v) == o)
                           for n, o in set(map(primitive, half_spaces))}
        self.whole = frozenset(range(len(vertices)))
        self.facets_of_face = {}

    def facets(self, face, dimension):
        if face not in self.facets_of_face:
            parts = {face & boundary for boundary in self.boundaries} - {face}
            self.facets_of_face[face] = [part for part in parts
                                         if affine_rank(self.vertices[i] for i in part) == dimension - 1]
        return self.facets_of_face[face]

    def simplices(self, face, dimension, apex_of):
        """A triangulation of the face: cones from one of its vertices over its facets that do not contain that vertex."""
        if dimension == 0:
            yield tuple(face)
            return
        apex = apex_of(face)
        for facet in self.facets(face, dimension):
            if apex not in facet:
                for simplex in self.simplices(facet, dimension - 1, apex_of):
                    yield (apex, *simplex)

    def volume(self, apex_of=min):
        total = Fraction(0)
        for first, *others in self.simplices(self.whole, self.d, apex_of):
            total += abs(determinant([[x - y for x, y in zip(self.vertices[i], self.vertices[first])] for i in others]))
        return total / math.factorial(self.d)

    def counts_of_faces(self):
        """How many faces have the dimensions d - 1, d - 2, ..., 0."""
        faces, counts = {self.whole}, []
        for dimension in range(self.d, 0, -1):
            faces = {facet for face in faces for facet in self.facets(face, dimension)}
            counts.append(len(faces))
        return counts


answer = collections.namedtuple("answer", "affine_dimension bounded vertices facets volume")


def answer_of(half_spaces, d):
    vertices = vertices_of(half_spaces, d)
    if is_empty(half_spaces, d):
        assert not vertices
        return answer(-1, True, 0, 0, Fraction(0))

    normals = [n for n, _ in half_spaces]
    bounded, dimension = is_bounded(normals, d), affine_dimension(half_spaces, d)
    # What the enumeration says must agree with what the cones say.
    assert bool(vertices) == (rank(normals) == d)
    assert affine_rank(vertices) == dimension if bounded else affine_rank(vertices) <= dimension
    if not bounded or dimension < d:
        return answer(dimension, bounded, len(vertices), 0, Fraction(0))

    shape = polytope(half_spaces, vertices)
    facets = shape.facets(shape.whole, d)
    volume = shape.volume()
    counts = shape.counts_of_faces()
    assert volume > 0 and volume == shape.volume(max)
    assert counts[0] == len(facets) and counts[-1] == len(vertices)
    assert sum((-1) ** k * count for k, count in enumerate(reversed(counts))) == 1 - (-1) ** d
    return answer(dimension, bounded, len(vertices), len(facets), volume)


# Random sets, the same in all versions of Python


class random_stream:
    def __init__(self, seed):
        self.state = seed
        self.below(1)

    def below(self, end):
        self.state = (6364136223846793005 * self.state + 1442695040888963407) % 2 ** 64
        return (self.state >> 33) % end

    def between(self, first, last):
        return first + self.below(last - first + 1)

    def choose(self, items):
        return items[self.below(len(items))]

    def shuffled(self, items):
        items = list(items)
        for i in range(len(items) - 1, 0, -1):
            j = self.below(i + 1)
            items[i], items[j] = items[j], items[i]
        return items

    def vector(self, d, largest):
        """A nonzero vector."""
        while True:
            found = tuple(self.between(-largest, largest) for _ in range(d))
            if any(found):
                return found

    def independent(self, count, d, largest=9):
        while True:
            found = [self.vector(d, largest) for _ in range(count)]
            if rank(found) == count:
                return found


def unit(d, k, sign=1):
    return tuple(sign * (j == k) for j in range(d))


def scaled(half_space, factor):
    n, o = half_space
    return tuple(factor * x for x in n), factor * o


def sum_of(half_spaces):
    normals, offsets = zip(*half_spaces)
    return tuple(map(sum, zip(*normals))), sum(offsets)


def opposite(half_space):
    return scaled(half_space, -1)


def through(n, point):
    return n, dot(n, point)


def moved(half_spaces, to):
    return [(n, o + dot(n, to)) for n, o in half_spaces]


def moved_far(random, d, half_spaces, distance):
    return moved(half_spaces, [random.choose((-1, 1)) * (distance + random.between(-9, 9)) for _ in range(d)])


def moved_in_turn(random, d, half_spaces, i):
    """Every third set stays near the origin; the others are far away."""
    return moved_far(random, d, half_spaces, (0, 1000, 1000000)[i % 3])


def skewed(random, d, half_spaces):
    while True:
        matrix = [tuple(3 * (j == k) + random.between(-1, 1) for j in range(d)) for k in range(d)]
        if rank(matrix) == d:
            return [(tuple(dot(n, column) for column in zip(*matrix)), o) for n, o in half_spaces]


def box(d, lower, upper):
    return [half_space for k in range(d) for half_space in ((unit(d, k), upper[k]), (unit(d, k, -1), -lower[k]))]


def cube(d, half):
    return box(d, [-half] * d, [half] * d)


def around_origin(random, d, count):
    """A bounded set; its boundaries are about 5 to 20 away from the origin."""
    while True:
        normals = [random.vector(d, 9) for _ in range(count)]
        if is_bounded(normals, d):
            return [(n, math.isqrt(dot(n, n) * random.between(5, 20) ** 2)) for n in normals]


# The kinds: functions of a random stream, the dimension, and how many sets of this kind and dimension there already are


def bounded(random, d, i):
    return around_origin(random, d, random.between(8, MOST_HALF_SPACES))


def bounded_far_1000(random, d, i):
    return moved_far(random, d, bounded(random, d, i), 1000)


def bounded_far_1000000(random, d, i):
    return moved_far(random, d, bounded(random, d, i), 1000000)


def redundant(random, d, i):
    base = around_origin(random, d, 8)
    for _ in range(random.between(2, MOST_HALF_SPACES - len(base))):
        one = random.choose(base)
        n, o = one if random.below(2) else sum_of([one, random.choose(base)])
        if any(n):
            base.append((n, o + random.between(1, 50)))
    return moved_in_turn(random, d, random.shuffled(base), i)


def duplicates(random, d, i):
    base = around_origin(random, d, random.between(d + 2, 9))
    copies = [scaled(random.choose(base), random.choose((1, 1, 2, 3, 10)))
              for _ in range(random.between(2, MOST_HALF_SPACES - len(base)))]
    return moved_in_turn(random, d, random.shuffled(base + copies), i)


def cross_polytope(d, size):
    return [(signs, size) for signs in itertools.product((1, -1), repeat=d)]


def pyramid(base, height):
    """Over a base around the origin of one dimension less."""
    d = len(base[0][0]) + 1
    return [((*(height * x for x in n), o), height * o) for n, o in base] + [(unit(d, d - 1, -1), 0)]


def two_pyramids(base, height):
    upper = pyramid(base, height)[:-1]
    return upper + [((*n[:-1], -n[-1]), o) for n, o in upper]


def prism_over(base, height):
    d = len(base[0][0]) + 1
    return [((*n, 0), o) for n, o in base] + [(unit(d, d - 1), height), (unit(d, d - 1, -1), height)]


def cube_without_corners(random, d, size, count):
    """Each cut goes through all vertices next to the corner."""
    corners = random.shuffled(itertools.product((1, -1), repeat=d))[:count]
    return cube(d, size) + [(corner, size * (d - 2)) for corner in corners]


def touched_cube(random, d, size):
    """A cube and redundant half-spaces that touch it in vertices or edges."""
    result = cube(d, size)
    for _ in range(random.between(1, 5)):
        n = random.vector(d, 2)
        result.append((n, size * sum(map(abs, n))))
    return result


def degenerate(random, d, i):
    s, h = random.between(2, 9), random.between(1, 9)
    shapes = [pyramid(cube(d - 1, s), h), two_pyramids(cube(d - 1, s), h), touched_cube(random, d, s),
              cube_without_corners(random, d, s, 1 if d == 2 else random.between(1, 5))]
    if d < 4:
        shapes.insert(0, cross_polytope(d, s))
    else:
        shapes.insert(1, pyramid(cross_polytope(3, s), h))
        shapes.insert(2, prism_over(cross_polytope(3, s), h))
    if d == 3:
        cuboctahedron = cube(3, s) + cross_polytope(3, 2 * s)
        rhombic_dodecahedron = [(n, s) for n in itertools.product((1, 0, -1), repeat=3) if dot(n, n) == 2]
        shapes += [cuboctahedron, rhombic_dodecahedron]
    return shapes[i % len(shapes)]


def degenerate_skewed(random, d, i):
    return moved_in_turn(random, d, skewed(random, d, degenerate(random, d, i)), i)


def degenerate_corner(random, d, i):
    """Half-spaces through a vertex that already is there: some touch, others cut."""
    base = cube(d, random.between(3, 9)) if i % 2 else around_origin(random, d, random.between(d + 2, 9))
    vertex = random.choose(vertices_of(base, d))
    at_vertex = [(n, o) for n, o in base if dot(n, vertex) == o]
    for k in range(random.between(2, 4)):
        if k % 2:
            base.append(sum_of([scaled(one, random.between(1, 3)) for one in at_vertex]))
            continue
        while True:
            n, o = through(random.vector(d, 5), vertex)
            # The origin stays inside.
            if o > 0:
                break
        denominator = o.denominator
        base.append((tuple(denominator * x for x in n), int(denominator * o)))
    return random.shuffled(base)


def pairs_through(random, point, normals):
    """Pairs of opposite half-spaces, some of them scaled."""
    result = []
    for n in normals:
        one = through(n, point)
        result += [scaled(one, random.choose((1, 1, 2, 3))), scaled(opposite(one), random.choose((1, 1, 1, 2)))]
    return result


def inner_point(random, d):
    return [random.between(-1, 1) for _ in range(d)]


def reduced_by_pairs(random, d, i, count):
    base = around_origin(random, d, 6 if 2 * count + 8 > MOST_HALF_SPACES else random.between(6, 8))
    pairs = pairs_through(random, inner_point(random, d), random.independent(count, d))
    return moved_in_turn(random, d, random.shuffled(base + pairs), i)


def flat(random, d, i):
    return reduced_by_pairs(random, d, i, 1)


def flat_edge(random, d, i):
    return reduced_by_pairs(random, d, i, d - 1)


def flat_point(random, d, i):
    if i % 2 == 0:
        return reduced_by_pairs(random, d, i, d)
    base = around_origin(random, d, random.between(d + 2, 9))
    vertex = random.choose(vertices_of(base, d))
    touching = opposite(sum_of([(n, o) for n, o in base if dot(n, vertex) == o]))
    return moved_in_turn(random, d, random.shuffled(base + [touching]), i)


def flat_implied(random, d, i):
    """Flat because of three or more half-spaces together, none of them opposite to another."""
    count = random.between(2, d)
    point = inner_point(random, d)
    together = [through(n, point) for n in random.independent(count, d)]
    together.append(opposite(sum_of(together)))
    return moved_in_turn(random, d, random.shuffled(around_origin(random, d, 8) + together), i)


def flat_unbounded(random, d, i):
    while True:
        count = 1 + i % (d - 1)
        others = [(random.vector(d, 9), random.between(5, 50)) for _ in range(random.between(0, 3))]
        result = pairs_through(random, inner_point(random, d), random.independent(count, d)) + others
        if not is_empty(result, d) and not is_bounded([n for n, _ in result], d):
            return moved_in_turn(random, d, random.shuffled(result), i)


def empty_parallel(random, d, i):
    n, o = through(random.vector(d, 9), inner_point(random, d))
    contradiction = [(n, o), (opposite((n, o + random.between(1, 20))))]
    return moved_in_turn(random, d, random.shuffled(around_origin(random, d, random.between(8, 12)) + contradiction), i)


def closed_by(random, d, count, gap):
    """Half-spaces with independent normals, and one against them all. They have no common point if the gap is below 0, and one
    that is as large as the gap if it is above 0 and their count d."""
    sides = [(n, random.between(-5, 20)) for n in random.independent(count, d)]
    n, o = opposite(sum_of([scaled(side, random.between(1, 3)) for side in sides]))
    return sides + [(n, o + gap)]


def empty_whole(random, d, i):
    contradiction = closed_by(random, d, random.between(2, d), -random.between(1, 30))
    base = around_origin(random, d, 8) if i % 2 else []
    return moved_in_turn(random, d, random.shuffled(base + contradiction), i)


def nearly_empty(random, d, i, distance, gap, count):
    """What `closed_by` says, far away; every second time together with a larger set around it."""
    while True:
        core = closed_by(random, d, count, gap)
        around = [(n, 50 * o) for n, o in around_origin(random, d, 8)] if i % 2 else []
        # The point may be far from the origin if the normals are nearly dependent.
        if gap < 0 or not is_empty(core + around, d):
            return moved_far(random, d, random.shuffled(core + around), distance)


def empty_slight(random, d, i):
    return nearly_empty(random, d, i, 1000 * random.between(1, 9), -1, random.between(1, d))


def empty_slight_million(random, d, i):
    return nearly_empty(random, d, i, 1000000, -1, random.between(1, d))


def tiny_far(random, d, i):
    return nearly_empty(random, d, i, 1000 * random.between(1, 9), 1, d)


def unbounded_few(random, d, i):
    return [(n, random.between(-50, 50)) for n in random.independent(1 + i % d, d)]


def unbounded_cone(random, d, i):
    """All boundaries go through its apex."""
    inward, outside = random.vector(d, 5), random.independent(d, d)
    outside += [random.vector(d, 9) for _ in range(random.between(0, 10 - d))]
    normals = [n if dot(n, inward) < 0 else tuple(-x for x in n) for n in outside if dot(n, inward)]
    return moved_in_turn(random, d, [(n, 0) for n in normals], i)


def unbounded_wedge(random, d, i):
    """Two half-spaces, and others that touch their edge or are further out."""
    sides = [(n, random.between(-20, 20)) for n in random.independent(2, d)]
    others = [sum_of([scaled(side, random.between(1, 3)) for side in sides]) for _ in range(random.between(0, 3))]
    return random.shuffled(sides + [(n, o + random.choose((0, 0, 7))) for n, o in others])


def unbounded_slab(random, d, i):
    n, o = random.vector(d, 9), random.between(-20, 20)
    sides = [(n, o), opposite((n, o - random.between(1, 30)))]
    copies = [scaled(random.choose(sides), random.between(1, 3)) for _ in range(random.between(0, 3))]
    return moved_in_turn(random, d, sides + copies, i)


def unbounded_prism(random, d, i):
    ends = 1 if d == 3 else 1 + i % 2
    base = around_origin(random, d - ends, random.between(5, 10))
    return moved_in_turn(random, d, skewed(random, d, [(n + (0,) * ends, o) for n, o in base]), i)


def unbounded_half_prism(random, d, i):
    """A prism with one end."""
    base = box(1, [-4], [random.between(1, 20)]) if d == 2 else around_origin(random, d - 1, random.between(5, 10))
    end = (*(random.between(-3, 3) for _ in range(d - 1)), random.between(1, 3)), random.between(-20, 20)
    return moved_in_turn(random, d, skewed(random, d, [((*n, 0), o) for n, o in base] + [end]), i)


def whole_space(random, d, i):
    return []


def turned_axes(random, d, half_spaces):
    order = random.shuffled(range(d))
    return [(tuple(n[k] for k in order), o) for n, o in half_spaces]


def thin(random, d, i, length):
    """A wall; or, every second time if d > 2, a rod."""
    short = 1 if d == 2 or i % 2 == 0 else d - 1
    sides = box(d, [0] * d, [1] * short + [length] * (d - short))
    return turned_axes(random, d, moved(sides, [random.between(-1000, 1000) * (i % 4 > 1) for _ in range(d)]))


def thin_1000(random, d, i):
    return thin(random, d, i, 1000)


def thin_1000000(random, d, i):
    return thin(random, d, i, 1000000)


def thin_oblique(random, d, i, length):
    """A wall that is a little oblique. Its ends are at right angles to it, or, every second time, along the axes."""
    n = (length, random.between(1, 3), *(random.between(-1, 1) for _ in range(d - 2)))
    if i % 2:
        ends = box(d, [0] * d, [length] * d)[2:]
    else:
        n = (*n[:2], *(0,) * (d - 2))
        across = (-n[1], length, *n[2:])
        ends = [(across, length * length), opposite((across, 0)), *box(d, [0] * d, [length] * d)[4:]]
    walls = [(n, length), opposite((n, 0))]
    return turned_axes(random, d, moved(walls + ends, [random.between(-1000, 1000) * (i % 4 > 1) for _ in range(d)]))


def thin_oblique_1000(random, d, i):
    return thin_oblique(random, d, i, 1000)


def thin_oblique_1000000(random, d, i):
    return thin_oblique(random, d, i, 1000000)


# How many sets of each kind there are in 2, 3 and 4 dimensions. A prism without ends is a slab in 2 dimensions.
COUNTS = {
    bounded: (9, 8, 3),
    bounded_far_1000: (5, 5, 3),
    bounded_far_1000000: (5, 5, 3),
    redundant: (6, 6, 3),
    duplicates: (6, 6, 3),
    degenerate: (5, 7, 6),
    degenerate_skewed: (5, 7, 6),
    degenerate_corner: (8, 7, 4),
    flat: (6, 5, 3),
    flat_edge: (3, 4, 2),
    flat_point: (4, 4, 2),
    flat_implied: (4, 4, 2),
    flat_unbounded: (4, 4, 2),
    empty_parallel: (4, 3, 1),
    empty_whole: (6, 5, 2),
    empty_slight: (5, 4, 2),
    empty_slight_million: (3, 3, 1),
    tiny_far: (3, 3, 1),
    unbounded_few: (4, 4, 1),
    unbounded_cone: (4, 3, 1),
    unbounded_wedge: (2, 2, 1),
    unbounded_slab: (3, 2, 1),
    unbounded_prism: (0, 3, 1),
    unbounded_half_prism: (3, 3, 1),
    whole_space: (1, 1, 1),
    thin_1000: (3, 3, 1),
    thin_1000000: (3, 3, 1),
    thin_oblique_1000: (3, 3, 1),
    thin_oblique_1000000: (3, 3, 1),
}


def check_kind(name, d, found):
    """That a set is what its kind says."""
    def must(condition):
        assert condition, (name, d, found)

    if name.startswith("empty"):
        must(found.affine_dimension == -1)
        return
    must(found.affine_dimension >= 0)
    must(found.bounded != ("unbounded" in name or name == "whole_space"))
    if not name.startswith("flat"):
        must(found.affine_dimension == d)
    elif name != "flat_unbounded":
        of = {"flat": (d - 1,), "flat_edge": (1,), "flat_point": (0,), "flat_implied": range(d - 1)}[name]
        must(found.affine_dimension in of)


def check_known_sets():
    def check(half_spaces, d, *expected):
        found = answer_of(half_spaces, d)
        assert found == answer(*expected), (found, expected)

    for d in (2, 3, 4):
        simplex = [(unit(d, k, -1), 0) for k in range(d)] + [((1,) * d, 5)]
        check(cube(d, 3), d, d, True, 2 ** d, 2 * d, 6 ** d)
        check(simplex, d, d, True, d + 1, d + 1, Fraction(5 ** d, math.factorial(d)))
        check(cross_polytope(d, 3), d, d, True, 2 * d, 2 ** d, Fraction(6 ** d, math.factorial(d)))
        check(moved(simplex, [1000000] * d) * 2, d, d, True, d + 1, d + 1, Fraction(5 ** d, math.factorial(d)))
        check([(unit(d, 0), 1), (unit(d, 0, -1), 1)], d, d, False, 0, 0, 0)
        check([(unit(d, 0), 1), (unit(d, 0, -1), -1)], d, d - 1, False, 0, 0, 0)
        check([(unit(d, 0), 1), (unit(d, 0, -1), -2)], d, -1, True, 0, 0, 0)
        check(simplex[:-1] + [((1,) * d, -1)], d, -1, True, 0, 0, 0)
        check(simplex[:-1] + [((1,) * d, 0)], d, 0, True, 1, 0, 0)
        check(simplex[:-1], d, d, False, 1, 0, 0)
        check(cube(d, 3) + [(unit(d, 0, -1), -3)], d, d - 1, True, 2 ** (d - 1), 0, 0)
        check([], d, d, False, 0, 0, 0)
    check(pyramid(cube(2, 1), 3), 3, 3, True, 5, 5, 4)
    check(prism_over(cross_polytope(3, 1), 1), 4, 4, True, 12, 10, Fraction(8, 3))
    check(cube(3, 1) + cross_polytope(3, 2), 3, 3, True, 12, 14, Fraction(20, 3))


def decimal_of(value):
    with decimal.localcontext() as context:
        context.prec = 17
        return format(decimal.Decimal(value.numerator) / decimal.Decimal(value.denominator), ".17g")


def main():
    check_known_sets()
    assert [sum(counts) for counts in zip(*COUNTS.values())] == [120, 120, 60]

    lines = ["# Made by half_space_oracle.py, which says what the numbers are"]
    for d in (2, 3, 4):
        for kind, counts in COUNTS.items():
            name = kind.__name__
            for i in range(counts[d - 2]):
                # Of the name, so that a change of one kind leaves the others alone.
                random = random_stream(int.from_bytes(f"{name} {d} {i}".encode(), "little") % (2 ** 61 - 1))
                half_spaces = kind(random, d, i)
                assert len(half_spaces) <= MOST_HALF_SPACES
                assert all(any(n) and all(isinstance(x, int) and abs(x) <= 2 ** 53 for x in (*n, o)) for n, o in half_spaces)
                found = answer_of(half_spaces, d)
                check_kind(name, d, found)
                lines.append(f"set {name} {d} {len(half_spaces)} {found.affine_dimension} {int(found.bounded)} "
                             f"{found.vertices} {found.facets} {decimal_of(found.volume)}")
                lines += [" ".join(map(str, (*n, o))) for n, o in half_spaces]

    path = pathlib.Path(__file__).with_name("half_space_sets.txt")
    path.write_text("\n".join(lines) + "\n")
    for kind, counts in COUNTS.items():
        print(f"{kind.__name__:24}" + "".join(f"{count:5}" for count in counts))
    print(f"{path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
