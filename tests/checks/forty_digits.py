"""Irradiance in flatland to forty digits, by complex numbers of mpmath and no code of ours.

Every shape is turned so that the ray runs along the real axis. All that could be an event is one:
ends, tangents, and crossings of each pair; between two of them one ray is asked.
"""

import itertools

from mpmath import arg, asin, cos, mp, mpc, mpf, pi, sin, sqrt

DIGITS = 40
SAME = mpf("1e-30")


def exact_irradiance(scene, position, n, on=-1):
    """E of the scene that the floats describe; a receiver with `on` lies on its shape."""
    with mp.workdps(DIGITS):
        return World(scene).irradiance(position, n, on)


class World:
    """The shapes of a concrete scene, with what no receiver changes."""

    def __init__(self, scene):
        self.shapes = shapes_of(scene)
        self.points = [
            (point(p), number(i))
            for p, i in zip(scene.points.position, scene.points.intensity, strict=True)
        ]
        self.sky = mpf(0) if scene.environment is None else number(scene.environment.radiance)
        with mp.workdps(DIGITS):
            pairs = itertools.combinations(self.shapes, 2)
            self.crossings = [z for a, b in pairs for z in crossings(a, b)]

    def irradiance(self, position, n, on=-1):
        """The integral, gap by gap, and the point lights."""
        with mp.workdps(DIGITS):
            here, normal = point(position), turn(number(n))
            E = self.shaped(here, normal, on)
            for place, intensity in self.points:
                way = place - here
                up = (way / normal).real
                if up > 0 and self.first(here, way / abs(way), on)[0] > abs(way) * (1 - SAME):
                    E += intensity * up / abs(way) ** 2
            return E

    def shaped(self, here, normal, on):
        angles = [-pi / 2, pi / 2]
        places = [*self.crossings]
        for shape in self.shapes:
            places += shape.ends() if shape.number != on or shape.round else []
            angles += [a for u in shape.tangents(here, on) for a in [arg(u / normal)]]
        angles += [arg((z - here) / normal) for z in places if z != here]
        angles = sorted(a for a in angles if abs(a) <= pi / 2)
        E = mpf(0)
        for a, b in itertools.pairwise(angles):
            if b - a > SAME:
                middle = (a + b) / 2
                way = normal * mpc(cos(middle), sin(middle))
                E += self.first(here, way, on)[1] * (sin(b) - sin(a))
        return E

    def first(self, here, way, on):
        """Distance and radiance of what the ray meets first."""
        met = [hit for shape in self.shapes for hit in shape.hits(here, way, on)]
        if not met:
            return mpf("inf"), self.sky
        near = min(hit[0] for hit in met)
        tied = [hit for hit in met if hit[0] <= near * (1 + SAME)]
        return max(tied, key=lambda hit: hit[2])[:2]


class Line:
    """A segment."""

    round = False

    def __init__(self, number, a, b, emission):
        self.number, self.a, self.b, self.emission = number, a, b, emission
        self.rank = max(emission) > 0, number

    def ends(self):
        return [self.a, self.b]

    def tangents(self, here, on):
        return []

    def hits(self, here, way, on):
        a, b = (self.a - here) / way, (self.b - here) / way
        if self.number == on or (a.imag > 0) == (b.imag > 0):
            return []
        x = a.real - a.imag * (b.real - a.real) / (b.imag - a.imag)
        return [(x, self.emission[0 if b.imag > a.imag else 1], self.rank)] if x > SAME else []


class Ring:
    """A circle, or an arc of one."""

    round = True

    def __init__(self, number, center, radius, emission, arc=None):
        self.number, self.center, self.radius = number, center, radius
        self.emission, self.arc = emission, arc
        self.rank = max(emission) > 0, number

    def ends(self):
        if self.arc is None:
            return []
        start, sweep = self.arc
        return [self.center + self.radius * turn(a) for a in (start, start + sweep)]

    def tangents(self, here, on):
        w = self.center - here
        if self.number == on:
            return [w * mpc(0, 1), w * mpc(0, -1)]
        if abs(w) <= self.radius:
            return []
        half = asin(self.radius / abs(w))
        return [w * mpc(cos(half), side * sin(half)) for side in (1, -1)]

    def holds(self, z):
        """Whether the direction of a point from the centre is on the arc."""
        if self.arc is None:
            return True
        start, sweep = self.arc
        turned = (arg(z / turn(start)) * (1 if sweep > 0 else -1)) % (2 * pi)
        return turned <= abs(sweep)

    def hits(self, here, way, on):
        w = (self.center - here) / way
        if self.number == on:
            roots = [(2 * w.real, False)]
        elif abs(w.imag) >= self.radius:
            roots = []
        else:
            half = sqrt(self.radius**2 - w.imag**2)
            roots = [(w.real - half, True), (w.real + half, False)]
        inward = self.arc is not None and self.arc[1] > 0
        return [
            (x, self.emission[0 if into != inward else 1], self.rank)
            for x, into in roots
            if x > SAME and self.holds((x - w) * way)
        ]


def number(x):
    return mpf(float(x))


def point(p):
    return mpc(float(p[0]), float(p[1]))


def turn(angle):
    """The direction of an angle, counter-clockwise from +y."""
    return mpc(-sin(angle), cos(angle))


def shapes_of(scene):
    found = []
    for group in scene.groups:
        for row in range(group.count):
            k = len(found)
            emission = [number(L) for L in scene.material.emission[k]]
            if hasattr(group, "end"):
                found.append(Line(k, point(group.start[row]), point(group.end[row]), emission))
            else:
                center, radius = point(group.center[row]), number(group.radius[row])
                arc = None
                if hasattr(group, "sweep"):
                    arc = number(group.start[row]), number(group.sweep[row])
                found.append(Ring(k, center, radius, emission, arc))
    return found


def crossings(a, b):
    """Points of two lines, of a line and a circle, or of two circles; also beyond arcs' ends."""
    if a.round and not b.round:
        a, b = b, a
    if not b.round:
        return of_lines(a, b)
    if not a.round:
        way = (a.b - a.a) / abs(a.b - a.a)
        w = (b.center - a.a) / way
        if abs(w.imag) > b.radius:
            return []
        half = sqrt(b.radius**2 - w.imag**2)
        return [a.a + x * way for x in (w.real - half, w.real + half) if 0 <= x <= abs(a.b - a.a)]
    apart = b.center - a.center
    far = abs(apart)
    if far == 0 or far > a.radius + b.radius or far < abs(a.radius - b.radius):
        return []
    x = (far**2 + a.radius**2 - b.radius**2) / (2 * far)
    y = sqrt(max(a.radius**2 - x**2, mpf(0)))
    return [a.center + apart / far * mpc(x, side * y) for side in (1, -1)]


def of_lines(a, b):
    way = a.b - a.a
    p, q = (b.a - a.a) / way, (b.b - a.a) / way
    if p.imag * q.imag >= 0:
        return []
    s = p.real - p.imag * (q.real - p.real) / (q.imag - p.imag)
    return [a.a + s * way] if 0 <= s <= 1 else []
