"""The table: the test, the paper's model, and this model loaded in four ways."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from measures import THRESHOLDS, AroundWindow, Dpc, cracked_above_dpc, separation_at, width_against_separation
from solving import LABELS, Solved

MM, MPA, KN = 1e3, 1e-6, 1e-3
NOT_KNOWN = "-"


@dataclass(frozen=True)
class Row:
    """One quantity of a case: value of the test, of the paper's model, and of each way of loading."""

    case: str
    quantity: str
    test: str
    paper: str
    ours: dict[str, str]


def number(value: float | None, digits: int = 3) -> str:
    """Return a number as the table writes it."""
    if value is None or not np.isfinite(value):
        return NOT_KNOWN
    if abs(value) < 5e-4:
        return "0"
    return f"{float(f'{value:.{digits}g}'):.6f}".rstrip("0").rstrip(".")


def rows(solved: Solved) -> list[Row]:
    """Return all rows of a case."""
    test = solved.case.test
    paper = test.get("paper_model", {})
    found: list[Row] = []

    def add(
        quantity: str,
        of: Callable[[xr.Dataset], str],
        seen: object = None,
        theirs: object = None,
        at_limit: bool = False,
    ) -> None:
        runs = solved.limit if at_limit else solved.whole
        ours = {way: of(runs[way]) if way in runs else NOT_KNOWN for way in LABELS}
        found.append(Row(solved.case.name, quantity, _said(seen), _said(theirs), ours))

    end = f"{MM * solved.case.deflection:g} mm"
    dishing = "dishing" in solved.case.name
    idle = "jacks" if dishing else "supports"
    limit = MM * test["central_deflection"] if "central_deflection" in test else None
    add(
        f"deflection at which {idle} carry nothing, mm",
        lambda ds: number(MM * ds.attrs.get("limit_deflection", np.nan)),
        limit,
        "prescribed",
        True,
    )
    add("widest opening of the dpc there, mm", lambda ds: number(MM * _dpc(ds).opening.max()), at_limit=True)
    if solved.case.has_window:
        _window(add, end, test, paper, dishing)
    elif dishing:
        _dishing(add, end, test, paper)
    else:
        _doming(add, end, test, paper)
    add(
        f"largest slip on the dpc where it carries, at {end}, mm",
        lambda ds: number(MM * _dpc(ds).sliding),
        test.get("sliding"),
    )
    add(
        f"mortar joints broken above the dpc at {end}",
        lambda ds: str(cracked_above_dpc(ds, -1)),
        test.get("cracks_above_dpc"),
        paper.get("cracks_above_dpc"),
    )
    add(
        f"load of each jack at {end}, kN",
        lambda ds: number(KN * float(ds["jack_load"][-1])) if "jack_load" in ds else NOT_KNOWN,
    )
    add(f"largest moment in the footing at {end}, kNm", lambda ds: _moment(ds))
    return found


def _dpc(ds: xr.Dataset) -> Dpc:
    return Dpc.of(ds, -1)


def _moment(ds: xr.Dataset) -> str:
    if "section_moment" not in ds:
        return NOT_KNOWN
    moments = ds["section_moment"].values[-1]
    return number(KN * float(moments[np.abs(moments).argmax()]))


def _dishing(add: Callable[..., None], end: str, test: dict, paper: dict) -> None:
    distance = test["dpc_closed_length_at_ends"]
    for t in THRESHOLDS:
        add(f"dpc open by more than {MM * t:g} mm along, at {end}, m", lambda ds, t=t: number(_dpc(ds).separated(t)))
    for t in THRESHOLDS:
        add(
            f"not open by more than {MM * t:g} mm at each end, at {end}, mm",
            lambda ds, t=t: number(MM * float(np.mean(_dpc(ds).closed_at_ends(t)))),
            f"{MM * distance:g} (threshold not reported)",
            f"{MM * paper['dpc_closed_length_at_ends']:g}",
        )
    add(
        f"opening of the dpc {MM * distance:g} mm from the ends, at {end}, mm",
        lambda ds: number(MM * _dpc(ds).opening_at(distance)),
    )


def _doming(add: Callable[..., None], end: str, test: dict, paper: dict) -> None:
    gaps = " and ".join(f"{MM * g:g}" for g in test["dpc_opening_at_ends"])
    add("opening of the dpc at its ends where supports carry nothing, mm", _end_gaps, at_limit=True)
    add(f"opening of the dpc at its ends, at {end}, mm", _end_gaps, gaps)
    add(
        "length on which the wall rests where supports carry nothing, m",
        lambda ds: number(_dpc(ds).bearing),
        at_limit=True,
    )
    add(
        f"length on which the wall rests, at {end}, m",
        lambda ds: number(_dpc(ds).bearing),
        test.get("rests_on"),
        paper.get("rests_on"),
    )


def _end_gaps(ds: xr.Dataset) -> str:
    return " and ".join(number(MM * g) for g in _dpc(ds).end_gaps)


def _window(add: Callable[..., None], end: str, test: dict, paper: dict, dishing: bool) -> None:
    seen = test.get("opening_width_change")

    def change(ds: xr.Dataset) -> str:
        return number(MM * float(ds["opening_width_change"][-1, 0]))

    strength = MPA * test["tension_below"] if "tension_below" in test else None
    below = f"below {strength:g}" if strength else None
    add(
        f"change of the window's width where {'jacks' if dishing else 'supports'} carry nothing, mm",
        change,
        at_limit=True,
    )
    add(
        f"change of the window's width at {end}, mm",
        change,
        f"{MM * seen:g} (at the largest deflection)" if seen else test.get("width"),
    )
    if seen:
        add(
            f"widest opening of the dpc when it is {MM * seen:g}, mm",
            lambda ds: number(MM * (separation_at(ds, seen) or np.nan)),
        )
    add(
        "mm of width for each mm of the dpc's opening (straight line)",
        lambda ds: number(width_against_separation(ds).slope),
        test.get("proportional"),
    )
    add("r2 of that line", lambda ds: number(width_against_separation(ds).r2))
    for where, at_limit in (("where they carry nothing", True), (f"at {end}", False)):
        add(
            f"largest horizontal tension of a brick by the window {where}, MPa",
            lambda ds: number(MPA * AroundWindow.of(ds, -1).horizontal),
            None,
            below,
            at_limit,
        )
        add(
            f"perpends broken under the sill {where}",
            lambda ds: str(AroundWindow.of(ds, -1).cracked_under_sill),
            None,
            test.get("under_sill"),
            at_limit,
        )


def _said(value: object) -> str:
    if value is None:
        return NOT_KNOWN
    return number(value) if isinstance(value, float) else str(value)


def markdown(found: list[Row]) -> list[str]:
    """Return the table of one or more cases in markdown."""
    lines = [
        "| quantity | test | paper's model | " + " | ".join(LABELS.values()) + " |",
        "|---" * (3 + len(LABELS)) + "|",
    ]
    lines += ["| " + " | ".join([r.quantity, r.test, r.paper, *r.ours.values()]) + " |" for r in found]
    return lines


def write_csv(found: list[Row], file: Path) -> None:
    """Write all rows."""
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["case", "quantity", "test", "paper", *LABELS])
        for row in found:
            writer.writerow([row.case, row.quantity, row.test, row.paper, *row.ours.values()])
