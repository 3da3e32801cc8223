"""Every number on the screen, in the unit that stands beside it, against the dataset in SI."""

import errno
import io
import math
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from rich.console import Console

from damagepred.archive.folder import StudyFolder
from damagepred.cli import tables, terminal
from damagepred.cli.sentences import surface_lines, zones_lines
from damagepred.results.rejudge import judge_again, shares
from damagepred.results.tables import curve_notes, energy_rows, quality_rows
from damagepred.results.wall_cracks import crack_frame, cracks
from damagepred.study import Progress
from damagepred.uq.fragility import fit_fragility
from tests.report.test_numbers import compare, each, numbers
from tests.synthetic_studies import synthetic_study

UNIT = "(mm|m|s)"


class Screen:
    """What is printed: tables as heads and rows, and lines."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.tables: list[tuple[str, list[str], list[list[str]]]] = []
        self.lines: list[str] = []
        monkeypatch.setattr(terminal, "table", lambda *given: self.tables.append(given))  # type: ignore[arg-type]
        monkeypatch.setattr(terminal, "say", lambda line, **how: self.lines.append(line))

    def check(self, expected: Mapping[str, Sequence[Sequence[float]] | None]) -> None:
        """Compare the only table with columns; a head says with UNIT where its unit stands. None: words."""
        ((_, heads, rows),) = self.tables
        assert len(heads) == len(expected), heads
        for position, (head, (pattern, column)) in enumerate(zip(heads, expected.items())):
            match = re.fullmatch(pattern, head)
            assert match, (head, pattern)
            for row, cells in enumerate(rows):
                if column is not None:
                    compare(cells[position], match[1] if match.groups() else "", column[row], head)


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> Screen:
    return Screen(monkeypatch)


def compare_line(line: str, expected: Mapping[str, float]) -> None:
    """Compare numbers of a line with their units: each key says, with {} for number and unit, where it stands."""
    for words, value in expected.items():
        match = re.search(words.replace("{}", r"([-−\d.e+]+)(?: (kN|Pa|µs|mean block weights|%))?"), line)
        assert match, (words, line)
        scale = {"kN": 1e3, "µs": 1e-6, "%": 1e-2}.get(match[2], 1.0)
        half = numbers(match[1])[0].half * scale
        assert abs(float(match[1].replace("−", "-")) * scale - value) <= half * (1 + 1e-6) + 1e-9 * abs(value), (
            words,
            line,
            value,
        )


WORDS_OF_WORK = {
    "work of load and movement {}": "external_work",
    "stored in joints and blocks {}": "elastic_energy",
    "friction {}": "friction_work",
    "softening of bonds {}": "fracture_work",
    "released where bonds broke {}": "released_energy",
    "not balanced {}": "energy_error",
}


def last(ds: xr.Dataset, names: Mapping[str, str]) -> dict[str, float]:
    return {words: float(ds[name][-1]) for words, name in names.items()}


def test_every_number_of_a_wall(wall: xr.Dataset, shown: Screen) -> None:
    ds = wall.copy()
    steps = ds.sizes["increment"]
    ds["surface_movement"] = "increment", 3e-3 * np.arange(steps)
    for name in ("unbalanced_force_ratio", "joint_law_violation"):  # largest before the end
        ds[name] = "increment", 1e-7 * np.arange(steps, 0, -1)
    ds["footing_separation_length"] = wall["footing_separation_length"].copy(data=0.12 * np.arange(steps))
    tables.wall_table(ds)
    expected = {
        f"surface\nmovement\n{UNIT}": each(ds["surface_movement"]),
        f"deflection\n{UNIT}": each(ds["central_deflection"]),
        f"widest\ncrack\n{UNIT}": each(ds["crack_width_max"]),
        rf"band, {UNIT}\nand its\ncategory": None,
        "damage\ncategory": each(ds["damage_category"]),
    }
    for part, what in (("dpc", "dpc"), ("footing", "bed")):
        over = 1e3 * ds[f"{part}_separation_length"].attrs["opening_threshold"]
        expected[f"{what}\nopening\n{UNIT}"] = each(ds[f"{part}_opening_max"])
        assert ds[f"{part}_separation_length"].values.any()
        expected[rf"{what}\nopen\n> {over:g}\nmm, {UNIT}"] = None
    for i in range(ds.sizes["opening"]):
        expected[f"opening\n{i + 1} wider\n{UNIT}"] = each(ds["opening_width_change"][:, i])
    shown.check(expected)
    ((_, heads, rows),) = shown.tables
    for row, cells in enumerate(rows):
        both = dict(zip(heads, cells))
        band, category = both["band, mm\nand its\ncategory"].split(" ")
        compare(band, "mm", [float(ds["crack_band_width_max"][row])], "band")
        assert category == f"({int(ds['damage_category_band'][row])})"
        for part, what in (("dpc", "dpc"), ("footing", "bed")):
            (head,) = (h for h in heads if h.startswith(f"{what}\nopen\n"))
            assert head.endswith(", m")
            compare(both[head], "m", [float(ds[f"{part}_separation_length"][row])], head)
    quality, work = shown.lines[:2]
    compare_line(
        quality,
        {
            "unbalanced force {};": float(ds["unbalanced_force_ratio"].max()),
            "exceeds its law {};": float(ds["joint_law_violation"].max()),
            "bonds broke {};": float(ds["events"].sum()),
            "Newton iterations {};": float(ds["newton_iterations"].sum()),
            "factorisations {};": float(ds["factorisations"].sum()),
            "corrected solutions {};": float(ds["corrections"].sum()),
            "reaction of the ground at the end {}": float(ds["base_reaction"][-1]),
        },
    )
    energy = last(ds, WORDS_OF_WORK)
    compare_line(work, {words: value for words, value in energy.items() if value != 0.0})
    assert work.startswith("energy (J): ")
    assert work.count(";") == sum(value != 0.0 for value in energy.values()) - 1


def test_every_number_of_a_run_in_time() -> None:
    names = (*WORDS_OF_WORK.values(), "kinetic_energy", "damping_work", "base_reaction")
    ds = xr.Dataset(
        {name: ("increment", [0.0, 1.5 + 10 * k]) for k, name in enumerate(names)}
        | {
            "cycles": ("increment", [0, 400]),
            "searches": ("increment", [1, 7]),
            "unbalanced_force_ratio": ("increment", [0.0, 0.0]),
        },
        attrs={"time_step": 2.5e-5, "contact_points": 96, "solver_method": "dynamic", "impacts": "two"},
    )
    quality = {what: (value, unit) for what, value, unit in quality_rows(ds)}
    assert quality["time step"] == ("25", "µs")
    assert quality["reaction of the ground at the end"] == (f"{1e-3 * float(ds['base_reaction'][-1]):g}", "kN")
    told = ("cycles or time steps", "contact points", "searches for neighbours", "impacts")
    assert [quality[what][0] for what in told] == ["400", "96", "7", "two"]
    energy = dict(energy_rows(ds))
    words = WORDS_OF_WORK | {"in motion {}": "kinetic_energy", "damping {}": "damping_work"}
    assert energy == {what.removesuffix(" {}"): f"{float(ds[name][-1]):g}" for what, name in words.items()}


def test_every_number_of_cracks(wall: xr.Dataset, shown: Screen) -> None:
    found = cracks(wall)
    frame = crack_frame(found)
    assert frame.equals(crack_frame(wall))  # without the product of all its dimensions
    tables.crack_table(found, frame)
    slope = [
        [] if o in ("horizontal", "vertical") else [np.round(i)]
        for o, i in zip(frame["crack_orientation"], frame["crack_inclination"])
    ]
    shown.check(
        {
            "no": each(frame["crack"]),
            "part": None,
            f"width\n{UNIT}": each(frame["crack_width"]),
            "with\nslip": [[1e3 * v] for v in frame["crack_displacement"]],
            f"length\n{UNIT}": each(frame["crack_length"]),
            "how it\nruns": slope,
            f"widest\nat {UNIT}": None,
            f"began\nat {UNIT}": each(frame["first_central_deflection"]),
        }
    )
    ((title, _, rows),) = shown.tables
    assert title.endswith(f"of {1e3 * float(wall['central_deflection'][-1]):.3g} mm")
    for cells, one in zip(rows, frame.to_dict("records"), strict=True):
        assert cells[6] == f"{one['crack_x']:.2f},{one['crack_y']:.2f}"


def test_every_number_of_fragility_curves(tmp_path: Path, shown: Screen) -> None:
    """With failed walls, whose bounds are said below the table in its unit."""
    folder = synthetic_study(tmp_path / "house.dp", 40, failed=(3, 11, 17, 30))
    curves = fit_fragility(StudyFolder(folder).results(), bootstrap=20)
    tables.fragility_table(curves)
    ((_, heads, rows),) = shown.tables
    band = f"({curves.attrs['confidence']:.0%} band)"
    failed = "if all\nfailed walls were\nundamaged, or damaged"
    assert heads == [
        "category\nor worse",
        f"median mm\n{band}",
        f"dispersion\n{band}",
        "walls that\nreached it",
        "goodness\nof fit",
        "fit",
        f"median mm {failed}",
    ]
    reached = curves["category"].values[np.isfinite(curves["median"].values)]
    assert len(reached) >= 2
    for category, row in zip(curves["category"].values, rows, strict=True):
        one = curves.sel(category=category)
        counts = [float(one["reached"]), float(one["reached"] + one["not_reached"])]
        compare(row[3], "", counts, "walls that reached it")
        if category in reached:
            for cell, name, unit in ((row[1], "median", "mm"), (row[2], "dispersion", "")):
                values = [float(one[f"{name}{end}"]) for end in ("", "_lower", "_upper")]
                compare(cell, unit, values if np.isfinite(values).all() else values[:1], name)
            bounds = [float(one[f"median_failed_{end}"]) for end in ("undamaged", "damaged")]
            compare(row[6], "mm", [bound for bound in bounds if np.isfinite(bound)], "failed")
    assert any(line.startswith("4 failed walls count in the curves") for line in shown.lines)
    median = float(curves["median"][0])
    for unit, head, cell in (("m-1", "median 1/m\n", f"{median:.3g} ("), ("1", "median\n", f"1/{1 / median:.0f} (")):
        curves["intensity"].attrs["units"] = unit
        tables.fragility_table(curves)
        _, heads, others = shown.tables.pop()
        assert heads[1].startswith(head)
        assert others[0][1].startswith(cell)


def test_every_number_of_another_judgement(wall: xr.Dataset, tmp_path: Path, shown: Screen) -> None:
    after = judge_again(wall, table="bre251", measure="band")
    names = ("crack_width_max", "crack_band_width_max", "footing_opening_max")
    for factor, name in enumerate(names, start=1):  # no two alike
        after[name] = "increment", factor * 1e-3 * np.arange(1.0, after.sizes["increment"] + 1)
    after["damage_category"].values[:] = np.arange(after.sizes["increment"]) % 3  # another than before
    assert (after["damage_category"].values != wall["damage_category"].values).any()
    tables.judged_again(wall, after)
    ((_, heads, rows),) = shown.tables
    columns = dict(zip(heads, zip(*rows)))
    for head, values, unit in (
        ("deflection\nmm", wall["central_deflection"], "mm"),
        ("widest\ncrack\nmm", after["crack_width_max"], "mm"),
        ("bed\nopening\nmm", after["footing_opening_max"], "mm"),
        ("category\nafter", after["damage_category"], ""),
        ("category\nbefore", wall["damage_category"], ""),
    ):
        for cell, value in zip(columns[head], each(values), strict=True):
            compare(cell, unit, value, head)
    bands = [cell.split()[0] for cell in columns["band, mm\nand its\ncategory"]]
    for cell, value in zip(bands, each(after["crack_band_width_max"]), strict=True):
        compare(cell, "mm", value, "band")
    shown.tables.clear()
    study = StudyFolder(synthetic_study(tmp_path / "house.dp", 40)).results()
    after = judge_again(study, measure="band")
    tables.judged_again(study, after)
    ((_, _, rows),) = shown.tables
    was, now = shares(study), shares(after)
    assert was != now
    for cells in rows:
        category = int(cells[0].split()[0])
        for cell, found in zip(cells[1:], (was, now)):
            compare(cell, "", list(found[category]) if category in found else [0, 0], cells[0])


def bands(names: Sequence[str], shape: tuple[int, ...] = (), first: float = 0.0) -> dict[str, Any]:
    """Values with lower and upper ends, no two of them alike."""
    values = {}
    for k, name in enumerate(names):
        middle = first + 0.1 * (k + 1) + 0.31 * np.arange(int(np.prod(shape))).reshape(shape) * (-1) ** k
        values |= {name: middle, f"{name}_lower": middle - 0.03 * (k + 1), f"{name}_upper": middle + 0.07 * (k + 1)}
    return values


def banded(cell: str, one: xr.Dataset, name: str) -> None:
    """Compare a number and its interval."""
    compare(cell, "", [float(one[f"{name}{end}"]) for end in ("", "_lower", "_upper")], name)


def test_every_number_of_a_sensitivity(shown: Screen) -> None:
    inputs = ("spearman", "partial", "first_order")
    values = {name: ("variable", v) for name, v in bands(inputs, (2,)).items()}
    found = xr.Dataset(
        values,
        {"variable": ["joint.friction", "dpc.friction"]},
        (
            {"title": "house", "output": "capacity", "walls": 96, "confidence": 0.8, "share_censored": 0.13}
            | {"samples_failed": 5}
        ),
    )
    tables.sensitivity_tables(found)
    ((title, heads, rows),) = shown.tables
    assert title == "house: capacity, 96 walls"
    assert heads == ["input", *(f"{w}\n(80% interval)" for w in ("rank correlation", "partial", "share of variance"))]
    for name, cells in zip(("joint.friction", "dpc.friction"), rows, strict=True):
        assert cells[0] == name
        for cell, column in zip(cells[1:], inputs, strict=True):
            banded(cell, found.sel(variable=name), column)
    assert [line[:8] for line in shown.lines] == ["13% of t", "5 failed"]
    shown.tables.clear(), shown.lines.clear()
    tables.sensitivity_tables(found.assign_attrs(share_censored=0.0, samples_failed=0))
    assert len(shown.tables) == 1
    assert not shown.lines


@pytest.mark.parametrize(("scale", "words"), [("log", "its power"), ("linear", "exp of it times")])
def test_every_number_of_a_surface(scale: str, words: str) -> None:
    surface = xr.Dataset(
        {**bands(("slope", "dispersion"), (), 0.4), "dispersion_alone": 0.91, "fit_status": "fitted"},
        attrs=(
            {"category": 2, "intensity_measure": "surface_movement", "second_variable": "joint.cohesion"}
            | {"scale": scale, "aic_with": 211.4, "aic_without": 219.7}
        ),
    )
    assert surface_lines(surface) == [
        "category 2 against the surface movement and joint.cohesion: the median goes with "
        f"{words} 0.5 (0.47 to 0.57); dispersion 0.60 (0.54 to 0.74), without it 0.91",
        "Akaike's criterion: 211.4 with it, 219.7 without; it speaks for the curve with it",
    ]
    assert surface_lines(surface.assign_attrs(aic_with=230.0))[1].endswith("the curve without it")
    (said,) = surface_lines(surface.assign(fit_status="never reached"))
    assert said.endswith("no surface, never reached")


def test_how_well_curves_fit_is_said_of_each() -> None:
    curves = xr.Dataset(
        {
            "fit_note": ("category", ["", "few", ""]),
            "p_value": ("category", [0.2, 0.03, 0.05]),
            "distance": ("category", [0.11, 0.23, 0.37]),
        },
        {"category": [1, 2, 3]},
        {"aic_separate": 80.25, "aic_common": 79.5, "curves_cross": 0},
    )
    akaike = (
        "Akaike's criterion: {} with a dispersion for each category, {} with one for all. The smaller is better: {}."
    )
    assert curve_notes(curves) == [
        "The curve of category 2 is doubtful: of walls that follow such a curve, a share of 0.030 lies as far from it "
        "as these do (distance 0.23).",
        "Category 2: few.",
        akaike.format("80.2", "79.5", "one dispersion for all"),
    ]
    other = curves.assign_attrs(aic_common=81.5, crossed=1, curves_cross=1)
    said = curve_notes(other)
    assert said[2] == akaike.format("80.2", "81.5", "a dispersion for each")
    assert ["Walls come in fours" in said[3], "cross" in said[4]] == [True, True]
    del other.attrs["aic_common"]
    assert not any("Akaike" in line for line in curve_notes(other))


def test_zones_and_costs_of_an_explicit_run_in_numbers() -> None:
    steps = "increment"
    ds = xr.Dataset(
        {
            "zones_in_shear": (steps, [1, 9, 3]),
            "zones_in_tension": (steps, [2, 0, 5]),
            "zones_yielded_before": (steps, [0, 4, 7]),
            "unbalanced_force_ratio": (steps, [1e-6, 3e-5, 2e-6]),
            "base_reaction": (steps, [7e3, 8e3, 9.25e3]),
            "cycles": (steps, [10, 200, 3000]),
            "block_x": ("block", np.zeros(18)),
        },
        attrs={"deformable_blocks": 11, "zones": 128, "plane": "stress", "solver_method": "explicit"},
    )
    blocks = "11 of 18 blocks deformable, 128 zones in plane stress; "
    assert zones_lines(ds) == [blocks + "at the end 3 yield in shear, 5 in tension, 7 have yielded before"]
    for name in ("shear", "tension"):  # each of the three kinds is enough to be told
        ds[f"zones_in_{name}"] = steps, [0, 0, 0]
    assert "7 have yielded before" in zones_lines(ds)[0]
    ds["zones_yielded_before"] = steps, [0, 0, 0]
    alike = ds.assign(zones_in_shear=(steps, [0, 0, 4]), zones_in_tension=(steps, [0, 0, 4]))
    assert "4 yield in shear, 4 in tension, 0 have" in zones_lines(alike)[0]
    assert zones_lines(ds) == [blocks + "none of them yields"]
    assert quality_rows(ds) == [
        ["largest unbalanced force", "3e−05", "mean block weights"],
        ["cycles or time steps", "3210", ""],
        ["reaction of the ground at the end", "9.25", "kN"],
    ]
    del ds.attrs["zones"]
    assert zones_lines(ds) == []


def test_a_study_tells_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a terminal a line at once, one every ten seconds and one at the end; with one, a bar and no lines."""
    clock = [100.0]
    monkeypatch.setattr(terminal, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    steps = [
        (105.0, 20, 1, "", math.nan),
        (112.0, 24, 2, "sample 3 failed", 45.0),
        (115.5, 26, 2, "", 42.0),
        (120.0, 27, 3, "", 40.0),
        (121.0, 50, 3, "", 0.0),
    ]
    for in_terminal, lines in (
        (
            False,
            [
                "20 of 50 walls, 1 failed",
                "damagepred: sample 3 failed",
                "26 of 50 walls, 2 failed, about 42 s left",
                "50 of 50 walls, 3 failed",
            ],
        ),
        (True, None),
    ):
        told = io.StringIO()
        console = Console(file=told, soft_wrap=True, highlight=False, force_terminal=in_terminal, width=90)
        monkeypatch.setattr(terminal, "_err", console)
        clock[0] = 100.0
        with terminal.StudyBar() as bar:
            for clock[0], *state in steps[: None if lines else 3]:
                bar.update(Progress(50, *state))
        if lines:
            assert told.getvalue().splitlines() == lines
    (task,) = bar._progress.tasks
    assert (task.completed, task.total, task.fields) == (26, 50, {"failed": 2, "left": "about 42 s left"})
    shown = re.sub(r"\x1b\[[\d;?]*[a-zA-Z]", "", told.getvalue())
    assert "of 50 walls" not in shown
    assert re.search(r"walls ━+[╸╺━ ]*26/50 2 failed 0:00:00 about 42 s left", shown)


def test_output_that_cannot_be_written_is_lost_once_and_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """After the first failure nothing is tried, what is left in buffers goes nowhere, and a closed pipe is no loss."""
    tried: list[str] = []
    with (tmp_path / "full").open("w") as file:

        def write(text: str) -> None:
            tried.append(text)
            if problem:
                raise problem[0]

        stream = terminal._Stream("stdout")
        monkeypatch.setattr(terminal, "_OUTPUT", stream)
        problem: list[OSError] = []
        monkeypatch.setattr(sys, "stdout", SimpleNamespace(write=write, fileno=file.fileno, encoding="utf-7"))
        assert (stream.write("abc"), terminal.lost_output(), stream.encoding) == (3, None, "utf-7")
        problem.append(OSError(errno.ENOSPC, "no space"))
        assert [stream.write("de"), stream.write("f")] == [2, 1]
        assert tried == ["abc", "de"]
        assert terminal.lost_output() == "no space"
        file.write("left in a buffer")
    assert (tmp_path / "full").read_text() == ""
    for error, lost in ((OSError(errno.EPIPE, "gone"), None), (OSError("odd"), "odd")):
        stream.error = error
        assert terminal.lost_output() == lost
