"""Time and memory to judge a million walls again and to fit fragility curves to them.

Walls are synthetic: cracks grow in proportion to the movement, at a rate that is lognormal from wall to wall, so that
capacities are lognormal with known medians. The study is judged again by BRE Digest 251, and curves are fitted to it.
"""

from __future__ import annotations

import argparse
import resource
import time

import numpy as np
import xarray as xr

from damagepred import fit_fragility, judge_again

INCREMENTS, MOVEMENT, RATE, SCATTER = 20, 0.02, 0.3, 0.6
GROUPS = [2, 3, 4, 5]
"""Cracks in a group whose width the archive stores."""


def archive(walls: int, own_movement: bool, seed: int = 1) -> xr.Dataset:
    """Return a study of a number of walls.

    Parameters
    ----------
    walls : int
        Number of walls.
    own_movement : bool
        Whether each wall has a random final movement, or all the same.
    seed : int
        Seed of the random values.
    """
    random = np.random.default_rng(seed)
    end = random.uniform(0.75, 1.25, walls) if own_movement else np.ones(walls)
    movement = (MOVEMENT * end)[:, None] * np.linspace(0.0, 1.0, INCREMENTS + 1)
    width = movement * (RATE * np.exp(SCATTER * random.standard_normal(walls)))[:, None]
    category = np.zeros(width.shape, dtype=np.int8)
    for limit in (0.1e-3, 1e-3, 5e-3, 15e-3):
        category += width >= limit
    both = ("sample", "increment")
    names = "negligible very_slight slight moderate severe"
    group = np.repeat(0.2 * width[..., None], len(GROUPS), axis=2)
    return xr.Dataset(
        {
            "damage_category": (both, category, {"flag_meanings": names}),
            "crack_width_max": (both, width, {"units": "m"}),
            "crack_group_width": ((*both, "group_count"), group, {"units": "m"}),
            "group_count": ("group_count", GROUPS),
            "status": ("sample", np.zeros(walls, dtype=np.int8)),
            "central_deflection": (both, movement, {"units": "m"}),
        },
        attrs={"title": f"{walls} walls made up", "highest_category": 4},
    )


def measure(walls: int, own_movement: bool, model: str) -> dict[str, float]:
    """Return the seconds of judging and fitting, and the largest memory (GiB), the study included.

    Parameters
    ----------
    walls, own_movement
        See ``archive``.
    model : {"separate", "common", "empirical"}
        See ``damagepred.fit_fragility``.
    """
    ds = archive(walls, own_movement)
    began = time.perf_counter()
    judged = judge_again(ds, table="bre251")
    then = time.perf_counter()
    del ds
    curves = fit_fragility(judged, model=model, categories=[1, 2, 3, 4], bootstrap=200)
    ended = time.perf_counter()
    known = np.array([0.1e-3, 1e-3, 5e-3, 15e-3]) / RATE
    fitted = curves["fit_status"].values == "fitted"
    error = np.abs(np.log(curves["median"].values / known))[fitted]
    return {
        "judged": then - began,
        "fitted": ended - then,
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
        "error": float(error.max(initial=0.0)),
    }


def main() -> None:
    """Print it for shared increments or each wall's own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-n", "--walls", type=int, default=1_000_000)
    parser.add_argument("--own-movement", action="store_true", help="each wall has a random final movement")
    parser.add_argument("--model", default="separate", choices=("separate", "common", "empirical"))
    options = parser.parse_args()
    found = measure(options.walls, options.own_movement, options.model)
    print(
        f"{options.walls} walls, {'own' if options.own_movement else 'shared'} increments, {options.model}: judged "
        f"again in {found['judged']:.1f} s, curves with bands in {found['fitted']:.1f} s, {found['memory']:.2f} GiB at "
        f"most; medians within {found['error']:.1%}"
    )


if __name__ == "__main__":
    main()
