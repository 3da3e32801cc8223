"""Reference computation: every edge of every polygon against every other."""

from itertools import pairwise

import numpy as np


def polygon_area(corners: np.ndarray) -> float:
    """Area by summing triangles from the first corner."""
    return sum(
        0.5 * float((b[0] - corners[0][0]) * (c[1] - corners[0][1]) - (b[1] - corners[0][1]) * (c[0] - corners[0][0]))
        for b, c in pairwise(corners[1:])
    )


def turned(polygons: list[np.ndarray], angle: float, shift: tuple[float, float] = (0.0, 0.0)) -> list[np.ndarray]:
    c, s = np.cos(angle), np.sin(angle)
    return [p @ np.array([[c, s], [-s, c]]) + np.array(shift) for p in polygons]


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
