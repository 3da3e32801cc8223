"""Reference computation: every edge of every polygon against every other."""

from itertools import pairwise

import numpy as np


def shared_lengths(polygons: list[np.ndarray], tolerance: float) -> dict[tuple[int, int], float]:
    """Length of common edge of each pair of polygons, by looking at all pairs of edges."""
    found: dict[tuple[int, int], float] = {}
    edges = [
        (number, p, q) for number, corners in enumerate(polygons) for p, q in zip(corners, np.roll(corners, -1, axis=0))
    ]
    for i, p, q in edges:
        length = np.hypot(*(q - p))
        along = (q - p) / length
        for j, r, s in edges:
            if j <= i:
                continue
            if along @ (s - r) > -0.999 * np.hypot(*(s - r)):  # the neighbour's edge runs the other way
                continue
            off = [abs(along[0] * (t - p)[1] - along[1] * (t - p)[0]) for t in (r, s)]
            if max(off) > tolerance:
                continue
            low, high = sorted((along @ (r - p), along @ (s - p)))
            common = min(high, length) - max(low, 0.0)
            if common > tolerance:
                found[i, j] = found.get((i, j), 0.0) + common
    return found


def polygon_area(corners: np.ndarray) -> float:
    """Area by summing triangles from the first corner."""
    return sum(
        0.5 * float((b[0] - corners[0][0]) * (c[1] - corners[0][1]) - (b[1] - corners[0][1]) * (c[0] - corners[0][0]))
        for b, c in pairwise(corners[1:])
    )


def turned(polygons: list[np.ndarray], angle: float, shift: tuple[float, float] = (0.0, 0.0)) -> list[np.ndarray]:
    c, s = np.cos(angle), np.sin(angle)
    return [p @ np.array([[c, s], [-s, c]]) + np.array(shift) for p in polygons]


def random_rectangles(random: np.random.Generator, rows: int = 5) -> list[np.ndarray]:
    """Rows of rectangles of random heights, each cut at random places."""
    y = np.concatenate(([0.0], np.cumsum(random.uniform(0.05, 0.3, rows))))
    polygons = []
    for bottom, top in pairwise(y):
        x = np.concatenate(([0.0], np.sort(random.uniform(0.1, 1.9, random.integers(1, 6))), [2.0]))
        polygons += [np.array([(a, bottom), (b, bottom), (b, top), (a, top)]) for a, b in pairwise(x) if b - a > 1e-4]
    return polygons


def hexagons(rows: int = 4, columns: int = 4) -> list[np.ndarray]:
    corner = np.array([(np.cos(a), np.sin(a)) for a in np.pi / 6 + np.arange(6) * np.pi / 3])
    return [
        corner + np.array((np.sqrt(3) * (column + 0.5 * (row % 2)), 1.5 * row))
        for row in range(rows)
        for column in range(columns)
    ]


def voronoi(random: np.random.Generator, count: int = 25) -> list[np.ndarray]:
    """Voronoi cells of random points in the unit square, made finite by mirror images of the points."""
    from scipy.spatial import Voronoi

    points = random.uniform(0.02, 0.98, (count, 2))
    images = [points]
    for axis in (0, 1):
        for wall in (0.0, 1.0):
            image = points.copy()
            image[:, axis] = 2 * wall - image[:, axis]
            images.append(image)
    diagram = Voronoi(np.concatenate(images))
    cells = []
    for i in range(count):
        corners = diagram.vertices[diagram.regions[diagram.point_region[i]]]
        # scipy promises no order of the corners
        order = np.argsort(np.arctan2(*(corners - points[i]).T[::-1]))
        cells.append(corners[order])
    return cells


def triangles(random: np.random.Generator, count: int = 20) -> list[np.ndarray]:
    from scipy.spatial import Delaunay

    points = np.concatenate((random.uniform(0.05, 0.95, (count, 2)), [(0, 0), (1, 0), (1, 1), (0, 1)]))
    cells = []
    for simplex in Delaunay(points).simplices:
        corners = points[simplex]
        cells.append(corners if polygon_area(corners) > 0 else corners[::-1])
    return cells
