"""What decides the results that miss: window wall, facades and Ramsgate, with one change at a time.

    python studies/validation/switches.py

solves what is not stored yet, and writes one table into the page of each case. No change is adopted.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from facades.run import DISTORTION, FACADES, INCREMENTS, LEVEL, PROFILES, facade_settings  # noqa: E402
from judging import settings_of  # noqa: E402
from window_wall.run import BACK  # noqa: E402

from damagepred import solve  # noqa: E402
from damagepred.arrays import FloatArray  # noqa: E402
from damagepred.campaign.sample import sample_of  # noqa: E402
from damagepred.one_wall.judged_path import follow_wall  # noqa: E402
from damagepred.runtime.one_thread import one_blas_thread  # noqa: E402
from studies.pages import put_in, version  # noqa: E402

BEGIN, END = "<!-- written by switches.py -->", "<!-- end of switches -->"
SAMPLES, WALLS = 16, 4
"""Walls of the study of Ramsgate, of which the first are solved."""
Tables = dict[str, Any]


def strengths(tension: float, cohesion: float) -> Tables:
    """Other strengths of joints (Pa): those of the mean wall, and the means of the sampled ones."""
    found: Tables = {"scene__joint": {"tensile_strength": tension, "cohesion": cohesion}}
    for name, mean in (("tensile_strength", tension), ("cohesion", cohesion)):
        found[f"variables__joint.{name}"] = {"mean": mean}
    return found


HEADS = dict.fromkeys(("tensile_strength", "cohesion", "fracture_energy", "shear_fracture_energy"), 1.0)
RIGID: Tables = {"scene__solver": {"blocks": "rigid"}}
CONTINUUM = strengths(0.16e6, 0.17e6)
CONTINUUM["scene__joint"] |= {"fracture_energy": 11.3, "shear_fracture_energy": 210.0}
CONTINUUM["scene__head_joint"] = {"factor": HEADS}
JOINTS: dict[str, Tables] = {
    "none": {},
    "bricks rigid": RIGID,
    "strengths of a continuum": CONTINUUM,
    "cohesion kept after slip": {"scene__joint": {"shear_fracture_energy": "none"}},
    "cohesion lost at first slip": {"scene__joint": {"shear_fracture_energy": "none", "brittle_shear": True}},
    "head joints as strong as beds": {"scene__head_joint": {"factor": HEADS}},
    "friction of joints 0.41 for 0.82": {"scene__joint": {"friction": 0.41}},
    "bricks break at 2 MPa, 80 N/m": {"scene__block": {"tensile_strength": 2e6, "fracture_energy": 80.0}},
}
"""Changes of all cases."""


def ground(factor: float) -> Tables:
    """Facades on another stiffness of the ground."""
    return {"scene__footing__joint": {"normal_stiffness": 2.8e8 * factor, "shear_stiffness": 2.4e8 * factor}}


def window_wall(changes: Tables, wall: int) -> list[float]:
    """Largest load (kN) of the mean wall, to the right (0) or to the left (1)."""
    push = {"scene__movement": BACK} if wall else {}
    ds = solve(settings_of(HERE / "window_wall" / "wall.toml", **push, **changes).scene, on_failure="return")
    return [1e-3 * float(np.nanmax(np.abs(ds["load_force"].values)))]


def ramsgate(changes: Tables, wall: int) -> list[float]:
    """Widest crack (mm) and category of one wall of the study at the end of its path."""
    settings = settings_of(HERE / "ramsgate" / "front.toml", **changes)
    scene, fields = sample_of(settings, settings.design(), wall, SAMPLES)
    *_, (_, last) = follow_wall(scene, fields, scene.movement.increment_count)
    return [1e3 * float(last.verdict.crack_width_max), float(last.verdict.damage_category)]


def facades(changes: Tables, wall: int) -> list[float]:
    """Largest Psi of the mean wall of one facade under one profile."""
    facade, profile = FACADES[wall // len(PROFILES)], tuple(PROFILES)[wall % len(PROFILES)]
    settings = facade_settings(facade, profile, DISTORTION, INCREMENTS, **changes)
    return [float(np.nanmax(solve(settings.scene, on_failure="return")["psi"].values))]


def loads(found: FloatArray) -> list[float]:
    """To the right, to the left."""
    return list(found[:, 0])


def widths(found: FloatArray) -> list[float]:
    """Median width, and share of categories 0 and 1."""
    return [float(np.median(found[:, 0])), float((found[:, 1] <= 1).mean())]


def shares(found: FloatArray) -> list[float]:
    """Shares beyond the level of Psi: all, long and stout facades."""
    is_long = np.repeat([f.length > 2.5 * f.height for f in FACADES], len(PROFILES))
    beyond = found[:, 0] > LEVEL
    return [float(v.mean()) for v in (beyond, beyond[is_long], beyond[~is_long])]


class Case(NamedTuple):
    """A case: result of one of its walls under a change, number of walls, columns of its table, its own changes."""

    wall: Callable[[Tables, int], list[float]]
    walls: int
    summary: Callable[[FloatArray], list[float]]
    columns: tuple[str, ...]
    changes: dict[str, Tables]


CASES = {
    "window_wall": Case(
        window_wall,
        2,
        loads,
        ("load to the right, kN", "to the left, kN"),
        {
            "window 0.3 m to the left": {"scene__opening": [{"x": 0.36, "y": 0.6, "width": 0.78, "height": 1.51}]},
            "window in the middle": {"scene__opening": [{"x": 1.145, "y": 0.6, "width": 0.78, "height": 1.51}]},
            "window 0.3 m lower": {"scene__opening": [{"x": 0.66, "y": 0.3, "width": 0.78, "height": 1.51}]},
            "pressure halved": {"scene__loads": {"roof": 18.4e3}},
            "beam at its top stays level": {"scene__loading": {"beam": "level"}},
        },
    ),
    "facades": Case(
        facades,
        len(FACADES) * len(PROFILES),
        shares,
        ("all", "long", "stout"),
        {
            "ground ten times softer": ground(0.1),
            "ground ten times stiffer": ground(10.0),
            "no cohesion on the ground": {"scene__footing__joint": {"cohesion": 0.0}},
            "strengths of the joints doubled": strengths(0.18e6, 0.18e6),
        },
    ),
    "ramsgate": Case(
        ramsgate,
        WALLS,
        widths,
        ("median width, mm", "share of categories 0 and 1"),
        {
            "bricks rigid, strengths of a continuum": RIGID | CONTINUUM,
            "strengths of the joints doubled": strengths(0.18e6, 0.18e6),
            "trough below the middle": {"variables__mound.position": {"lower": 8.99, "upper": 9.01}},
            "ground four times softer": {"variables__soil.shrinking_stiffness": {"mean": 5e6}},
            "footing of 1000 MPa": {"scene__footing": {"elastic_modulus": 1e9}},
        },
    ),
}


@one_blas_thread()
def main() -> None:
    """Solve, and write the tables of what is solved."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=tuple(CASES))
    parser.add_argument("--page", action="store_true", help="write the tables from what is solved")
    asked = parser.parse_args()
    for name in (asked.only,) if asked.only else CASES:
        case, stored = CASES[name], HERE / name / "results" / "switches.json"
        stored.parent.mkdir(exist_ok=True)
        found = json.loads(stored.read_text()) if stored.exists() else {}
        lines = [f"| change | {' | '.join(case.columns)} |", "|---" * (len(case.columns) + 1) + "|"]
        for change, values in (JOINTS | case.changes).items():
            keys = [f"{change}: {wall}" for wall in range(case.walls)]
            for wall, key in enumerate(keys):
                if key not in found and not asked.page:
                    found[key] = case.wall(values, wall)
                    stored.write_text(json.dumps(found, indent=1))
                    print(name, key, found[key], flush=True)
            if all(key in found for key in keys):
                row = case.summary(np.array([found[key] for key in keys]))
                lines.append(f"| {change} | {' | '.join(f'{value:.2f}' for value in row)} |")
        text = "\n".join([*lines, "", f"All rows are of damagepred {version()}."])
        put_in(HERE / name / "README.md", text, BEGIN, END)


if __name__ == "__main__":
    main()
