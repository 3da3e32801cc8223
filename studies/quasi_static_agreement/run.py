"""Compare the quasi-static solver with the explicit solver at slow movement and small tolerance.

    python studies/quasi_static_agreement/run.py [--brittle 32] [--limit 600] [--quick] [--from-data]

Each wall is solved by each solver in a process of its own; ``data.csv`` has one row for each, and the same command
resumes. The page and its picture follow from the data alone (``--from-data``). ``--quick``: a few small walls.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy import stats

from damagepred.arrays import FloatArray
from damagepred.enumerations import ContactKind, ContactState
from damagepred.errors import SolverError
from damagepred.one_wall.judged_path import Step, follow
from damagepred.scene import Solver
from studies import cases
from studies.pages import markdown, put_in
from studies.quasi_static_agreement.walls import Case, brittle_case, steady_cases

HERE = Path(__file__).resolve().parent
KEY = ("wall", "solver")
# the explicit solver skips no computation
FAST = Solver(method="explicit", symmetric_half=False, ramp_cycles=3000)
SLOW = replace(FAST, tolerance=1e-4, ramp_cycles=10_000, maximum_cycles=1_000_000)
SLOWER = replace(FAST, tolerance=1e-5, ramp_cycles=40_000, maximum_cycles=4_000_000)
SOLVERS = {
    "quasi-static": Solver(method="quasi_static"),
    "explicit, default": Solver(method="explicit"),
    "explicit, fast": FAST,
    "explicit, slow": SLOW,
    "explicit, slower": SLOWER,
}
PACES = ("explicit, fast", "explicit, slow", "explicit, slower")
WITHIN = 0.01
"""Relative difference up to which two solutions agree."""
DIFFERENCES = {"dpc_gap": "dpc opening", "slip": "slip on dpc", "reaction": "base reaction", "stress": "stresses"}
END = {
    "crack_width": "widest joint, mm",
    "crack_band": "widest crack band, mm",
    "cracked": "cracked contacts",
    "dpc_opening": "dpc opening, mm",
    "category": "category",
    "category_band": "category by band",
    **{f"reaches_{k}": f"movement at category {k}, mm" for k in (1, 2, 3)},
}
"""Quantities of a path, in words."""
RANDOM = 16
"""Random walls whose mortar does not break."""


@cache
def walls(brittle: int) -> dict[str, Case]:
    """Walls by name."""
    return {case.name: case for case in (*steady_cases(RANDOM), *map(brittle_case, range(brittle)))}


def keys(brittle: int) -> list[tuple[str, str]]:
    """Walls and solvers: walls that crack have no fast rate, the window walls of the test also the default."""
    found = []
    for name in walls(brittle):
        own = [solver for solver in SOLVERS if solver != "explicit, default" or "window" in name]
        if name.startswith("brittle"):
            own = ["quasi-static", "explicit, slow", "explicit, slower"]
        found += [(name, solver) for solver in own]
    return found


# -- one wall ---------------------------------------------------------------------------------------------------------


def path_of(case: Case, solver: Solver) -> tuple[list[Step], str]:
    """Increments of a path, and how it ended."""
    model, steps = case.model(), []
    try:
        steps.extend(follow(model, solver, case.scene.damage, case.scene.movement.increments))
    except SolverError as error:
        return steps, f"{type(error).__name__}: {error}"[:200]
    return steps, "collapsed" if steps[-1].increment.collapsed else "complete"


def measure(name: str, solver: str) -> dict[str, Any]:
    """Results of a wall at the end of its movement, and its differences from the quasi-static solver."""
    case = brittle_case(int(name.split()[1])) if name.startswith("brittle") else walls(0)[name]
    began = time.process_time()
    steps, end = path_of(case, SOLVERS[solver])
    row: dict[str, Any] = {"seconds": time.process_time() - began, "end": end, "dpc": case.scene.dpc is not None}
    if end != "complete":
        return row
    last, verdict = steps[-1].increment, steps[-1].verdict
    category = np.array([step.verdict.damage_category for step in steps])
    moved = 1e3 * case.model().central_deflection * np.array([step.increment.load_factor for step in steps])
    row |= {"crack_width": 1e3 * verdict.crack_width_max, "crack_band": 1e3 * verdict.crack_band_width_max}
    row |= {"cracked": (last.state == ContactState.CRACKED).sum(), "dpc_opening": 1e3 * verdict.dpc_opening_max}
    row |= {"category": verdict.damage_category, "category_band": verdict.damage_category_band}
    row |= {f"reaches_{k}": moved[(category >= k).argmax()] for k in (1, 2, 3) if category[-1] >= k}
    if solver != "quasi-static" and not name.startswith("brittle"):
        quasi, ended = path_of(case, SOLVERS["quasi-static"])
        row |= differences(case, quasi, steps) if ended == "complete" else {}
    return row


def differences(case: Case, quasi: list[Step], explicit: list[Step]) -> dict[str, float]:
    """Differences at the end of the path over the explicit solver's largest values; bonds of the mortar broken."""
    model, pair = case.model(), (quasi[-1].increment, explicit[-1].increment)
    on_dpc = model.interfaces.kind == ContactKind.DPC
    mortar = model.properties.tensile_strength > 0
    # a wall that rests on its two ends may translate: friction is equal at both, only the sum of slips is determined
    slips = [step.slip[on_dpc] - step.slip[on_dpc].mean() if on_dpc.any() else step.slip[on_dpc] for step in pair]
    weight = np.sqrt(model.interfaces.contact_area)
    stresses = [weight * np.stack((step.normal_stress, step.shear_stress)) for step in pair]
    broken = [int((step.state == ContactState.CRACKED)[mortar].sum()) for step in pair]
    return {
        "dpc_gap": difference(*(np.maximum(step.opening[on_dpc], 0.0) for step in pair), nothing=1e-6),
        "slip": difference(*slips, nothing=1e-6),
        "reaction": difference(*(np.array([s.increment.base_reaction for s in path]) for path in (quasi, explicit))),
        "stress": float(np.linalg.norm(stresses[0] - stresses[1]) / np.linalg.norm(stresses[1])),
        "broken": max(broken),
    }


