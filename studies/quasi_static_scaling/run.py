"""What a path costs over the size of the wall, and how many banded Cholesky factorisations that is.

    python studies/quasi_static_scaling/run.py [--sizes 100 200 ...] [--increments 20] [--limit 600]

The solid wall of the full-scale test, made of fewer or more of the same bricks, dishes by the same deflection ratio:
with its damp-proof course, along which it separates, and without, so that it cracks. Each wall is solved in a process
of its own, which then factorises the elastic stiffness of the same wall once with LAPACK's banded Cholesky. Times are
those of the processor, so that other work on the machine hardly shows.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import csv
import json
import math
import resource
import statistics
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.csgraph import reverse_cuthill_mckee

from damagepred.assembly import Model, wall_model
from damagepred.errors import DamagepredError
from damagepred.scene import Loads, Scene, Solver
from damagepred.solvers import solve_path
from damagepred.solvers.stiffness import elastic_stiffness, held_dofs

HERE = Path(__file__).resolve().parent
DATA = HERE.parents[1] / "data"
SIZES = (100, 200, 400, 816, 1600, 3200, 6400, 12800, 20000)
FITTED_FROM = 400
"""Blocks from which on the exponents are fitted: below, what every path costs besides its blocks shows."""
ENOUGH, REPEATS, QUICK_REPEATS = 3.0, 5, 25
"""A path is timed 5, a factorisation 25 times (the median counts), but not again once it took 3 s in all."""
BAND_LIMIT = 4e9
"""Bytes that the band may take."""
WALLS = {True: "dpc", False: "no dpc"}
Row = dict[str, Any]


def wall(blocks: int, dpc: bool) -> Scene:
    """Return the test wall made of about so many bricks, at the deflection ratio of the test."""
    test = Scene.from_toml(DATA / "bryant_dishing.toml")
    brick, course = test.wall.block_length, test.wall.block_height
    factor = math.sqrt(blocks / 816)
    length = brick * round(test.wall.length / brick * factor)
    height = course * round(test.wall.height / course * factor)
    scale = length / test.wall.length
    return replace(
        test,
        wall=replace(test.wall, length=length, height=height),
        dpc=test.dpc if dpc else None,
        movement=replace(test.movement, central_deflection=scale * test.movement.central_deflection),
        loads=Loads(roof=scale * test.loads.roof),  # the same on every metre
        # walls whose joints differ are not symmetric: what a whole wall costs is what counts
        solver=Solver(method="quasi_static", symmetric_half=False),
    )


# -- one wall, in a process of its own ----------------------------------------------------------------------------


def solve_one(blocks: int, dpc: bool, increments: int) -> None:
    """Solve and factorise one wall; print what is known as it becomes known, a line of JSON each time."""
    scene = wall(blocks, dpc)
    began = time.perf_counter()
    for each in WALLS:
        follow(wall_model(wall(30, each)), scene.solver, 2, {})
    say(warm_up=time.perf_counter() - began, memory_before=peak_memory())
    began = time.perf_counter()
    model = wall_model(scene)
    say(
        assemble=time.perf_counter() - began, length=scene.wall.length, height=scene.wall.height,
        blocks=model.n_blocks, contacts=model.n_contacts, dofs=3 * model.n_blocks,
    )  # fmt: skip
    times: list[float] = []
    while len(times) < REPEATS and sum(times) < ENOUGH:
        row: Row = {}
        began, clock = time.process_time(), time.perf_counter()
        follow(model, scene.solver, increments, row, report=not times)
        times.append(time.process_time() - began)
        if len(times) == 1:
            say(memory=peak_memory(), path_by_the_clock=time.perf_counter() - clock, **row)
    say(path=statistics.median(times), path_runs=len(times))
    factorise(model)


def follow(model: Model, solver: Solver, increments: int, row: Row, report: bool = False) -> None:
    """Follow a path without keeping it; count the work in ``row``."""
    row.update(newton=0, events=0, factorisations=0, reached=-1, end="complete")
    try:
        for step in solve_path(model, solver, increments):
            row["newton"] += step.cycles
            row["events"] += step.events
            row["factorisations"] += step.factorisations
            row["reached"] = step.number
            row["cracked"] = int((step.state == 1).sum())
            if step.collapsed:
                row["end"] = "collapsed"
            if report:
                say(**row)
    except DamagepredError as error:
        row["end"], row["message"] = "failed", f"{type(error).__name__}: {error}"


def factorise(model: Model) -> None:
    """Time one banded Cholesky factorisation of the elastic stiffness, in the narrower of two orders."""
    free = np.setdiff1d(np.arange(3 * (model.n_blocks + 1)), held_dofs(model))
    stiffness = elastic_stiffness(model)[free][:, free].tocsr()
    by_course = np.repeat(np.lexsort((model.blocks.x, model.blocks.course)), 3) * 3 + np.tile(
        np.arange(3), model.n_blocks
    )
    orders = {"courses": by_course, "cuthill_mckee": reverse_cuthill_mckee(stiffness, symmetric_mode=True)}
    widths = {name: bandwidth(stiffness, order) for name, order in orders.items()}
    narrow = min(widths, key=lambda name: widths[name])
    size = 8 * (widths[narrow] + 1) * len(free)
    say(bandwidth=widths[narrow], band_bytes=size, **{f"bandwidth_{name}": w for name, w in widths.items()})
    if size > BAND_LIMIT:
        say(cholesky_skipped=f"the band of {len(free)} x {widths[narrow]} takes {size / 1e9:.1f} GB")
        return
    order = orders[narrow]
    ordered = stiffness[order][:, order].tocoo()
    lower = ordered.row >= ordered.col
    rows, columns = ordered.row[lower], ordered.col[lower]
    band = np.zeros((widths[narrow] + 1, len(free)), order="F")
    band[rows - columns, columns] = ordered.data[lower]
    times: list[float] = []
    while len(times) < QUICK_REPEATS and sum(times) < ENOUGH:
        factor = band.copy(order="F")
        began = time.process_time()
        factor, info = lapack.dpbtrf(factor, lower=1, overwrite_ab=1)
        times.append(time.process_time() - began)
    # it must be a factor of what it was meant to be
    load = model.supports.load[free][order]
    moved, _ = lapack.dpbtrs(factor, load, lower=1)
    ordered = ordered.tocsr()
    off = float(np.abs(ordered @ moved - load).max() / np.abs(load).max())
    if info != 0 or not off < 1e-6:
        say(cholesky_skipped=f"factorisation failed: info {info}, residual {off:.1e}")
        return
    say(cholesky=statistics.median(times), cholesky_runs=len(times))


def bandwidth(matrix: sparse.csr_array, order: np.ndarray) -> int:
    """Return how far from the diagonal the entries of a symmetric matrix lie, its rows and columns in an order."""
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    entries = matrix.tocoo()
    return int(np.abs(place[entries.row] - place[entries.col]).max())


def peak_memory() -> float:
    """Return the most memory this process has held so far (MB)."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def say(**known: Any) -> None:
    print(json.dumps(known), flush=True)


