"""Every number in a report's tables, in the unit that stands beside it, against the dataset in SI."""

import re
import tomllib
from collections import Counter
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
import pytest
import xarray as xr

from damagepred.analyses.variance_shares import study_sensitivity
from damagepred.archive.files import write_dataset
from damagepred.archive.folder import StudyFolder
from damagepred.campaign.settings import read_frozen
from damagepred.damage import construction_limits
from damagepred.report import write_report
from damagepred.report.inputs import HEADS
from damagepred.results.rejudge import Share, judge_again, shares
from damagepred.results.wall_cracks import crack_frame, cracks
from damagepred.scene import Scene
from damagepred.scene.quantity import to_si
from damagepred.uq.exceedance import exceedance
from damagepred.uq.fragility import fit_fragility
from tests.report.test_page import HTML, check_page
from tests.synthetic_studies import FAILED, synthetic_study

UNITS = (
    {"m": 1.0, "mm": 1e-3, "%": 1e-2, "°": 1.0, "s": 1.0, "ms": 1e-3, "N": 1.0, "kN": 1e3, "J": 1.0, "Pa": 1.0}
    | {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm³": 1e9, "kg/m³": 1.0, "N/m": 1.0, "m/s²": 1.0, "–": 1.0, "": 1.0}
    | {"mean block weights": 1.0}
)
ONE = re.compile(r"(?<![\w.])([−+-]?\d[\d.]*(?:e[−+-]?\d+)?)[\s\u00a0]*(mm|m|%|°)?(?![\w³/])")
WORK = ("external_work", "elastic_energy", "friction_work", "fracture_work", "released_energy")
BOOTSTRAP = 20


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


PROBABILITY = re.compile(r"([<>]?)\s*(\d+(?:\.\d+)?)")


def compare_band(cell: str, unit: str, expected: Sequence[float], where: str) -> None:
    """Compare a number and the ends of its interval; alone it stands only where the interval tells no more."""
    shown = [] if cell.strip() in ("–", "∞") else numbers(cell, unit)
    if len(shown) == 1 and np.isfinite(expected).all():
        expected = [expected[0]] * (1 if np.ptp(expected) <= 2 * shown[0].half * (1 + 1e-6) else 3)
    elif not np.isfinite(expected).all():
        expected = [v for v in expected[:1] if np.isfinite(v)]
    assert len(shown) == len(expected), (where, cell, expected)
    for one, value in zip(shown, expected):
        assert abs(one.value - value) <= one.half * (1 + 1e-6) + 1e-9 * abs(value), (where, cell, unit, value)


def compare_chance(cell: str, expected: Sequence[float], where: str) -> None:
    """Compare a probability and the ends of its interval; those all but 0 or 1 are shown as beyond 0.001 or 0.999."""
    shown = [
        (sign, text, float(text), 0.5 * 10.0 ** -len(text.partition(".")[2]))
        for sign, text in PROBABILITY.findall(cell)
    ]

    def agree(one: tuple[str, str, float, float], value: float) -> bool:
        sign, text, number, half = one
        if sign:
            return (text == "0.001" and value < 1e-3) if sign == "<" else (text == "0.999" and value > 0.999)
        return abs(number - value) <= half * (1 + 1e-6)

    if not np.isfinite(expected[0]):
        assert not shown, (where, cell, expected)
        return
    if len(shown) == 1:  # the ends are not known, or are shown by the same digits
        shown *= len(expected) if np.isfinite(expected).all() else 1
    elif not np.isfinite(expected).all():
        pytest.fail(f"{where}: {cell} has an interval that is not known")
    wanted = expected if np.isfinite(expected).all() else expected[:1]
    assert len(shown) == len(wanted), (where, cell, expected)
    assert all(agree(one, value) for one, value in zip(shown, wanted)), (where, cell, expected)


def split(head: str) -> tuple[str, str]:
    """A head without its unit, and the unit."""
    match = re.fullmatch(r"(.*?) ?\(([^()]*)\)", head, re.DOTALL)
    return (match[1], match[2]) if match and match[2] in UNITS else (head, "")


def tables_of(root: Element) -> dict[str, tuple[list[str], list[list[str]], list[str]]]:
    """Heads, rows and groups of each table, by its caption."""
    captions = {e.get("id"): "".join(e.itertext()) for e in root.iter(f"{HTML}p")}
    found = {}
    for table in root.iter(f"{HTML}table"):
        heads = ["".join(e.itertext()) for e in table.iter(f"{HTML}th") if e.get("scope") == "col"]
        rows, groups, group = [], [], ""
        for row in table.iter(f"{HTML}tr"):
            cells = ["".join(e.itertext()) for e in row.iter(f"{HTML}td")]
            if cells:
                rows.append(cells)
                groups.append(group)
            else:
                group = "".join(row.itertext()).strip()
        found[captions[table.get("aria-labelledby")].partition(". ")[2]] = heads, rows, groups
    return found


def compare(cell: str, unit: str, expected: Sequence[float], where: str) -> None:
    """Compare all numbers of a cell with what is expected, to the digits that are shown."""
    shown = numbers(cell, unit)
    assert len(shown) == len(expected), (where, cell, expected)
    for one, value in zip(shown, expected):
        assert abs(one.value - value) <= one.half * (1 + 1e-6) + 1e-9 * abs(value), (where, cell, unit, value)


Column = Sequence[Sequence[float]] | None


def check_columns(name: str, heads: list[str], rows: list[list[str]], expected: dict[str, Column]) -> None:
    """Compare a table column by column; None: words. A column that is not expected is a mistake of this test."""
    assert [split(head)[0] for head in heads] == list(expected), name
    for position, head in enumerate(heads):
        column, unit = expected[split(head)[0]], split(head)[1]
        for row, cells in enumerate(rows):
            if column is None:
                assert not numbers(cells[position]), (name, head, cells[position])
            else:
                compare(cells[position], unit, column[row], f"{name}: {head}, row {row}")
    assert all(column is None or len(column) == len(rows) for column in expected.values()), name


def each(values: Any) -> list[list[float]]:
    return [[float(v)] for v in np.asarray(values)]


# -- what stands in both ---------------------------------------------------------------------------------------------


def check_inputs(rows: list[list[str]], groups: list[str], scene: dict[str, Any]) -> None:
    """Each value with its unit is that of the scene; no number of a scene's table is left out that is shown."""
    tables = {title: name for name, title in HEADS.items()}
    compared = 0
    for group, (quantity, value, unit, _) in zip(groups, rows):
        title, _, number = group.rpartition(" ")
        name = tables.get(group) or tables[title]
        values = scene[name][int(number) - 1] if name not in scene or isinstance(scene[name], list) else scene[name]
        for key in quantity.split(": "):
            values = values[key.replace(" ", "_")]
        if isinstance(values, bool | str):
            assert not numbers(value), (group, quantity, value)
            continue
        compare(value, unit, [values], f"{group}, {quantity}")
        compared += 1
    assert compared > 20


def limits_of(span: float) -> list[tuple[float, float, float]]:
    """1/ratio, absolute and governing limit of each construction, the strictest first."""
    known = [(k.one_in[0], k.deflection) for k in construction_limits().values()]
    return sorted(((n, d, min(span / n, d)) for n, d in known), key=lambda one: one[2])


def limit_columns(span: float) -> dict[str, Column]:
    found = limits_of(span)
    return {
        "construction": None,
        "limit, the lesser of": [[n, d] for n, d, _ in found],
        "for this length": each([least for *_, least in found]),
    }


# -- a wall ----------------------------------------------------------------------------------------------------------


def check_wall(ds: xr.Dataset, root: Element) -> None:
    tables = tables_of(root)
    last = {name: float(ds[name].values[-1]) for name in ds.data_vars if ds[name].dims == ("increment",)}
    for caption, (heads, rows, groups) in tables.items():
        if caption == "The wall":
            check_inputs(rows, groups, Scene.from_dict(tomllib.loads(ds.attrs["scene"])).to_dict())
        elif caption == "Program and run":
            told = dict(rows)
            for name, size in (
                ("blocks", ds.sizes["block"]),
                ("contacts", ds.sizes["contact"]),
                ("increments", ds.sizes["increment"] - 1),
            ):
                assert told.pop(name) == str(size)
            assert set(told) == {"file", "program", "report written", "solver", "how the path ended"}
        elif caption.startswith("How well the path is solved"):
            work = [abs(last[name]) for name in WORK]
            expected = {
                "largest unbalanced force": ds["unbalanced_force_ratio"].max(),
                "stress by which a joint exceeds its law": ds["joint_law_violation"].max(),
                "energy that does not balance, of all work done": last["energy_error"] / max(work),
                "times at which bonds broke": ds["events"].sum(),
                "Newton iterations": ds["newton_iterations"].sum(),
                "factorisations": ds["factorisations"].sum(),
                "corrected solutions": ds["corrections"].sum(),
                "reaction of the ground at the end": last["base_reaction"],
            }
            assert list(expected) == [row[0] for row in rows]
            for what, value, unit in rows:
                compare(value, unit, [float(expected[what])], what)
        elif caption.startswith("Where the energy has gone"):
            words = {
                "work of load and movement": "external_work",
                "stored in joints and blocks": "elastic_energy",
                "friction": "friction_work",
                "released where bonds broke": "released_energy",
                "not balanced": "energy_error",
            }
            for what, value in rows:
                compare(value, heads[1], [last[words[what]]], what)
        elif caption.startswith("Cracks at the end"):
            frame = crack_frame(cracks(ds)).head(len(rows))
            slope = [
                [] if o in ("horizontal", "vertical") else [np.round(i)]
                for o, i in zip(frame["crack_orientation"], frame["crack_inclination"])
            ]
            check_columns(
                caption,
                heads,
                rows,
                {
                    "crack": each(frame["crack"]),
                    "part": None,
                    "width": each(frame["crack_width"]),
                    "opening and slip": each(frame["crack_displacement"]),
                    "length": each(frame["crack_length"]),
                    "how it runs": slope,
                    "widest at x, y": [list(p) for p in zip(frame["crack_x"], frame["crack_y"])],
                    "began at a deflection of": each(frame["first_central_deflection"]),
                },
            )
        elif caption == "The wall's path":
            expected = {
                "deflection": each(ds["central_deflection"]),
                "widest crack": each(ds["crack_width_max"]),
                "cracks": each(ds["crack_count"]),
                "category": each(ds["damage_category"]),
                "crack band": each(ds["crack_band_width_max"]),
                "category by band": each(ds["damage_category_band"]),
            }
            for part, what in (("dpc", "dpc"), ("footing", "bed on footing")):
                over = 1e3 * ds[f"{part}_separation_length"].attrs["opening_threshold"]
                expected[f"{what} opening"] = each(ds[f"{part}_opening_max"])
                expected[f"{what} open by over {over:g} mm"] = each(ds[f"{part}_separation_length"])
            for i in range(ds.sizes["opening"]):
                expected[f"opening {i + 1} wider by"] = each(ds["opening_width_change"][:, i])
            check_columns(caption, [head.replace("\u00a0", " ") for head in heads], rows, expected)
        elif caption.startswith("This wall at the design deflections"):
            category, width = [], []
            for *_, least in limits_of(float(ds.attrs["span"])):
                reached = np.flatnonzero(ds["central_deflection"].values >= least * (1 - 1e-9))
                category.append([float(ds["damage_category"][reached[0]])] if reached.size else [])
                width.append([float(ds["crack_width_max"][reached[0]])] if reached.size else [])
            assert any(category)
            columns = limit_columns(float(ds.attrs["span"]))
            check_columns(caption, heads, rows, columns | {"category of damage": category, "widest crack": width})
        else:
            pytest.fail(f"the table '{caption}' is not compared")


@pytest.fixture(scope="module")
def wall_report(wall: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> str:
    place = tmp_path_factory.mktemp("wall")
    write_dataset(wall, place / "wall.nc")
    return write_report(place / "wall.nc").read_text(encoding="utf-8")


def test_every_number_of_a_wall_s_tables(wall: xr.Dataset, wall_report: str) -> None:
    check_wall(wall, check_page(wall_report))


# -- a study ---------------------------------------------------------------------------------------------------------


def _spread(one: xr.Dataset, name: str) -> list[float]:
    return [float(one[f"{name}{end}"]) for end in ("", "_lower", "_upper")]


@cache
def _fitted(folder: Path) -> xr.Dataset:
    ds = StudyFolder(folder).results()
    return fit_fragility(ds, bootstrap=BOOTSTRAP, goodness=BOOTSTRAP)


def _estimate(e: Any) -> list[float]:
    return [e.value, e.lower, e.upper]


def check_study(folder: StudyFolder, root: Element) -> None:
    ds, settings = folder.results(), read_frozen(folder.study_text())
    curves, run = _fitted(folder.path), ds["status"].values < FAILED
    moved = float(ds["central_deflection"].values[run].max(axis=1).min())
    of = curves["category"].values.tolist()
    for caption, (heads, rows, groups) in tables_of(root).items():
        if caption.startswith("The wall;"):
            check_inputs(rows, groups, settings.scene.to_dict())
        elif caption == "What is uncertain":
            words = {"COV": "cov"}
            for (name, variable), row in zip(settings.variables.items(), rows, strict=True):
                stated = re.findall(r"(\w+) ([\d.]+)", row[1])
                assert len(stated) == len(numbers(row[1])) == 2, row
                for word, value in stated:
                    unit = "" if word == "COV" else row[3]
                    given = to_si(getattr(variable, words.get(word, word)), Scene.unit_of(name))
                    compare(value, unit, [float(given)], f"{name}: {word}")
                field = variable.field
                compare(row[2], "", [] if field is None else [float(field.course_correlation)], f"{name}: field")
        elif caption == "Program and study":
            told, status = dict(rows), ds["status"].values
            counts = ("complete", "collapsed", "failed", "not run yet")
            for name, value in (
                (
                    "walls",
                    f"{len(status)}: {', '.join(f'{(status == k).sum()} {word}' for k, word in enumerate(counts))}",
                ),
                ("seed", settings.study.seed),
                ("increments", settings.scene.movement.increments),
            ):
                assert told.pop(name) == str(value), name
            seconds = ds["run_time"].values
            time = told.pop("time of a wall")
            assert re.fullmatch(r"[\d.]+\ss on average, [\d.]+\ss at most", time)
            compare(time, "s", [np.nanmean(seconds), np.nanmax(seconds)], caption)
            followed = told.pop("a wall is followed to")
            assert followed == f"category {settings.last_category}, or the end of its movement"
            assert set(told) == {"folder", "program", "study begun", "report written", "sampler", "solver"}
        elif caption == "Why walls failed":
            reasons = Counter(str(folder.failure(i)["reason"]).replace("_", " ") for i in folder.failed_samples())
            assert rows == [[reason, str(count)] for reason, count in reasons.most_common()]
        elif caption == "Failed walls":
            assert rows == [
                [str(i), folder.failure(i)["message"], f"damagepred replay {folder.path.name} {i}"]
                for i in np.flatnonzero(ds["status"].values == FAILED)
            ]
        elif caption == "How well the walls are solved":
            work = np.max([np.abs(ds[name].values) for name in WORK], axis=0)
            values: dict[str, Any] = {
                "largest unbalanced force": ds["unbalanced_force_ratio"].values,
                "stress by which a joint exceeds its law": ds["joint_law_violation"].values,
                "energy that does not balance, of all work done": np.abs(ds["energy_error"].values) / work,
            }
            known = np.isfinite(ds["unbalanced_force_ratio"].values)
            for what, *cells in rows:
                name, unit = split(what)
                worst = np.nanmax(values.pop(name), axis=1, where=known, initial=-1.0)
                worst = np.where(worst < 0.0, np.nan, worst)
                compare(cells[0], unit, [float(np.nanmedian(worst))], what)
                compare(cells[1], unit, [float(np.nanmax(worst))], what)
                compare(cells[2], "", [float(np.nanargmax(worst))], what)
            assert not values
        elif caption.startswith("Probability of each category or worse"):
            compare(caption.rpartition(" of ")[2].partition(",")[0], "", [moved], caption)
            for category, row in zip(range(1, 5), rows, strict=True):
                found = exceedance(ds, category, moved)
                e = found.estimate
                assert row[0].split()[0] == str(category)
                compare_chance(row[1], _estimate(e), caption)
                compare(row[2], "", [e.error], caption)
                compare(row[3], "", [e.samples], caption)
                compare(row[4], "", [e.effective_samples], caption)
                bounds = [found.failed_undamaged, found.failed_damaged] if found.failed else [np.nan]
                compare_chance(row[5], bounds, caption)
        elif caption == "Walls by the worst category of their path":
            rules: tuple[dict[str, Any], ...] = ({}, {"measure": "band"}, {"count_footing_gap": True})
            per_rule = [shares(judge_again(ds, **one)) for one in rules]
            numbered = [-1 if row[0] == "not known" else int(row[0].split()[0]) for row in rows]
            assert [c for c in sorted(set().union(*per_rule)) if c >= 0] == [c for c in numbered if c >= 0]
            # failed before a category, or not run
            assert all((one[-1].walls if -1 in one else 0) == (~run).sum() for one in per_rule)
            assert -1 in numbered or run.all()
            by = ("widest joint", "widest crack band", "widest joint or gap on the footing")
            nothing = Share(0, 0.0)
            columns = {head: [list(one.get(c, nothing)) for c in numbered] for head, one in zip(by, per_rule)}
            check_columns(caption, heads, rows, {"category": [[c] if c >= 0 else [] for c in numbered], **columns})
            assert len({str(one) for one in per_rule}) == 3
        elif caption.startswith(("Inputs and the movement at which category", "Inputs and damage of category")):
            own = caption.endswith("at each wall's own movement")
            sensitivity = study_sensitivity(ds, category=int(numbers(caption)[0].value), own_ground=own)
            for row in rows:
                one = sensitivity.sel(variable=row[0])
                for cell, name in zip(row[1:], ("spearman", "partial", "first_order"), strict=True):
                    compare(cell, "", _spread(one, name), f"{caption}: {row[0]}")
        elif caption == "The curves":
            for category, row in zip(of, rows, strict=True):
                one = curves.sel(category=category)
                assert row[0].split()[0] == str(category)
                compare_band(row[1], split(heads[1])[1], _spread(one, "median"), caption)
                compare_band(row[2], "", _spread(one, "dispersion"), caption)
                compare(row[3], "", [float(one["reached"]), float(one["reached"] + one["not_reached"])], caption)
                compare_chance(row[4], [float(one["p_value"])], caption)
                ends = [float(one[f"median_failed_{end}"]) for end in ("undamaged", "damaged")] if row[6:] else []
                compare("".join(row[6:]), "mm", [value for value in ends if np.isfinite(value)], caption)
            assert len(heads) == (7 if curves.attrs.get("samples_failed", 0) else 6)
        elif caption.startswith("Counted among the walls"):
            limits = limits_of(float(ds.attrs["span"]))
            plain = limit_columns(float(ds.attrs["span"]))
            check_columns(caption, heads[:3], [row[:3] for row in rows], plain)
            for row, (*_, least) in zip(rows, limits, strict=True):
                for category, cell in zip(of, row[3:], strict=True):
                    found = exceedance(ds, category, least)
                    short = found.not_followed > 0 or least > moved * (1 + 1e-9)
                    compare_chance(cell, [np.nan] if short else _estimate(found.estimate), caption)
        else:
            pytest.fail(f"the table '{caption}' is not compared")


@pytest.fixture(scope="module")
def study_report(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    place = tmp_path_factory.mktemp("study")
    folder = synthetic_study(place / "house.dp", 40, failed=(3, 17, 30), missing=(39,))
    return folder, write_report(folder, place / "r.html", replay=False, bootstrap=BOOTSTRAP).read_text(encoding="utf-8")


def test_every_number_of_a_study_s_tables(study_report: tuple[Path, str]) -> None:
    folder, text = study_report
    check_study(StudyFolder(folder), check_page(text))
