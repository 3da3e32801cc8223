"""Compare the quasi-static solver with the explicit one at slow movement and small tolerance.

    python studies/quasi_static_agreement/run.py [--part unique|dry|brittle|transient|bands|cohesion] [--walls 40]

The solution of walls with hardly any broken bonds is unique, and both solvers must find it. That of brittle walls is
not; there the two are compared wall by wall and as samples. Walls without bonds show the effect of friction. Results of
the explicit solver are stored in ``results`` and not computed again, unless the walls or its settings change, or with
``--fresh``.
"""

from __future__ import annotations

import argparse
import csv
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from bands import band_table, cohesion_table
from explicit import PACES, Result, complete, explicit_results, note, pace_text, path_of
from scipy import stats
from transient import transient_table
from walls import INCREMENTS, Case, brittle_case, dry_case, numbers, unique_cases

from damagepred.arrays import FloatArray
from damagepred.enumerations import ContactKind
from damagepred.scene import Solver

HERE = Path(__file__).resolve().parent
QUASI_STATIC = Solver(method="quasi_static")
WITHIN = 0.01
"""Relative difference within which two solutions agree where it is unique."""
HARDLY = 0.002
"""Largest share of broken mortar contacts of a wall with a unique solution."""
EVER_SLOWER = ["fast", "slow", "slower"]
SLOWING = {pace: PACES[pace] for pace in EVER_SLOWER}
Row = dict[str, Any]


# -- where the answer is unique -----------------------------------------------------------------------------------


def compare(case: Case, quasi: Result, explicit: Result) -> Row:
    """Return the differences of two results at the end of the path, relative to the explicit one's largest values."""
    model = case.model()
    face = model.interfaces
    on_dpc = face.kind == ContactKind.DPC
    mortar = model.properties.tensile_strength > 0

    def opening(result: Result) -> FloatArray:
        return np.maximum(result["opening"][on_dpc], 0.0)

    def slip(result: Result) -> FloatArray:
        # the wall above may translate: friction at its two ends is equal, so only the sum of slips is determined
        values = result["slip"][on_dpc]
        return values - values.mean() if values.size else values

    return {
        "dpc_opening": off_by(opening(quasi), opening(explicit), nothing=1e-6),
        "slip": off_by(slip(quasi), slip(explicit), nothing=1e-6),
        "base_reaction": off_by(quasi["base_reaction"], explicit["base_reaction"]),
        "stress": stresses_off_by(case, quasi, explicit),
        "broken": int((quasi["state"] == 1)[mortar].sum()),
        "broken_explicit": int((explicit["state"] == 1)[mortar].sum()),
        "broken_otherwise": int(((quasi["state"] == 1) != (explicit["state"] == 1))[mortar].sum()),
    }


def stresses_off_by(case: Case, found: Result, expected: Result) -> float:
    """Return the norm of the difference of all contact stresses over their norm, weighted with the contacts' areas."""
    weight = np.sqrt(case.model().interfaces.contact_area)
    a, b = (weight * np.stack((r["normal_stress"], r["shear_stress"])) for r in (found, expected))
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


def off_by(found: FloatArray, expected: FloatArray, nothing: float = 0.0) -> float:
    """Return the largest difference over the largest value; NaN if there is no value."""
    if not expected.size or max(np.abs(expected).max(), np.abs(found).max()) <= nothing:
        return float("nan")
    return float(np.abs(found - expected).max() / np.abs(expected).max())


MEASURES = {"dpc_opening": "dpc opening", "slip": "slip on dpc", "base_reaction": "base reaction", "stress": "stresses"}


