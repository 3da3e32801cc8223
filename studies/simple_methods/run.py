"""Simple methods against the model of bricks and joints, wall by wall.

    python studies/simple_methods/run.py [--quick] [--output FOLDER] [--at-most 20]

Solves every wall of settings.toml, writes its path into results/paths.csv, and resumes an earlier call; --at-most
limits the number of walls. When all are solved it writes agreement.csv, capacities.csv and the pictures.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from compare import WALL, agreement, capacities, cracked, summary
from picture import draw_diagram
from walls import Case, cases, read_settings, scene_of

from damagepred import Scene, solve
from damagepred.archive.files import write_whole
from damagepred.damage import load_table
from damagepred.enumerations import ContactKind
from damagepred.errors import SolverError
from damagepred.one_wall.judged_path import Step
from damagepred.plotting.sheet import DPI
from damagepred.results.simple_assessment import simple_category
from studies.pages import put_in

HERE = Path(__file__).resolve().parent


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a few small walls")
    parser.add_argument("--output", type=Path, default=HERE, help="folder for paths, tables and picture")
    parser.add_argument("--at-most", type=int, default=10**9, help="walls to solve in this call")
    options = parser.parse_args()
    settings = read_settings(options.quick)
    store = options.output / "results" / "paths.csv"
    paths = pd.read_csv(store) if store.is_file() else pd.DataFrame(columns=list(Case._fields))
    done = set(paths[list(Case._fields)].itertuples(index=False, name=None))
    missing = [case for case in cases(settings) if tuple(case) not in done]
    store.parent.mkdir(parents=True, exist_ok=True)
    for case in missing[: options.at_most]:
        start = time.process_time()
        path = path_of(case, settings)
        paths = path if paths.empty else pd.concat([paths, path], ignore_index=True)
        save(paths, store)
        print(f"{scene_of(case, settings).title}: {time.process_time() - start:.1f} s", flush=True)
    if len(missing) > options.at_most:
        print(f"{len(missing) - options.at_most} walls remain; the same command resumes")
        return 0
    return 3 * report(paths, options.output)


def path_of(case: Case, settings: dict[str, Any]) -> pd.DataFrame:
    """Return the result of each method for a wall at each increment."""
    scene = scene_of(case, settings)
    wall = solve(scene, store_zones=False, on_failure="return", on_step=limited(settings["processor_seconds"]))
    failed = wall.attrs["status"] == "failed"
    if failed:
        print(
            f"{scene.title}: not followed beyond increment {wall.sizes['increment'] - 1}, the model FAILED: "
            f"{wall.attrs['status_message']}",
            flush=True,
        )
    count = settings["increments"] + 1
    ratio = np.linspace(0.0, 1.0, count) / settings["largest_one_in"]
    perpends = (wall["contact_kind"].values == ContactKind.HEAD_JOINT) & (wall["contact_y"].values > above_dpc(scene))
    parted = wall["contact_opening"].values[:, perpends] * (wall["contact_state"].values[:, perpends] == 1)
    beam = simple_category(scene, ratio)
    rows: dict[str, Any] = {
        **case._asdict(),
        "deflection_ratio": ratio,
        "category": held_on(wall["damage_category"].values, count, -1 if failed else None),
        "crack_width": held_on(wall["crack_width_max"].values, count, np.nan if failed else None),
        "perpend_width": held_on(parted.max(axis=1, initial=0.0), count, np.nan if failed else None),
        "dpc_opening": held_on(wall["dpc_opening_max"].values, count, np.nan if failed else None),
        "beam_strain": np.maximum(beam.bending_strain, beam.diagonal_strain),
        "beam_category": beam.category,
    }
    rows["perpend_category"] = np.where(rows["category"] < 0, -1, load_table("as2870").by_width(rows["perpend_width"]))
    return pd.DataFrame(rows)


def above_dpc(scene: Scene) -> float:
    """Return the height (m) above which a wall is judged."""
    return -np.inf if scene.dpc is None else (scene.dpc.course + 0.1) * scene.wall.block_height


def limited(seconds: float) -> Callable[[Step], None]:
    """End a path that takes more processor time, after the increment; it then counts as failed."""
    end = time.process_time() + seconds

    def check(step: Step) -> None:
        if time.process_time() > end:
            raise SolverError(f"took more than {seconds:g} s of processor time")

    return check


def held_on(values: np.ndarray, count: int, beyond: float | None = None) -> np.ndarray:
    """Return a path at ``count`` increments; a collapsed wall stays in its last state, unless otherwise requested."""
    last = values[-1:] if beyond is None else np.array([beyond], dtype=values.dtype)
    return np.concatenate((values, np.repeat(last, count - len(values))))


def report(paths: pd.DataFrame, output: Path) -> bool:
    """Write tables and pictures; return whether any wall failed."""
    levels = agreement(paths)
    reached = capacities(paths)
    save(levels, output / "agreement.csv")
    save(reached, output / "capacities.csv")
    write_whole(output / "diagram.png", lambda p: draw_diagram(reached).savefig(p, dpi=DPI, format="png"))
    tables = "\n".join([*cracked(reached), "", *summary(levels)])
    print(tables)
    if output == HERE:
        put_in(HERE / "README.md", tables)
    failed = len(paths[paths["category"] < 0].groupby(WALL))
    if failed:
        print(f"{failed} walls were not followed to the end; from there on they are left out")
    return failed > 0


def save(frame: pd.DataFrame, path: Path) -> None:
    """Write a table as CSV."""
    write_whole(path, lambda p: frame.to_csv(p, index=False, float_format="%.6g"))


if __name__ == "__main__":
    sys.exit(main())
