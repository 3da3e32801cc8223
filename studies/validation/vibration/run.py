"""Free vibration of four bricks: which arrangements have the frequencies that another code reports.

    python studies/validation/vibration/run.py

takes seconds. The arrangement is not reported, so it is searched for; what fits is no prediction.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from judging import case_main  # noqa: E402

from damagepred import Assembly, BlockMaterial, Joint, Solver  # noqa: E402
from damagepred.arrays import FloatArray  # noqa: E402
from damagepred.assembly.assembly import rectangle  # noqa: E402
from damagepred.solvers.system.discrete_system import DiscreteSystem  # noqa: E402

SIDES = (0.250, 0.120, 0.055)
"""Of a brick (m)."""
GAP, MODULUS, POISSON, DENSITY = 0.010, 1e9, 0.2, 1800.0
"""Joint (m), E (Pa), nu and density (kg/m3)."""
REPORTED = (2496.0, 9172.0)
"""Of mode 4, the first that is no rigid motion, and of mode 12 (Hz, reported)."""
USABLE = 0.06
"""Relative error up to which the figures are usable (reported)."""

ARRANGEMENTS: dict[str, list[tuple[float, int]]] = {
    "stack": [(0, 0), (0, 1), (0, 2), (0, 3)],
    "row": [(0, 0), (1, 0), (2, 0), (3, 0)],
    "two by two": [(0, 0), (1, 0), (0, 1), (1, 1)],
    "two on two, half bond": [(0, 0), (1, 0), (0.5, 1), (1.5, 1)],
    "one, two, one, half bond": [(0.5, 0), (0, 1), (1, 1), (0.5, 2)],
    "one on three, in the middle": [(0, 0), (1, 0), (2, 0), (1, 1)],
    "one on three, half bond": [(0, 0), (1, 0), (2, 0), (0.5, 1)],
    "zigzag, half bond": [(0, 0), (0.5, 1), (0, 2), (0.5, 3)],
    "stair, half bond": [(0, 0), (0.5, 1), (1, 2), (1.5, 3)],
}
"""Places of the four bricks: along, in lengths of a brick, and course."""

STIFFNESSES = {
    "unconfined mortar, E/t": MODULUS / GAP,
    "plane strain, E/(1 - nu^2)/t": MODULUS / (1.0 - POISSON**2) / GAP,
    "confined mortar, M/t": MODULUS * (1.0 - POISSON) / (1.0 + POISSON) / (1.0 - 2.0 * POISSON) / GAP,
}
"""Normal stiffness of the joints (Pa/m); the shear stiffness is G/t in all."""


class Found(NamedTuple):
    """Frequencies of one arrangement (Hz)."""

    face: str
    arrangement: str
    stiffness: str
    frequencies: FloatArray

    @property
    def errors(self) -> FloatArray:
        """Relative errors of the lowest and the highest."""
        return self.frequencies[[0, -1]] / np.array(REPORTED) - 1.0


def frequencies(
    along: float, up: float, places: list[tuple[float, int]], stiffness: float, soft: bool = False
) -> FloatArray:
    """Return the frequencies (Hz) of four bricks in elastic joints, without the three rigid motions.

    The bricks are rigid, or ``soft``: their elasticity, of the same modulus, is lumped into the joints.

    As in walls of a scene, blocks reach to the middle of the joints; they weigh what the bricks weigh.
    """
    deep = next(side for side in SIDES if side not in (along, up))
    has_heads = len({course for _, course in places}) < len(places)
    length, height = along + GAP * has_heads, up + GAP * (len({course for _, course in places}) > 1)
    joint = Joint(
        normal_stiffness=stiffness,
        shear_stiffness=MODULUS / (2.0 * (1.0 + POISSON)) / GAP,
        tensile_strength=1e12,
        cohesion=1e12,
    )
    brick = BlockMaterial(
        elastic_modulus=MODULUS, poisson_ratio=POISSON, density=DENSITY * along * up / (length * height)
    )
    assembly = Assembly(thickness=deep, gravity=(0.0, 0.0), joint=joint, block=brick)
    for x, course in places:
        assembly.add_block(rectangle(x * length, course * height, (x + 1) * length, (course + 1) * height))
    model = assembly.build(Solver(blocks="rigid", lump_block_elasticity=soft))
    free = slice(3 * len(places))  # the ground comes after the bricks
    stiff = DiscreteSystem.of(model).elastic_stiffness.toarray()[free, free]
    mass = np.repeat(model.mass, 3)
    mass[2::3] *= model.blocks.polar / model.blocks.area
    squares = eigh(stiff, np.diag(mass), eigvals_only=True)
    return np.sqrt(np.maximum(squares[3:], 0.0)) / (2.0 * np.pi)


def searched() -> Iterator[Found]:
    """Yield all arrangements, seen from all sides of a brick."""
    for along, up in itertools.permutations(SIDES, 2):
        for (name, places), (law, stiffness) in itertools.product(ARRANGEMENTS.items(), STIFFNESSES.items()):
            yield Found(f"{1e3 * along:g} x {1e3 * up:g}", name, law, frequencies(along, up, places, stiffness))


def run(folder: Path, samples: int, workers: int) -> tuple[list[dict[str, Any]], str]:
    """Search; return no rows, and the table of what fits and what comes nearest otherwise."""
    found = sorted(searched(), key=lambda one: float(np.abs(one.errors).max()))
    fits = [one for one in found if np.abs(one.errors).max() <= USABLE]
    nearest = {one.arrangement: one for one in reversed(found)}
    lines = ["| arrangement | face, mm | joints | modes 4 to 12, Hz | errors, % |", "|---|---|---|---|---|"]
    shown = fits + [one for one in nearest.values() if one not in fits]
    for one in sorted(shown, key=lambda one: float(np.abs(one.errors).max())):
        modes = ", ".join(f"{value:.0f}" for value in one.frequencies)
        errors = ", ".join(f"{100 * error:+.1f}" for error in one.errors)
        lines.append(f"| {one.arrangement} | {one.face} | {one.stiffness} | {modes} | {errors} |")
    lines += ["", f"{len(fits)} of {len(found)} fit both ends within {100 * USABLE:.0f} %."]
    soft = [
        np.abs(frequencies(along, up, places, MODULUS / GAP, soft=True)[[0, -1]] / np.array(REPORTED) - 1.0).max()
        for along, up in itertools.permutations(SIDES, 2)
        for places in ARRANGEMENTS.values()
    ]
    lines.append(f"With bricks as soft as the mortar none does: the nearest is off by {100 * min(soft):.0f} %.")
    return [], "\n".join(lines)


if __name__ == "__main__":
    case_main(HERE, 1, run)