def unique_part(count: int, options: argparse.Namespace) -> str:
    """Compare walls with a unique solution; return the table."""
    cases = unique_cases(count)
    kept = explicit_results(
        cases,
        EVER_SLOWER,
        options.output / "explicit",
        fresh=options.fresh,
        processes=options.processes,
        limit=options.limit,
    )
    rows = []
    for case in cases:
        quasi = path_of(case, QUASI_STATIC)
        row: Row = {
            "wall": case.name,
            "blocks": case.model().n_blocks,
            "dpc": case.scene.dpc is not None,
            "openings": len(case.scene.opening),
            "kind": case.scene.movement.kind,
            "mm": 1e3 * case.scene.movement.central_deflection,
            "quasi_static": quasi["end"],
            "quasi_static_s": quasi["seconds"],
        }
        for pace in EVER_SLOWER:
            explicit = kept[case.name, pace]
            row |= {f"{pace}": explicit["end"], f"{pace}_s": explicit["seconds"]}
            if complete(quasi) and complete(explicit):
                row |= {f"{name}_{pace}": value for name, value in compare(case, quasi, explicit).items()}
        slow, slower = kept[case.name, "slow"], kept[case.name, "slower"]
        if complete(slow) and complete(slower):
            row |= {f"{name}_itself": value for name, value in compare(case, slow, slower).items()}
        rows.append(row)
        note(f"{case.name}: quasi-static {quasi['seconds']:.2f} s")
    write(options.output / "unique.csv", rows)
    draw_unique(rows, options.figures / "unique.png")
    return unique_table(rows, {case.name: case.model().n_contacts for case in cases})


def kind_of(row: Row, contacts: int) -> str:
    """Return in words whether a wall's path is unique."""
    broken = max(row["broken_slow"], row["broken_explicit_slow"])
    if broken == 0:
        return "unique"
    return "hardly" if broken <= HARDLY * contacts else "no"


def unique_table(rows: list[Row], contacts: dict[str, int]) -> str:
    head = [
        "wall",
        "blocks",
        "dpc",
        "openings",
        "movement",
        *MEASURES.values(),
        "mortar contacts broken",
        "path unique",
        "within 1 %",
    ]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for row in rows:
        start = f"| {row['wall']} | {row['blocks']} | {'yes' if row['dpc'] else 'no'} | {row['openings']} "
        start += f"| {row['kind']} {row['mm']:.2g} mm "
        if "stress_slow" not in row:
            lines.append(start + f"| quasi-static {row['quasi_static']}, explicit {row['slow']} |")
            continue
        values = " | ".join(percent(row[f"{name}_slow"]) for name in MEASURES)
        broken = f"{row['broken_slow']} and {row['broken_explicit_slow']}"
        if row["broken_otherwise_slow"]:
            broken += f", {row['broken_otherwise_slow']} differ"
        good = "yes" if within(row, "slow") else "no"
        lines.append(start + f"| {values} | {broken} | {kind_of(row, contacts[row['wall']])} | {good} |")
    lines.append("")
    for pace, solver in SLOWING.items():
        done = [r for r in rows if f"stress_{pace}" in r]
        for wanted in ("unique", "hardly", "no"):
            here = [r for r in done if "broken_slow" in r and kind_of(r, contacts[r["wall"]]) == wanted]
            if not here:
                continue
            worst = {n: [r[f"{n}_{pace}"] for r in here if not np.isnan(r[f"{n}_{pace}"])] for n in MEASURES}
            text = ", ".join(f"{MEASURES[n]} {percent(max(v))}" for n, v in worst.items() if v)
            good = sum(within(r, pace) for r in here)
            path = {"unique": "unique", "hardly": "hardly anything broken", "no": "not unique"}[wanted]
            lines.append(
                f"explicit {pace} ({pace_text(solver)}), path {path}: {good} of {len(here)} walls "
                f"within {WITHIN:.0%} in everything; largest differences: {text}"
            )
    cracked = [r for r in rows if "stress_itself" in r and kind_of(r, contacts[r["wall"]]) == "no"]
    if cracked:
        text = ", ".join(f"{MEASURES[n]} {percent(np.nanmax([r[f'{n}_itself'] for r in cracked]))}" for n in MEASURES)
        lines.append(f"explicit slow against explicit slower, path not unique: largest differences: {text}")
    for name, key in (("quasi-static", "quasi_static_s"), *((f"explicit, {p}", f"{p}_s") for p in EVER_SLOWER)):
        lines.append(f"{name}: {sum(r[key] for r in rows):.1f} s for all {len(rows)} walls")
    return "\n".join(lines)