# -- all walls ----------------------------------------------------------------------------------------------------


def run_one(blocks: int, dpc: bool, increments: int, limit: float) -> Row:
    """Solve one wall in a process of its own; return all that came out within the limit (s)."""
    command = [sys.executable, str(Path(__file__).resolve()), "--one", str(blocks), "--increments", str(increments)]
    began = time.perf_counter()
    late, trouble = False, ""
    try:
        done = subprocess.run(command + ["--dpc"] * dpc, capture_output=True, timeout=limit, check=False)
        lines = done.stdout
        if done.returncode:
            trouble = f"exit code {done.returncode}: " + done.stderr.decode(errors="replace").strip()[-300:]
    except subprocess.TimeoutExpired as error:
        lines, late = error.stdout or b"", True
    row: Row = {"wall": WALLS[dpc], "asked": blocks, "increments": increments}
    for line in lines.decode().splitlines():
        try:
            row.update(json.loads(line))
        except json.JSONDecodeError:  # cut off by the limit
            continue
    row["seconds_in_all"] = time.perf_counter() - began
    if "path" not in row:
        row["end"] = "time-out" if late else "failed"
        row["message"] = trouble or f"the path took longer than {limit:g} s"
    elif late or trouble:
        row["cholesky_skipped"] = trouble or f"not done within {limit:g} s"
    if "path" in row and "cholesky" in row:
        row["multiple"] = row["path"] / row["cholesky"]
    return row


