"""Every number on the screen, in the unit that stands beside it, against the dataset in SI."""

import errno
import io
import math
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
import xarray as xr
from rich.console import Console

from damagepred.archive.folder import StudyFolder
from damagepred.cli import tables, terminal
from damagepred.cli.sentences import surface_lines
from damagepred.results.tables import curve_notes, energy_rows, quality_rows
from damagepred.study import Progress
from damagepred.uq.fragility import fit_fragility
from tests.synthetic_studies import synthetic_study

UNIT = "(mm|m|s)"
UNITS = (
    {"m": 1.0, "mm": 1e-3, "%": 1e-2, "°": 1.0, "s": 1.0, "ms": 1e-3, "N": 1.0, "kN": 1e3, "J": 1.0, "Pa": 1.0}
    | {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm³": 1e9, "kg/m³": 1.0, "N/m": 1.0, "m/s²": 1.0, "–": 1.0, "": 1.0}
    | {"mean block weights": 1.0}
)
ONE = re.compile(r"(?<![\w.])([−+-]?\d[\d.]*(?:e[−+-]?\d+)?)[\s\u00a0]*(mm|m|%|°)?(?![\w³/])")


class Shown(NamedTuple):
    """A number of a page in SI, and half of its last digit."""

    value: float
    half: float


def numbers(cell: str, unit: str = "") -> list[Shown]:
    """The numbers of a cell; one without a unit of its own bears that of the column."""
    found = []
    for text, own in ONE.findall(cell):
        plain = text.replace("−", "-")
        mantissa, _, power = plain.partition("e")
        digits = len(mantissa.partition(".")[2])
        scale = UNITS[own or unit] * 10.0 ** int(power or 0)
        found.append(Shown(float(mantissa) * scale, 0.5 * 10.0**-digits * scale))
    return found


def compare(cell: str, unit: str, expected: Sequence[float], where: str) -> None:
    """Compare all numbers of a cell with what is expected, to the digits that are shown."""
    shown = numbers(cell, unit)
    assert len(shown) == len(expected), (where, cell, expected)
    for one, value in zip(shown, expected):
        assert abs(one.value - value) <= one.half * (1 + 1e-6) + 1e-9 * abs(value), (where, cell, unit, value)


def each(values: Any) -> list[list[float]]:
    return [[float(v)] for v in np.asarray(values)]


class Screen:
    """What is printed: tables as heads and rows, and lines."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.tables: list[tuple[str, list[str], list[list[str]]]] = []
        self.lines: list[str] = []
        monkeypatch.setattr(terminal, "table", lambda *given: self.tables.append(given))
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


@pytest.mark.parametrize(("unit", "head", "cell"), [("m-1", "median 1/m\n", "0.00235 ("), ("1", "median\n", "1/426 (")])
def test_medians_have_the_unit_of_the_measure(unit: str, head: str, cell: str, tmp_path: Path, shown: Screen) -> None:
    curves = fit_fragility(StudyFolder(synthetic_study(tmp_path / "house.dp", 40)).results(), bootstrap=20)
    curves["intensity"].attrs["units"] = unit
    curves["median"][0] = 2.35e-3
    tables.fragility_table(curves)
    ((_, heads, rows),) = shown.tables
    assert (heads[1][: len(head)], rows[0][1][: len(cell)]) == (head, cell)


def bands(names: Sequence[str], shape: tuple[int, ...] = (), first: float = 0.0) -> dict[str, Any]:
    """Values with lower and upper ends, no two of them alike."""
    values = {}
    for k, name in enumerate(names):
        middle = first + 0.1 * (k + 1) + 0.31 * np.arange(int(np.prod(shape))).reshape(shape) * (-1) ** k
        values |= {name: middle, f"{name}_lower": middle - 0.03 * (k + 1), f"{name}_upper": middle + 0.07 * (k + 1)}
    return values


@pytest.mark.parametrize(("censored", "failed", "begin"), [(0.13, 5, ["13% of t", "5 failed"]), (0.0, 0, [])])
def test_what_is_said_below_a_sensitivity(censored: float, failed: int, begin: list[str], shown: Screen) -> None:
    values = {name: ("variable", v) for name, v in bands(("spearman", "partial", "first_order"), (2,)).items()}
    attrs = {"title": "house", "output": "capacity", "walls": 96, "confidence": 0.8}
    attrs |= {"share_censored": censored, "samples_failed": failed}
    tables.sensitivity_tables(xr.Dataset(values, {"variable": ["joint.friction", "dpc.friction"]}, attrs))
    ((title, heads, _),) = shown.tables
    assert title == "house: capacity, 96 walls"
    assert heads == ["input", *(f"{w}\n(80% interval)" for w in ("rank correlation", "partial", "share of variance"))]
    assert [line[:8] for line in shown.lines] == begin


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


def test_costs_of_an_explicit_run_in_numbers() -> None:
    ds = xr.Dataset(
        {"unbalanced_force_ratio": ("increment", [1e-6, 3e-5, 2e-6]), "cycles": ("increment", [10, 200, 3000])}
        | {"base_reaction": ("increment", [7e3, 8e3, 9.25e3])},
        attrs={"solver_method": "explicit"},
    )
    assert quality_rows(ds) == [
        ["largest unbalanced force", "3e−05", "mean block weights"],
        ["cycles or time steps", "3210", ""],
        ["reaction of the ground at the end", "9.25", "kN"],
    ]


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
        monkeypatch.setattr(terminal, "_err", lambda console=console: console)
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