def within(row: Row, pace: str) -> bool:
    """Return whether all comparable values agree; NaN is not compared."""
    return all(not row[f"{name}_{pace}"] > WITHIN for name in MEASURES)


def percent(share: float) -> str:
    if np.isnan(share):
        return "-"
    return f"{100 * share:.2f} %" if share >= 1e-4 else f"{100 * share:.0e} %"


def draw_unique(rows: list[Row], file: Path) -> None:
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10.5, 4.6), layout="constrained", sharey=True)
    names = [
        f"{pace}\n{solver.ramp_cycles} cycles,\n{solver.tolerance_used:g} weights" for pace, solver in SLOWING.items()
    ]
    for axis, measure, title in zip(axes, ("stress", "dpc_opening"), ("Contact stresses (norm)", "Opening of the dpc")):
        for row in rows:
            unique = row.get("broken_slow", 0) == 0 and row.get("broken_explicit_slow", 0) == 0
            values = [max(row.get(f"{measure}_{pace}", np.nan), 1e-7) for pace in EVER_SLOWER]
            axis.semilogy(
                range(len(EVER_SLOWER)),
                values,
                marker="o",
                ms=4,
                lw=1.0,
                alpha=0.8,
                color="tab:blue" if unique else "tab:red",
                ls="-" if unique else "--",
            )
        axis.axhline(WITHIN, color="0.3", lw=0.8, ls=":")
        axis.text(len(EVER_SLOWER) - 0.62, WITHIN * 1.1, "1 %", fontsize=8, color="0.3")
        axis.set(title=title, xlim=(-0.4, len(EVER_SLOWER) - 0.4), xlabel="rate and tolerance of the explicit solver")
        axis.set_xticks(range(len(EVER_SLOWER)), names)
        axis.grid(alpha=0.25)
    axes[0].set_ylabel("difference between the solvers")
    axes[0].plot([], [], "o-", color="tab:blue", label="no mortar broken: unique solution")
    axes[0].plot([], [], "o--", color="tab:red", label="mortar broken: several")
    figure.legend(loc="outside lower center", ncols=2, fontsize=8)
    figure.savefig(file, dpi=130)
    plt.close(figure)


# -- where friction alone holds -----------------------------------------------------------------------------------

FINER = (1, 4, 16)
"""Factors on the number of increments."""