def run_all(sizes: list[int], increments: int, limit: float) -> list[Row]:
    """Solve all walls, the small ones first; what is larger than one that took too long is not tried."""
    rows: list[Row] = []
    for dpc, name in WALLS.items():
        too_large = 0
        for blocks in sizes:
            if too_large:
                row: Row = {"wall": name, "asked": blocks, "increments": increments, "end": "not run"}
                row["message"] = f"{too_large} blocks already took longer than {limit:g} s"
            else:
                row = run_one(blocks, dpc, increments, limit)
                too_large = blocks if row["end"] == "time-out" else 0
            rows.append(row)
            print(line(row), file=sys.stderr, flush=True)
    return rows


# -- what came out ------------------------------------------------------------------------------------------------

HEAD = (
    "| wall | blocks | contacts | degrees of freedom | path, s | Newton steps | events | factorisations "
    "| peak memory, MB | of which the wall, MB | bandwidth | one banded Cholesky, s | path in Choleskys |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|---|"
)


def line(row: Row) -> str:
    """Return a wall's line of the table."""
    if row["end"] not in ("complete", "collapsed"):
        reached = f" at increment {row['reached']} of {row['increments']}" if row.get("reached", -1) >= 0 else ""
        return f"| {row['wall']} | {row.get('blocks', row['asked'])} | {row['end']}{reached}: {row.get('message')} |"
    cholesky = ("skipped", "") if "cholesky" not in row else (f"{row['cholesky']:.3g}", f"{row['multiple']:.0f}")
    wall_memory = row["memory"] - row["memory_before"]
    return (
        f"| {row['wall']} | {row['blocks']} | {row['contacts']} | {row['dofs']} | {row['path']:.3g} | {row['newton']} "
        f"| {row['events']} | {row['factorisations']} | {row['memory']:.0f} | {wall_memory:.0f} | {row['bandwidth']} "
        f"| {cholesky[0]} | {cholesky[1]} |"
    )


def solved(rows: list[Row], name: str) -> list[Row]:
    return [r for r in rows if r["wall"] == name and r["end"] in ("complete", "collapsed")]


def exponent(rows: list[Row], value: Any) -> float:
    """Return the slope of a straight line through the logarithms of a value over the number of blocks."""
    pairs = [(r["blocks"], value(r)) for r in rows if r["asked"] >= FITTED_FROM and value(r) > 0]
    if len(pairs) < 2:
        return math.nan
    return float(np.polyfit(*np.log(np.array(pairs)).T, 1)[0])


def summary(rows: list[Row], limit: float, compiled: float) -> str:
    lines = [HEAD, *(line(r) for r in rows), ""]
    for name in WALLS.values():
        done = solved(rows, name)
        if not done:
            lines.append(f"{name}: no wall was solved")
            continue
        lines.append(
            f"{name}: time grows as blocks^{exponent(done, seconds):.2f}, the wall's memory as "
            f"blocks^{exponent(done, megabytes):.2f}, a banded Cholesky as blocks^{exponent(done, cholesky):.2f} "
            f"(fitted from {FITTED_FROM} blocks on); largest within {limit:g} s: {done[-1]['blocks']} blocks"
        )
    lines += [f"{r['wall']}, {r['asked']} blocks: ended in a collapse" for r in rows if r["end"] == "collapsed"]
    without = [r for r in rows if "cholesky_skipped" in r]
    lines += [f"{r['wall']}, {r['asked']} blocks: no Cholesky, {r['cholesky_skipped']}" for r in without]
    starts = [r["warm_up"] for r in rows if "warm_up" in r]
    lines.append(
        f"compiling what is not compiled yet, once: {compiled:.1f} s; loading it, for every wall: "
        f"{statistics.median(starts):.1f} s in the median; neither is part of the path's time"
    )
    return "\n".join(lines)


