"""Beams on springs without the package: finite elements with no-tension springs, and the exact Timoshenko beam."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from damagepred.arrays import FloatArray


class Resting(NamedTuple):
    x: FloatArray
    level: FloatArray
    pressure: FloatArray
    moment: FloatArray


def element(h: float, bending: float, shear: float) -> FloatArray:
    """Return the stiffness (4, 4) of a piece of Timoshenko beam for w, slope w, slope (Przemieniecki 1968, 5.6)."""
    phi = 12 * bending / (shear * h**2)
    return (
        bending
        / (h**3 * (1 + phi))
        * np.array(
            [
                [12, 6 * h, -12, 6 * h],
                [6 * h, (4 + phi) * h**2, -6 * h, (2 - phi) * h**2],
                [-12, -6 * h, 12, -6 * h],
                [6 * h, (2 - phi) * h**2, -6 * h, (4 + phi) * h**2],
            ]
        )
    )


def on_springs(
    length: float,
    bending: float,
    shear: float,
    spring: float,
    load: float,
    ground: Callable[[FloatArray], FloatArray],
    pieces: int = 600,
) -> Resting:
    """Rest a beam with free ends on springs that do not pull."""
    h = length / pieces
    x = h * np.arange(pieces + 1)
    share = np.full(pieces + 1, h)
    share[[0, -1]] = h / 2
    size = 2 * (pieces + 1)
    ke = element(h, bending, shear)
    band = np.zeros((4, size))  # lower band of the beam's stiffness
    force = np.zeros(size)
    for i in range(pieces):
        for a in range(4):
            force[2 * i + a] -= load * (h / 2, h**2 / 12, h / 2, -(h**2) / 12)[a]
            for b in range(a + 1):
                band[a - b, 2 * i + b] += ke[a, b]
    surface, pressed = ground(x), np.ones(pieces + 1, dtype=bool)
    for _ in range(200):
        springs = np.where(pressed, spring * share, 0.0)
        matrix = band.copy()
        matrix[0, ::2] += springs
        right = force.copy()
        right[::2] += springs * surface
        moved = solveh_banded(matrix, right, lower=True)
        gap = moved[::2] - surface
        again = gap < 0
        if (again == pressed).all():
            break
        # one that is loaded on one half only would roll away: springs come off slowly where few are left
        pressed = again if again.sum() > 2 else pressed & (gap < np.median(gap[pressed]))
    else:
        raise AssertionError("springs go on and off for ever")
    forces = np.stack([ke @ moved[2 * i : 2 * i + 4] for i in range(pieces)])
    fixed_end = load * h**2 / 12
    moment = np.append(-forces[:, 1] - fixed_end, forces[-1, 3] - fixed_end)
    return Resting(x, moved[::2], np.where(pressed, -spring * gap, 0.0), moment)


def timoshenko_on_bed(
    x: FloatArray, length: float, bending: float, shear: float, spring: float, at: float, force: float
) -> FloatArray:
    """Return how far a beam with free ends on springs (N/m2) goes down (m) under a force (N) at a place (m).

    Solves E I w'''' - (E I k / kappa G A) w'' + k w = 0 left and right of the force, with free ends, and w, slope of
    the section and moment continuous under it.
    """
    roots = np.roots([bending, 0.0, -bending * spring / shear, 0.0, spring]).astype(complex)
    # kGA (w'' - psi') = k w and E I psi'' + kGA (w' - psi) = 0: for exp(r x), psi = (r - k / (kGA r)) w
    turn = roots - spring / (shear * roots)
    end = np.where(roots.real > 0, length, 0.0)  # each grows towards 1

    def rows(place: float) -> dict[str, NDArray[np.complex128]]:
        wave = np.exp(roots * (place - end))
        return {
            "w": wave,
            "psi": turn * wave,
            "moment": bending * turn * roots * wave,
            "shear": shear * (roots - turn) * wave,
        }

    first, last, here, none = rows(0.0), rows(length), rows(at), np.zeros(4)
    matrix = [np.append(first["moment"], none), np.append(first["shear"], none)]
    matrix += [np.append(none, last["moment"]), np.append(none, last["shear"])]
    matrix += [np.append(here[name], -here[name]) for name in ("w", "psi", "moment", "shear")]
    right = np.zeros(8)
    right[7] = force
    scale = np.abs(matrix).max(axis=1)
    factors = np.linalg.solve(np.array(matrix) / scale[:, None], right / scale)
    left = (np.exp(roots * (x[:, None] - end)) @ factors[:4]).real
    beyond = (np.exp(roots * (x[:, None] - end)) @ factors[4:]).real
    return np.where(x <= at, left, beyond)