def difference(found: FloatArray, expected: FloatArray, nothing: float = 0.0) -> float:
    """Largest difference over the largest value; NaN if there is no value."""
    if not expected.size or max(np.abs(expected).max(), np.abs(found).max()) <= nothing:
        return np.nan
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def lost(_: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Row of a path that took too long, or whose process died."""
    return {"end": message}


# -- the page ---------------------------------------------------------------------------------------------------------


def steady_table(rows: pd.DataFrame) -> str:
    """Largest differences of walls with and without broken mortar, by rate of the explicit solver."""
    known, lines = rows[rows["stress"].notna()], []
    for holds, words in ((True, "holds"), (False, "cracks")):
        for pace in PACES:
            own = known[(known["solver"] == pace) & ((known["broken"] == 0) == holds)]
            within = (own[list(DIFFERENCES)].max(axis=1) <= WITHIN).sum()
            line = {"mortar": words, "solver": pace, "walls": len(own), "within 1 %": int(within)}
            lines.append(line | {words: percent(own[name].max()) for name, words in DIFFERENCES.items()})
    return markdown(pd.DataFrame(lines))


def percent(share: float) -> str:
    return "-" if np.isnan(share) else f"{100 * share:.2g} %"


def band_table(rows: pd.DataFrame) -> str:
    """Widest joint and crack band of the window walls of the test, by solver."""
    own = rows[rows["wall"].isin(["bryant_window_dishing", "bryant_window_doming"])]
    names = {name: END[name] for name in ("crack_width", "crack_band", "category", "category_band")}
    return markdown(own[["wall", "solver", *names]].rename(columns=names).astype({"category": int}))


def paired_table(rows: pd.DataFrame, first: str, second: str) -> str:
    """Comparison of two solvers on the walls that crack: as samples, and wall by wall."""
    wide = rows[rows["wall"].str.startswith("brittle")].pivot(index="wall", columns="solver")
    random, lines = np.random.default_rng(1), []
    for name, words in END.items():
        both = wide[name][[first, second]][wide["dpc"][first] | (name != "dpc_opening")].dropna()
        apart = (both[first] - both[second]).to_numpy(float)
        draws = random.integers(0, len(apart), (10_000, len(apart)))
        low, high = np.quantile(apart[draws].mean(axis=1), (0.025, 0.975))
        ks = stats.ks_2samp(both[first], both[second], method="asymp")
        line = {"quantity": words, "walls": len(both), f"median ({first})": both[first].median()}
        line |= {f"median ({second})": both[second].median(), "Kolmogorov-Smirnov p": f"{ks.pvalue:.2f}"}
        line["mean difference (95 %)"] = f"{apart.mean():+.2g} ({low:+.2g} to {high:+.2g})"
        lines.append(line | {"half differ by up to": float(np.median(np.abs(apart)))})
    return markdown(pd.DataFrame(lines))


def page(rows: pd.DataFrame) -> str:
    """Tables of the page."""
    cracked = rows[rows["wall"].str.startswith("brittle")]
    same = cracked.pivot(index="wall", columns="solver", values="category").dropna()
    agree = {name: int((same[name] == same["explicit, slow"]).sum()) for name in ("quasi-static", "explicit, slower")}
    bad = rows[rows["end"] != "complete"]
    seconds = rows.groupby("solver", sort=False)["seconds"].median()
    parts = [
        f"All figures are of damagepred {', '.join(rows['version'].unique())}.",
        steady_table(rows),
        "The window walls of the full-scale test:",
        band_table(rows),
        f"Walls that crack, {len(same)}. Same category at the end as the explicit solver at the slow rate: "
        + ", ".join(f"{name} {count}" for name, count in agree.items())
        + ".",
        paired_table(rows, "quasi-static", "explicit, slow"),
        "Median time of a path: " + ", ".join(f"{name} {value:.2g} s" for name, value in seconds.items()) + ".",
    ]
    if len(bad):
        parts.append("Paths that are not complete:")
        parts.append("\n".join(f"- {row.wall}, {row.solver}: {row.end}" for row in bad.itertuples()))
    return "\n\n".join(parts)


def draw(rows: pd.DataFrame, file: Path) -> None:
    """Draw the distributions of the walls that crack, at the end of the movement."""
    rows = rows[rows["wall"].str.startswith("brittle")]
    looks = {"quasi-static": ("tab:blue", "--"), "explicit, slow": ("tab:red", "-"), "explicit, slower": ("0.5", "-")}
    figure = Figure((10.5, 3.8), layout="constrained")
    for ax, name in zip(figure.subplots(1, 3, sharey=True), ("crack_width", "crack_band", "dpc_opening")):
        for solver, (colour, style) in looks.items():
            own = rows[(rows["solver"] == solver) & (rows["dpc"] | (name != "dpc_opening"))]
            ax.ecdf(own[name].dropna(), color=colour, linestyle=style, label=solver)
        ax.set_xlabel(END[name].replace(", mm", " (mm)"))
        ax.grid(alpha=0.25)
    figure.axes[0].set_ylabel("share of walls")
    figure.axes[0].legend(loc="lower right", frameon=False)
    figure.savefig(file, dpi=130)


def main() -> None:
    """Measure what is missing in the data; write the page and the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--brittle", type=int, default=32, help="walls that crack (32)")
    parser.add_argument("--limit", type=float, default=600.0, help="time of one path (600 s)")
    parser.add_argument("--processes", type=int, default=2, help="paths at a time (2)")
    parser.add_argument("--quick", action="store_true", help="three small walls; the page stays as it is")
    parser.add_argument("--from-data", action="store_true", help="write page and picture alone")
    given = parser.parse_args()
    file = Path(tempfile.mkdtemp()) / "data.csv" if given.quick else HERE / "data.csv"
    wanted = keys(given.brittle)
    if given.quick:
        wanted = [key for key in wanted if key[0] in ("random 0", "random 2", "brittle 1")]
    if not given.from_data:
        path_of(brittle_case(2), SOLVERS["quasi-static"])  # compiles
        cases.run(wanted, KEY, measure, lost, file, given.limit, processes=given.processes, digits=6)
    rows = cases.read(file)
    if given.quick:
        print(markdown(rows))
        return
    put_in(HERE / "README.md", page(rows))
    draw(rows, HERE / "brittle.png")


if __name__ == "__main__":
    main()
