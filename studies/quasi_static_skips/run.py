"""Measure what each skip of the quasi-static solver saves, and what it changes.

    python studies/quasi_static_skips/run.py [--repeats 5] [--samples 20]

Skips are: what stays elastic is condensed, the second half of a symmetric wall is not solved, and nothing after the
last category of interest. Each is turned off while the others stay as they are by default. Runs with and without
alternate, and times are those of the processor, so that other work on the machine hardly shows.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import csv
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from damagepred.assembly import Model, wall_model
from damagepred.damage import judge
from damagepred.errors import SolverError
from damagepred.path import Step, follow, joint_map
from damagepred.scene import Scene, Solver
from damagepred.solvers import ContactState, Increment, solve_path
from damagepred.study import Study

HERE = Path(__file__).resolve().parent
DATA = HERE.parents[1] / "data"
SOLVER = Solver(method="quasi_static")
SKIPS = {
    "condense": "elastic part condensed",
    "symmetric_half": "half of a symmetric wall",
    "both": "both",
}
STOP_AT = 3
"""Category of interest: moderate damage."""
Row = dict[str, Any]


def walls() -> dict[str, Scene]:
    """Return the walls of the full-scale test."""
    dishing, window, doming = (
        Scene.from_toml(DATA / f"bryant_{name}.toml") for name in ("dishing", "window_dishing", "doming")
    )
    return {
        "dishing, with dpc": dishing,
        "dishing, without dpc": replace(dishing, dpc=None),
        "window, dishing": window,
        "doming": doming,
    }


# -- skips that change how a wall is solved -----------------------------------------------------------------------


def switched(skip: str, on: bool) -> Solver:
    """Return the solver with a skip on or off, the others being as they are by default."""
    return replace(SOLVER, **{name: on for name in SKIPS if name != "both" and skip in (name, "both")})


def timed(model: Model, increments: int, skip: str, on: bool) -> tuple[float, list[Increment], str]:
    """Follow a path; return the time it took, its increments, and how it ended."""
    steps: list[Increment] = []
    began = time.process_time()
    try:
        steps.extend(solve_path(model, switched(skip, on), increments))  # keeps those before an error
        end = "collapsed" if steps[-1].collapsed else "complete"
    except SolverError as error:
        end = str(error).split(";")[0]
    return time.process_time() - began, steps, end


def measure(name: str, scene: Scene, skip: str, repeats: int) -> Row:
    """Return what a skip saves for a wall, and what it changes."""
    model, increments = wall_model(scene), scene.movement.increments
    times: dict[bool, list[float]] = {True: [], False: []}
    found: dict[bool, tuple[list[Increment], str]] = {}
    for run in range(repeats):
        # now the one first, now the other
        for on in (True, False) if run % 2 else (False, True):
            seconds, steps, end = timed(model, increments, skip, on)
            times[on].append(seconds)
            found[on] = steps, end
    ratios = [off / on for on, off in zip(times[True], times[False])]
    row: Row = {
        "wall": name, "skip": skip, "on_s": statistics.median(times[True]), "off_s": statistics.median(times[False]),
        "ratio": statistics.median(ratios), "ratio_low": min(ratios), "ratio_high": max(ratios),
        "end_on": found[True][1], "end_off": found[False][1],
    }  # fmt: skip
    return row | differences(model, scene, found[True][0], found[False][0])


def differences(model: Model, scene: Scene, on: list[Increment], off: list[Increment]) -> Row:
    """Return the largest differences over all increments that both paths reached."""
    joints = joint_map(model)
    moved, gap, cracked = np.zeros(2), 0.0, 0
    for a, b in zip(on, off):
        moved = np.maximum(moved, np.abs(a.displacement[:, :2] - b.displacement[:, :2]).max(axis=0))
        opening = [
            judge(joints, s.opening, s.slip, s.state == ContactState.CRACKED, scene.damage).dpc_opening_max
            for s in (a, b)
        ]
        gap = max(gap, abs(opening[0] - opening[1]))
        cracked = max(cracked, int(((a.state == ContactState.CRACKED) != (b.state == ContactState.CRACKED)).sum()))
    return {
        "reached_on": on[-1].number, "reached_off": off[-1].number,
        "sideways": moved[0] / scene.movement.central_deflection,
        "upwards": moved[1] / scene.movement.central_deflection,
        "dpc_opening_m": gap,
        "cracked_on": int((on[-1].state == ContactState.CRACKED).sum()),
        "cracked_off": int((off[-1].state == ContactState.CRACKED).sum()),
        "cracked_otherwise": cracked,
    }  # fmt: skip


def line(r: Row) -> str:
    """Return a skip's and a wall's line of the table."""
    return (
        f"| {SKIPS[r['skip']]} | {r['wall']} | {r['on_s']:.3g} | {r['off_s']:.3g} "
        f"| {r['ratio']:.2f} ({r['ratio_low']:.2f}, {r['ratio_high']:.2f}) | {r['upwards']:.1e} | {r['sideways']:.1e} "
        f"| {1e6 * r['dpc_opening_m']:.2g} | {r['cracked_on']} and {r['cracked_off']} | {r['cracked_otherwise']} |"
    )


def table(rows: list[Row]) -> str:
    head = [
        "skip", "wall", "with, s", "without, s", "times as fast (from, to)", "upwards over the movement",
        "sideways over the movement", "dpc opening, um", "cracked contacts, with and without", "cracked otherwise",
    ]  # fmt: skip
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    lines += [line(r) for r in rows]
    lines += [
        f"{SKIPS[r['skip']]}, {r['wall']}, {how}: {r[f'end_{how}']}"
        for r in rows
        for how in ("on", "off")
        if r.get(f"end_{how}", "complete") != "complete"
    ]
    return "\n".join(lines)


# -- the skip that ends a path ------------------------------------------------------------------------------------


def stop_early(samples: int) -> list[Row]:
    """Follow sampled walls to the end, and until the category of interest."""
    study = Study.from_toml(DATA / "bryant_study.toml")
    rows = []
    for number in range(samples):
        scene, values = study.sample(number, samples)
        model = wall_model(scene, values)
        row: Row = {"sample": number, "increments": scene.movement.increments}
        steps: dict[bool, list[Step]] = {}
        # every second wall the other way round: neither always comes first
        for stop in (True, False) if number % 2 else (False, True):
            steps[stop] = []
            end = "complete"
            began = time.process_time()
            try:
                for step in follow(model, SOLVER, scene.damage, scene.movement.increments):
                    steps[stop].append(step)
                    if step.increment.collapsed:
                        end = "collapsed"
                    if stop and step.verdict.damage_category >= STOP_AT:
                        end = f"category {STOP_AT}"
                        break
            except SolverError as error:
                end = str(error).split(";")[0]
            how = "on" if stop else "off"
            row |= {f"{how}_s": time.process_time() - began, f"{how}_end": end}
            row |= {f"{how}_reached": steps[stop][-1].increment.number}
        both = list(zip(steps[True], steps[False]))
        row["same"] = all(np.array_equal(a.increment.displacement, b.increment.displacement) for a, b in both)
        row["same_movement"] = all(reached(steps[True], k) == reached(steps[False], k) for k in range(1, STOP_AT + 1))
        rows.append(row)
        print(f"sample {number}: {row['on_s']:.1f} of {row['off_s']:.1f} s", file=sys.stderr, flush=True)
    return rows


def reached(steps: list[Step], category: int) -> int | None:
    """Return the increment in which a category was first reached."""
    return next((s.increment.number for s in steps if s.verdict.damage_category >= category), None)


def stop_table(rows: list[Row]) -> str:
    on, off = sum(r["on_s"] for r in rows), sum(r["off_s"] for r in rows)
    ratios = [r["off_s"] / r["on_s"] for r in rows]
    stopped = [r for r in rows if r["on_end"] == f"category {STOP_AT}"]
    lines = [
        "| stop at category | walls | of which stopped | with, s | without, s | times as fast, all together "
        "| wall by wall: median (from, to) | same until then | same movement at categories |",
        "|---|---|---|---|---|---|---|---|---|",
        f"| {STOP_AT} | {len(rows)} | {len(stopped)} | {on:.1f} | {off:.1f} | {off / on:.2f} "
        f"| {statistics.median(ratios):.2f} ({min(ratios):.2f}, {max(ratios):.2f}) "
        f"| {sum(r['same'] for r in rows)} of {len(rows)} | {sum(r['same_movement'] for r in rows)} of {len(rows)} |",
    ]
    if stopped:
        share = statistics.median(r["on_reached"] / r["increments"] for r in stopped)
        lines.append(f"stopped after {share:.0%} of the movement (median)")
    ends = ("complete", "collapsed", f"category {STOP_AT}")
    lines += [
        f"sample {r['sample']}, {'stop' if how == 'on' else 'no stop'}: {r[f'{how}_end']}"
        for r in rows
        for how in ("on", "off")
        if r[f"{how}_end"] not in ends
    ]
    return "\n".join(lines)


# -- both ---------------------------------------------------------------------------------------------------------


def draw(rows: list[Row], stops: list[Row], file: Path) -> None:
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(9.5, 4.6), layout="constrained")
    names = list(dict.fromkeys(r["wall"] for r in rows))
    width = 0.8 / len(SKIPS)
    colours = ("tab:blue", "tab:orange", "tab:green")
    for k, (skip, label) in enumerate(SKIPS.items()):
        mine = [r for r in rows if r["skip"] == skip]
        place = [names.index(r["wall"]) + (k - (len(SKIPS) - 1) / 2) * width for r in mine]
        bars(axes, place, mine, width, colours[k], label)
    if stops:
        ratios = [r["off_s"] / r["on_s"] for r in stops]
        all_of_them = sum(r["off_s"] for r in stops) / sum(r["on_s"] for r in stops)
        one = {"ratio": all_of_them, "ratio_low": min(ratios), "ratio_high": max(ratios)}
        bars(axes, [len(names)], [one], width, "tab:purple", f"nothing after category {STOP_AT}")
        names.append(f"{len(stops)} sampled\nwindow walls")
    axes.axhline(1.0, color="0.3", lw=0.8)
    axes.set_xticks(range(len(names)), names)
    axes.set(ylabel="time without the skip over time with it", title="What each skip saves")
    axes.margins(y=0.12)
    axes.grid(axis="y", alpha=0.25)
    figure.legend(loc="outside lower center", ncols=4, fontsize=8)
    figure.savefig(file, dpi=130)


def bars(axes: Any, place: list[float], rows: list[Row], width: float, colour: str, label: str) -> None:
    if not rows:
        return
    values = [r["ratio"] for r in rows]
    low = [max(r["ratio"] - r["ratio_low"], 0.0) for r in rows]
    high = [max(r["ratio_high"] - r["ratio"], 0.0) for r in rows]
    axes.bar(place, values, 0.92 * width, yerr=(low, high), color=colour, ecolor="0.3", capsize=2, label=label)
    for x, value, above in zip(place, values, high):
        axes.annotate(f"{value:.2f}", (x, value + above), xytext=(0, 3), textcoords="offset points",
                      ha="center", fontsize=8)  # fmt: skip


def write(file: Path, rows: list[Row]) -> None:
    with file.open("w", newline="", encoding="utf-8") as to:
        writer = csv.DictWriter(to, fieldnames=list(dict.fromkeys(name for row in rows for name in row)))
        writer.writeheader()
        writer.writerows(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5, help="runs with and without, in turn (5)")
    parser.add_argument("--samples", type=int, default=20, help="sampled walls to stop early (20)")
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder for the tables")
    parser.add_argument("--figure", type=Path, default=HERE / "skips.png", help="where to draw")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    # compiled, or loaded, apart from what is timed
    began = time.perf_counter()
    small = replace(walls()["dishing, with dpc"], wall=replace(Scene().wall, length=1.2, height=0.6))
    for skip in SKIPS:
        for on in (True, False):
            timed(wall_model(small), 2, skip, on)
    print(f"compile or load: {time.perf_counter() - began:.1f} s", file=sys.stderr, flush=True)
    rows: list[Row] = []
    for skip, label in SKIPS.items():
        for name, scene in walls().items():
            rows.append(measure(name, scene, skip, options.repeats))
            print(f"{label}, {name}: {rows[-1]['ratio']:.2f}", file=sys.stderr, flush=True)
    write(options.output / "skips.csv", rows)
    print(table(rows))
    stops = stop_early(options.samples) if options.samples else []
    if stops:
        write(options.output / "stops.csv", stops)
        print()
        print(stop_table(stops))
    draw(rows, stops, options.figure)


if __name__ == "__main__":
    main()