def seconds(row: Row) -> float:
    return float(row["path"])


def megabytes(row: Row) -> float:
    return float(row["memory"] - row["memory_before"])


def cholesky(row: Row) -> float:
    return float(row.get("cholesky", 0.0))


def draw(rows: list[Row], limit: float, increments: int, file: Path) -> None:
    from matplotlib import pyplot as plt

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13.5, 4.4), layout="constrained")
    looks = {"dpc": ("tab:blue", "o", "with dpc, separates"), "no dpc": ("tab:red", "s", "without dpc, cracks")}
    for name, (colour, marker, label) in looks.items():
        done = solved(rows, name)
        blocks = [r["blocks"] for r in done]
        for axes, value, what in (
            (left, seconds, "path"), (middle, megabytes, "path"), (right, lambda r: r.get("multiple", 0.0), None),
        ):  # fmt: skip
            power = f": blocks$^{{{exponent(done, value):.2f}}}$" if what else ""
            axes.loglog(blocks, [value(r) or math.nan for r in done], color=colour, marker=marker, label=label + power)
        late = [r for r in rows if r["wall"] == name and r["end"] == "time-out"]
        if late:
            where = [r.get("blocks", r["asked"]) for r in late]
            left.plot(where, [limit] * len(late), "^", color=colour, mfc="none", label=f"{name}: over {limit:g} s")
    timed = [r for r in max((solved(rows, n) for n in WALLS.values()), key=len) if "cholesky" in r]
    left.loglog(
        [r["blocks"] for r in timed], [cholesky(r) for r in timed], color="0.4", marker=".", ls="--",
        label=f"one banded Cholesky: blocks$^{{{exponent(timed, cholesky):.2f}}}$",
    )  # fmt: skip
    middle.loglog(
        [r["blocks"] for r in timed], [r["band_bytes"] / 2**20 for r in timed], color="0.4", marker=".", ls="--",
        label="band of the Cholesky alone",
    )  # fmt: skip
    left.set(title=f"Processor time, {increments} increments", ylabel="s")
    middle.set(title="Peak memory, less that before the wall", ylabel="MB")
    right.set(title="Path over one banded Cholesky", ylabel="times")
    for axes in (left, middle, right):
        axes.set_xlabel("blocks")
        axes.grid(which="both", alpha=0.25)
        axes.legend(fontsize=8)
    figure.savefig(file, dpi=130)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="+", default=list(SIZES), help="blocks of each wall, about")
    parser.add_argument("--increments", type=int, default=20, help="steps of the movement (20)")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds that one wall may take (600)")
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder for the table")
    parser.add_argument("--figure", type=Path, default=HERE / "scaling.png", help="where to draw")
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--dpc", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one is not None:
        solve_one(options.one, options.dpc, options.increments)
        return
    # in a process of its own, for compiling takes memory
    compiled = run_one(30, False, 2, options.limit)["warm_up"]
    print(f"compile or load: {compiled:.1f} s", file=sys.stderr, flush=True)
    rows = run_all(sorted(options.sizes), options.increments, options.limit)
    options.output.mkdir(parents=True, exist_ok=True)
    with (options.output / "walls.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(dict.fromkeys(name for row in rows for name in row)))
        writer.writeheader()
        writer.writerows(rows)
    print(summary(rows, options.limit, compiled))
    draw(rows, options.limit, options.increments, options.figure)


if __name__ == "__main__":
    main()
