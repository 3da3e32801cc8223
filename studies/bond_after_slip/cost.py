"""Cost of joints that soften and of bricks that may break: walls of the guide's house on class H1 clay.

    python studies/bond_after_slip/cost.py [--walls 40] [--first 0]

solves the same walls each way, one after the other, and prints processor times, their ratios and the energy errors.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "studies" / "validation"))

from judging import settings_of  # noqa: E402

from damagepred.campaign.sample import sample_of  # noqa: E402
from damagepred.one_wall.judged_path import follow, model_of  # noqa: E402
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


def measured(settings: Any, sample: int) -> tuple[float, int, float]:
    """Processor time of a wall's path (s), its iterations, and its energy error over the external work."""
    scene, fields = sample_of(settings, settings.design(), sample, SAMPLES)
    begun, iterations, energy = time.process_time(), 0, None
    for state in follow(model_of(scene, fields), scene.solver, scene.damage, scene.movement.increment_count):
        iterations += state.increment.counters.newton_iterations
        energy = state.increment.energy
        if state.verdict.damage_category >= settings.last_category:
            break
    assert energy is not None
    return time.process_time() - begun, iterations, energy.energy_error / energy.external_work


@one_blas_thread()
def main() -> None:
    """Print one line per wall, and median, 90th percentile and sum of each way."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--walls", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    asked = parser.parse_args()
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
