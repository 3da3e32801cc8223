"""Cost of joints that soften and of bricks that may break: walls of the guide's house on class H1 clay.

    python studies/bond_after_slip/cost.py [--walls 40] [--first 0]
    python studies/bond_after_slip/cost.py --bricks

The first solves the same walls each way, one after the other, and prints processor times, their ratios and the energy
errors. The second does it with the window walls of the full-scale test, whole and with bricks of three strengths.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "studies" / "validation"))

from judging import settings_of  # noqa: E402

from damagepred import Scene  # noqa: E402
from damagepred.campaign.sample import sample_of  # noqa: E402
from damagepred.enumerations import ContactKind, ContactState  # noqa: E402
from damagepred.one_wall.judged_path import follow_wall  # noqa: E402
from damagepred.runtime.one_thread import one_blas_thread  # noqa: E402

WAYS: dict[str, dict[str, dict[str, float]]] = {
    "brittle": {},
    "softening": {"scene__joint": {"fracture_energy": 20.0, "shear_fracture_energy": 60.0}},
    "bricks that may break": {"scene__block": {"tensile_strength": 2e6, "fracture_energy": 80.0}},
}
"""Changes of the study: energies (N/m) and strength (Pa)."""
SAMPLES = 64
"""Samples of the guide's study, of which the first are solved."""
BRICKS = {"block_length": 0.24, "block_height": 0.086}
STRENGTHS = (8e6, 3e6, 1.5e6)
"""Strengths of bricks of the window walls (Pa)."""


def measured(settings: Any, sample: int) -> tuple[float, int, float]:
    """Processor time of a wall's path (s), its iterations, and its energy error over the external work."""
    scene, fields = sample_of(settings, settings.design(), sample, SAMPLES)
    begun, iterations, energy = time.process_time(), 0, None
    for _, state in follow_wall(scene, fields, scene.movement.increment_count):
        iterations += state.increment.counters.newton_iterations
        energy = state.increment.energy
        if state.verdict.damage_category >= settings.last_category:
            break
    assert energy is not None
    return time.process_time() - begun, iterations, energy.energy_error / energy.external_work


class Cost(NamedTuple):
    """Processor time (s), part of it before the path began again, iterations from then on, bricks that break."""

    seconds: float
    whole: float
    iterations: int
    broken: int


def cost_of(scene: Scene) -> Cost:
    """Cost of the path of a wall."""
    begun = time.process_time()
    now, whole, iterations, broken = 0.0, 0.0, 0, 0
    for model, step in follow_wall(scene, None, scene.movement.increment_count):
        if step.increment.number == 0:
            whole, iterations = now, 0
            middles = model.interfaces.kind == ContactKind.BRICK_JOINT
        iterations += step.increment.counters.newton_iterations
        broken = int((step.increment.state[middles] == ContactState.CRACKED).any(axis=1).sum())
        now = time.process_time() - begun
    return Cost(now, whole, iterations, broken)


def window_walls() -> Iterator[str]:
    """One line per window wall and strength of its bricks: time over the time of whole bricks, least of three runs."""
    for name in ("dishing", "doming"):
        file = Scene.from_toml(HERE.parents[1] / "data" / f"bryant_window_{name}.toml")
        for blocks in ("rigid", "elastic"):
            scene = replace(file, solver=replace(file.solver, blocks=blocks))
            plain = min(cost_of(scene) for _ in range(3))
            yield f"{name}, {blocks}: {plain.seconds:.2f} s, {plain.iterations} iterations"
            for strength in STRENGTHS:
                block = replace(scene.block, tensile_strength=strength, fracture_energy=80.0)
                cost = min(cost_of(replace(scene, block=block)) for _ in range(3))
                total, whole = cost.seconds / plain.seconds, cost.whole / plain.seconds
                yield (
                    f"  {1e-6 * strength:g} MPa: {total:.2f} of that time, {whole:.2f} of it with whole bricks before; "
                    f"then {cost.iterations} iterations; {cost.broken} bricks break"
                )


@one_blas_thread()
def main() -> None:
    """Print one line per wall, and median, 90th percentile and sum of each way."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--walls", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--bricks", action="store_true", help="window walls whose bricks may break")
    asked = parser.parse_args()
    if asked.bricks:
        for line in window_walls():
            print(line, flush=True)
        return
    ways = {
        name: settings_of(HERE / "house.toml", study__samples=SAMPLES, scene__wall=BRICKS, **change)
        for name, change in WAYS.items()
    }
    for settings in ways.values():
        measured(settings, asked.first)  # compiles
    walls = range(asked.first, asked.first + asked.walls)
    found = np.array([[measured(settings, i) for settings in ways.values()] for i in walls])
    for i, wall in zip(walls, found, strict=True):
        print(f"{i}: {'; '.join(f'{s:.2f} s, {n:.0f} iterations, error {e:.4f}' for s, n, e in wall)}")
    median, high = np.quantile(found[:, :, 0], (0.5, 0.9), axis=0)
    for k, name in enumerate(ways):
        print(
            f"{name}: median {median[k]:.2f} s, {median[k] / median[0]:.2f} of brittle; 90th percentile "
            f"{high[k]:.2f} s, {high[k] / high[0]:.2f}; all {found[:, k, 0].sum() / found[:, 0, 0].sum():.2f}; "
            f"largest energy error {found[:, k, 2].max():.4f}"
        )


if __name__ == "__main__":
    main()