def dry_part(count: int, options: argparse.Namespace) -> str:
    """Compare walls without bonds, and both solvers with themselves in smaller increments."""
    found = numbers(count)
    cases = {finer: [dry_case(number, finer) for number in found] for finer in FINER}
    kept = explicit_results(
        cases[1] + cases[4],
        ["slow"],
        options.output / "explicit",
        fresh=options.fresh,
        processes=options.processes,
        limit=options.limit,
    )
    head = ["wall", "blocks", "bond", "dpc", "openings", "movement"]
    head += [f"quasi-static, {INCREMENTS * finer} increments" for finer in FINER]
    head += [f"explicit, {INCREMENTS} increments"]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    rows: list[Row] = []
    for k, number in enumerate(found):
        case = cases[1][k]
        scene, expected = case.scene, kept[cases[4][k].name, "slow"]
        results = {f"quasi-static x{finer}": path_of(cases[finer][k], QUASI_STATIC) for finer in FINER}
        results["explicit x1"] = kept[case.name, "slow"]
        row: Row = {
            "wall": number,
            "blocks": case.model().n_blocks,
            "bond": scene.wall.bond,
            "dpc": scene.dpc is not None,
            "openings": len(scene.opening),
            "kind": scene.movement.kind,
            "mm": 1e3 * scene.movement.central_deflection,
            "explicit": expected["end"],
        }
        texts = []
        for name, result in results.items():
            row |= {f"{name}: end": result["end"], f"{name}: s": result["seconds"]}
            if not (complete(result) and complete(expected)):
                texts.append(f"{result['end']} (explicit {expected['end']})"[:80])
                continue
            gap = [np.maximum(r["opening"], 0.0) for r in (result, expected)]
            row |= {f"{name}: opening": off_by(*gap), f"{name}: stress": stresses_off_by(case, result, expected)}
            texts.append(f"{percent(row[f'{name}: opening'])} ({percent(row[f'{name}: stress'])})")
        rows.append(row)
        lines.append(
            f"| {number} | {row['blocks']} | {row['bond']} | {'yes' if row['dpc'] else 'no'} | {row['openings']} "
            f"| {row['kind']} {row['mm']:.2g} mm | " + " | ".join(texts) + " |"
        )
    write(options.output / "dry.csv", rows)
    lines.append("")
    for name in [f"quasi-static x{finer}" for finer in FINER] + ["explicit x1"]:
        gaps = [r[f"{name}: opening"] for r in rows if f"{name}: opening" in r]
        if gaps:
            lines.append(
                f"{name} against explicit x4: openings differ by {percent(float(np.median(gaps)))} in the median, "
                f"{percent(max(gaps))} at most; within {WITHIN:.0%} in {sum(g <= WITHIN for g in gaps)} of {len(gaps)}"
            )
    return "\n".join(lines)


# -- where it is not ----------------------------------------------------------------------------------------------

END = {  # quantities compared at the end of a path, in the given unit
    "crack_width": ("largest crack width", "mm", 1e3),
    "cracked": ("cracked contacts", "1", 1.0),
    "dpc_opening": ("dpc opening", "mm", 1e3),
    "category": ("damage category", "1", 1.0),
    "crack_band": ("widest crack band", "mm", 1e3),
    "category_band": ("damage category by band", "1", 1.0),
}
REACHED = (1, 2, 3)
"""Categories whose capacities are compared."""


def brittle_part(count: int, options: argparse.Namespace) -> str:
    """Compare walls that crack, as samples and wall by wall; return the tables."""
    cases = [brittle_case(number) for number in range(count)]
    paces = ["slow", "slower", "damped"]
    kept = explicit_results(
        cases,
        paces,
        options.output / "explicit",
        fresh=options.fresh,
        processes=options.processes,
        limit=options.limit,
    )
    results: dict[str, list[Result]] = {f"explicit, {pace}": [kept[c.name, pace] for c in cases] for pace in paces}
    results["quasi-static"] = []
    for number, case in enumerate(cases, start=1):
        results["quasi-static"].append(path_of(case, QUASI_STATIC))
        if number % 10 == 0:
            note(f"quasi-static: {number} of {len(cases)}")
    rows = []
    for number, case in enumerate(cases):
        row: Row = {
            "wall": number,
            "blocks": case.model().n_blocks,
            "dpc": case.scene.dpc is not None,
            "openings": len(case.scene.opening),
            "kind": case.scene.movement.kind,
            "mm": 1e3 * case.scene.movement.central_deflection,
        }
        for name, found in results.items():
            row |= {f"{name}: end": found[number]["end"], f"{name}: s": round(found[number]["seconds"], 3)}
            row |= {f"{name}: {key}": last(found[number], key) * END[key][2] for key in END}
            row |= {f"{name}: mm at category {k}": deflection_at(found[number], k) for k in REACHED}
        rows.append(row)
    write(options.output / "brittle.csv", rows)
    draw_brittle(rows, list(results), options.figures / "brittle.png")
    return brittle_table(rows, list(results))


def last(result: Result, key: str) -> float:
    return float(result[key][-1]) if complete(result) else float("nan")


