"""Joints that keep their cohesion, lose it at first slip, or soften: the paper's walls, a house, validation cases.

    python studies/bond_after_slip/run.py [--evidence] [--walls 40]

solves what is not stored yet, in one process, and writes the table of the README; ``--evidence`` writes the table of
``data/README.md``.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from damagepred import Scene, Study, exceedance, open_study, solve
from damagepred.inputs.data_files import data_file

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
VALIDATION = ROOT / "studies" / "validation"
sys.path[:0] = [str(VALIDATION)]

from facades.run import FACADES, LEVEL, facade_settings  # noqa: E402
from judging import settings_of  # noqa: E402

from studies.pages import put_in  # noqa: E402

ENERGY, RATIO = 10.0, 10.0
"""Fracture energy of mode I (N/m) where a case has none, and that of mode II over it (data/README.md)."""
DUTCH = "clay brick, Dutch, 1940s"
OTHER_SET = {
    DUTCH: {f"{DUTCH}, joints": "joints of the micro-model"},
    f"{DUTCH}, joints": {DUTCH: "strengths of a continuum"},
}
PROFILE = "one side from 1/2"
ENDINGS = ("kept", "lost at first slip", "softening")
LINES = {
    "cohesion over direct tensile strength of beds": ("cohesion_over_tensile_strength", "bed"),
    "shear bond over flexural bond": ("shear_over_flexural_bond", "bed"),
    "cohesion left after slip, MPa": ("residual_cohesion", "bed"),
    "friction of beds at the peak": ("friction", "bed"),
    "friction left after slip": ("residual_friction", "bed"),
    "fracture energy of mode I, beds, N/m": ("fracture_energy", "bed"),
    "fracture energy of mode II, beds, N/m": ("shear_fracture_energy", "bed"),
    "slip over which cohesion is lost, mm": ("slip_to_lose_cohesion", None),
    "strength of head joints over beds": ("head_over_bed_strength", "head"),
    "tensile strength of bricks, MPa": ("tensile_strength", "brick"),
    "fracture energy of bricks, N/m": ("fracture_energy", "brick"),
}


def evidence() -> str:
    """Table of the ranges of the measured and published values."""
    known = pd.read_csv(data_file("statistics", "joints_after_slip.csv"))
    lines = ["| quantity | range | values | of these reported or secondary |", "|---|---|---|---|"]
    for name, (quantity, joint) in LINES.items():
        rows = known[(known.quantity == quantity) & ((known.joint == joint) | (joint is None))]
        values = rows[["value", "lower", "upper"]].to_numpy()
        low, high = np.nanmin(values), np.nanmax(values)
        sure = rows.confidence.isin(["reported", "secondary"]).sum()
        lines.append(f"| {name} | {low:g}{'' if low == high else f' to {high:g}'} | {len(rows)} | {sure} |")
    return "\n".join(lines)


def ending(name: str, joint: dict[str, Any]) -> dict[str, Any]:
    """Values of ``[joint]`` for an ending, with the fracture energy of mode I that the case has."""
    energy = joint.get("fracture_energy")
    bond = {"brittle_shear": name == "lost at first slip", "shear_fracture_energy": "none"}
    if name == "softening":
        bond |= {"fracture_energy": energy or ENERGY, "shear_fracture_energy": RATIO * (energy or ENERGY)}
    return bond


def processor_seconds() -> float:
    """Processor time of this process and those that it has started (s)."""
    return sum(getrusage(who).ru_utime + getrusage(who).ru_stime for who in (RUSAGE_SELF, RUSAGE_CHILDREN))


def of_wall(ds: xr.Dataset) -> str:
    """End of a path (mm), and category, widest joint and crack band there."""
    end = 1e3 * float(ds["central_deflection"][-1])
    width, band = (1e3 * float(ds[name][-1]) for name in ("crack_width_max", "crack_band_width_max"))
    return f"{end:g} mm: category {int(ds['damage_category'][-1])}, {width:.2f} mm, band {band:.2f} mm"


def largest_load(ds: xr.Dataset) -> str:
    """Largest load of a test."""
    return f"{1e-3 * float(ds['load_force'].max()):.1f} kN"


def psi_at(ds: xr.Dataset) -> str:
    """Damage Psi of the shear wall at both drifts."""
    psi = ds["psi"].values
    return ", ".join(f"{np.interp(drift * 2.69, ds['load_displacement'], psi):.2f}" for drift in (0.41e-3, 0.68e-3))


CASES: dict[str, tuple[Path, str, Callable[[xr.Dataset], str]]] = {
    **{
        f"Bryant, {name.replace('_', ' ')}": (ROOT / "data" / f"bryant_{name}.toml", seen, of_wall)
        for name, seen in {
            "dishing": "no crack above the dpc",
            "doming": "no crack above the dpc",
            "window_dishing": "",
            "window_doming": "",
            "window_dishing_40mm": "",
        }.items()
    },
    "shear panel J4D, largest load": (VALIDATION / "shear_panel" / "j4d.toml", "50 kN", largest_load),
    "clay spandrel, largest load": (VALIDATION / "spandrels" / "panel.toml", "21.3 kN", largest_load),
    "shear wall, Psi at two drifts": (VALIDATION / "shear_wall" / "wall.toml", "1.7, 2.6", psi_at),
    "window wall, largest load": (VALIDATION / "window_wall" / "wall.toml", "15 kN", largest_load),
}


def distortion_at(ds: xr.Dataset) -> str:
    """Angular distortion at which Psi of a facade passes the level, with the kink in the middle."""
    distortion = 4.0 * ds["deflection_ratio"].values
    reached = np.interp(LEVEL, np.maximum.accumulate(ds["psi"].values), distortion, right=np.inf)
    return f"1/{1 / reached:.0f}" if np.isfinite(reached) else f"not by 1/{1 / distortion[-1]:.0f}"


def cases() -> Iterator[tuple[str, str, Callable[[xr.Dataset], str], dict[str, Any]]]:
    """Names, observations, measures and tables of the mean walls; of the Dutch masonry with both sets of strengths."""
    known: list[tuple[str, str, Callable[[xr.Dataset], str], dict[str, Any]]] = []
    for name, (path, seen, measure) in CASES.items():
        read = Scene.from_toml if path.parent.name == "data" else settings_of
        known.append((name, seen, measure, read(path).to_dict()))
    for facade in (FACADES[0], FACADES[2], FACADES[5]):
        tables = facade_settings(facade, PROFILE, 0.01, 20).to_dict()
        known.append((f"facade {facade.name}, {PROFILE}: Psi {LEVEL} at", "", distortion_at, tables))
    for name, seen, measure, found in known:
        tables = found.get("scene", found)
        yield name, seen, measure, tables
        for material, text in OTHER_SET.get(tables.get("material", ""), {}).items():
            own = {key: value for key, value in tables.items() if key not in ("block", "joint", "head_joint")}
            yield f"{name}, {text}", seen, measure, Scene.from_dict(own | {"material": material}).to_dict()


def walls(results: Path) -> Iterator[tuple[str, str, list[str], list[float]]]:
    """Rows of the mean walls of elastic bricks: name, what was seen, results and processor seconds of each ending."""
    stored = json.loads(results.read_text()) if results.exists() else {}
    for name, seen, measure, tables in cases():
        row, cost = [], []
        for how in ENDINGS:
            if (key := f"{name}: {how}") not in stored:
                begun = processor_seconds()
                joint, solver = tables["joint"], tables["solver"] | {"blocks": "elastic"}
                scene = Scene.from_dict(tables | {"joint": joint | ending(how, joint), "solver": solver})
                text = measure(solve(scene))
                stored[key] = [text, processor_seconds() - begun]
                print(key, *stored[key], flush=True)
                results.write_text(json.dumps(stored, indent=1))
            row.append(stored[key][0])
            cost.append(stored[key][1])
        yield name, seen, row, cost


def house(folder: Path, count: int) -> tuple[list[str], list[float]]:
    """Probability of category 2 or worse of the guide's house on class H1 clay, and seconds, of each ending."""
    row, cost, stored = [], [], folder / "house.json"
    seconds = json.loads(stored.read_text()) if stored.exists() else {}
    for how in ENDINGS:
        begun = processor_seconds()
        settings = settings_of(HERE / "house.toml", scene__joint=ending(how, {}))
        place = folder / f"house_{how.replace(' ', '_')}.dp"
        Study(settings).run(place, samples=count, workers=1, timeout=120.0)
        ds = open_study(place)
        found = exceedance(ds, 2, "60 mm").estimate
        width = 1e3 * float(np.nanmedian(ds["crack_width_max"].max("increment")))
        failed = int((ds["status"] != 0).sum())
        row.append(f"{found.value:.2f} ({found.lower:.2f} to {found.upper:.2f}), {width:.2f} mm, {failed} failed")
        cost.append(seconds.setdefault(f"{how}, {count}", processor_seconds() - begun))  # of the first run
    stored.write_text(json.dumps(seconds))
    return row, cost


def main() -> None:
    """Write one of the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--evidence", action="store_true")
    parser.add_argument("--walls", type=int, default=40)
    asked = parser.parse_args()
    if asked.evidence:
        put_in(ROOT / "data" / "README.md", evidence())
        return
    folder = HERE / "results"
    folder.mkdir(exist_ok=True)
    lines = [f"| wall | seen | {' | '.join(ENDINGS)} | seconds |", "|---|---|---|---|---|---|"]
    rows = list(walls(folder / "walls.json"))
    if asked.walls:
        rows.append((f"house on H1, {asked.walls} walls: P(category 2), median width", "", *house(folder, asked.walls)))
    for name, seen, results, cost in rows:
        lines.append(f"| {name} | {seen} | {' | '.join(results)} | {', '.join(f'{s:.0f}' for s in cost)} |")
    put_in(HERE / "README.md", "\n".join(lines))
    print("\n".join(lines))


if __name__ == "__main__":
    main()