def deflection_at(result: Result, category: int) -> float:
    """Return the movement at which a category was first reached (mm), not a number if not."""
    reached = result["category"] >= category if complete(result) else np.empty(0)
    return float(1e3 * result["deflection"][reached.argmax()]) if reached.any() else float("nan")


def paired(rows: list[Row], first: str, second: str, key: str) -> tuple[FloatArray, FloatArray]:
    """Return the values of two solvers, for the walls with both."""
    if key == "dpc_opening":
        rows = [r for r in rows if r["dpc"]]
    both = np.array([(r[f"{first}: {key}"], r[f"{second}: {key}"]) for r in rows]).reshape(-1, 2)
    both = both[np.isfinite(both).all(axis=1)]
    return both[:, 0], both[:, 1]


def tests(found: FloatArray, expected: FloatArray) -> dict[str, Any]:
    """Return the comparison of two paired samples."""
    difference = found - expected
    # differences of rounding do not count
    difference[np.abs(difference) < 1e-6 * max(1e-12, np.abs(expected).max(initial=0.0))] = 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # few differences, or many ties: the p-value is then an approximation
        ks = stats.ks_2samp(found, expected)
        signed = stats.wilcoxon(difference).pvalue if (difference != 0).any() else np.nan
    draws = np.random.default_rng(1).integers(0, len(difference), (10_000, len(difference)))
    low, high = np.quantile(difference[draws].mean(axis=1), (0.025, 0.975))
    return {
        "n": len(found),
        "medians": (np.median(expected), np.median(found)),
        "ks": (ks.statistic, ks.pvalue),
        "wilcoxon": signed,
        "mean": (difference.mean(), low, high),
        "size": np.median(np.abs(difference)),
        "largest": np.abs(difference).max(),
        "same": float((difference == 0).mean()),
    }


def comparison(rows: list[Row], first: str, second: str) -> list[str]:
    """Return a table of two solvers' samples."""
    head = [
        "quantity",
        "walls",
        f"median ({second})",
        f"median ({first})",
        "Kolmogorov-Smirnov D (p)",
        "Wilcoxon p",
        "mean difference (95 %)",
        "half differ by up to",
        "all by up to",
    ]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    keys = {key: f"{name}{'' if unit == '1' else ', ' + unit}" for key, (name, unit, _) in END.items()}
    keys |= {f"mm at category {k}": f"movement at category {k}, mm" for k in REACHED}
    for key, name in keys.items():
        found, expected = paired(rows, first, second, key)
        if len(found) < 5:
            lines.append(f"| {name} | {len(found)} | too few walls |")
            continue
        t = tests(found, expected)
        signed = "all alike" if np.isnan(t["wilcoxon"]) else chance(t["wilcoxon"])
        mean, low, high = t["mean"]
        lines.append(
            f"| {name} | {t['n']} | {t['medians'][0]:.4g} | {t['medians'][1]:.4g} | {t['ks'][0]:.2f} "
            f"({chance(t['ks'][1])}) | {signed} | {mean:+.2g} ({low:+.2g} to {high:+.2g}) | {t['size']:.2g} "
            f"| {t['largest']:.3g} |"
        )
    same, expected = paired(rows, first, second, "category")
    lines.append("")
    lines.append(f"same category at the end: {int((same == expected).sum())} of {len(same)} walls")
    for k in REACHED:
        reached = [np.isfinite([r[f"{n}: mm at category {k}"] for r in rows]) for n in (first, second)]
        lines.append(
            f"category {k} reached: {reached[1].sum()} walls ({second}), {reached[0].sum()} ({first}), "
            f"{(reached[0] & reached[1]).sum()} by both"
        )
    return lines


def chance(p: float) -> str:
    """Return a p-value as text."""
    return f"{p:.2f}" if p >= 0.01 else ("< 0.001" if p < 0.001 else f"{p:.3f}")


def brittle_table(rows: list[Row], names: list[str]) -> str:
    slow, slower, damped, quasi = names
    lines = []
    for title, first, second in (
        ("quasi-static against explicit", quasi, slow),
        ("quasi-static against explicit, damped", quasi, damped),
        ("the explicit solver against itself at a slower rate", slower, slow),
        ("the explicit solver against itself, slower and damped", damped, slow),
    ):
        lines += [f"{title}:", "", *comparison(rows, first, second), ""]
    for name in names:
        ends = [r[f"{name}: end"] for r in rows]
        bad = [f"wall {r['wall']}: {r[f'{name}: end']}" for r in rows if r[f"{name}: end"] != "complete"]
        lines.append(
            f"{name}: {ends.count('complete')} of {len(ends)} paths complete, median {seconds(rows, name):.2f} s a wall"
            + "".join(f"\n  {text}" for text in bad)
        )
    return "\n".join(lines)


def seconds(rows: list[Row], name: str) -> float:
    return float(np.median([r[f"{name}: s"] for r in rows]))


def draw_brittle(rows: list[Row], names: list[str], file: Path) -> None:
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(10.5, 7.4), layout="constrained")
    looks = dict(
        zip(names, (("tab:red", "-", 2.2), ("0.6", "-", 1.2), ("tab:orange", "-", 1.2), ("tab:blue", "--", 1.8)))
    )
    for axis, (key, (title, unit, _)) in zip(axes.flat, END.items(), strict=False):
        with_dpc = [r for r in rows if r["dpc"]] if key == "dpc_opening" else rows
        for name, (colour, style, width) in looks.items():
            values = np.sort([r[f"{name}: {key}"] for r in with_dpc])
            values = values[np.isfinite(values)]
            share = np.arange(len(values) + 1) / max(len(values), 1)
            axis.step(
                np.concatenate((values[:1], values)),
                share,
                where="post",
                color=colour,
                ls=style,
                lw=width,
                label=f"{name} ({len(values)} walls)",
            )
        axis.set(xlabel=title[0].upper() + title[1:] + ("" if unit == "1" else f", {unit}"), ylabel="share of walls")
        axis.set_ylim(0, 1.02)
        axis.grid(alpha=0.25)
        axis.legend(fontsize=8, loc="lower right")
    axes.flat[3].set_xticks(range(5))
    figure.suptitle(f"{len(rows)} walls that crack, at the end of the movement")
    figure.savefig(file, dpi=130)
    plt.close(figure)


# -- both ---------------------------------------------------------------------------------------------------------


def write(file: Path, rows: list[Row]) -> None:
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with file.open("w", newline="", encoding="utf-8") as to:
        writer = csv.DictWriter(to, fieldnames=columns)
        writer.writeheader()
        writer.writerows(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    known = ["unique", "dry", "brittle", "transient", "bands", "cohesion", "all"]
    parser.add_argument("--part", choices=known, default="all", help="which comparison")
    parser.add_argument(
        "--random", type=int, default=16, help="random walls whose mortar does not break, or is none (16)"
    )
    parser.add_argument("--walls", type=int, default=40, help="random walls that crack (40)")
    parser.add_argument("--fresh", action="store_true", help="do not use stored explicit results")
    parser.add_argument("--processes", type=int, default=1, help="number of processes of the explicit solver (1)")
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds that one explicit path may take (1800)")
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder for tables and stored results")
    parser.add_argument("--figures", type=Path, default=HERE, help="folder for the figures")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    # compiling or loading is not timed
    note(f"compile or load: {path_of(brittle_case(2), QUASI_STATIC)['seconds']:.1f} s")
    parts = {
        "unique": lambda: unique_part(options.random, options),
        "dry": lambda: dry_part(options.random, options),
        "brittle": lambda: brittle_part(options.walls, options),
        "transient": lambda: transient_table(unique_cases(0)[2]),
        "bands": band_table,
        "cohesion": cohesion_table,
    }
    for name, part in parts.items():
        if options.part in (name, "all"):
            print(f"-- {name} --\n\n{part()}\n", flush=True)


if __name__ == "__main__":
    main()
