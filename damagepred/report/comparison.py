"""Comparison of a study with studies of measures, such as a control joint or a deeper footing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from damagepred.analyses.stored_walls import study_name
from damagepred.archive.folder import open_study
from damagepred.errors import InputError
from damagepred.formatting import chance, with_band
from damagepred.report.answers import comparison_answer
from damagepred.report.parts import Part, Text
from damagepred.report.summary import doubtful_category
from damagepred.results.tables import Table
from damagepred.uq.comparison import compare
from damagepred.uq.exceedance import Exceedance
from damagepred.uq.movement_distribution import MovementDistribution


def comparison_parts(
    path: Path,
    ds: xr.Dataset,
    measures: Sequence[Path],
    at: MovementDistribution,
    found: Mapping[int, Exceedance],
    confidence: float,
) -> list[Part]:
    """Sentence and table on the probability of the category in doubt in each study; empty without measures."""
    category = doubtful_category(found)
    if not measures or category is None:
        return []
    names = [study_name(each) for each in (path, *measures)]
    if len(set(names)) < len(names):
        needed = f"each study needs a name of its own, other than {names[0]}"
        raise InputError(f"measures = {', '.join(names[1:])}: {needed}.")
    studies = dict(zip(names, (ds, *map(open_study, measures))))
    comparison = compare(studies, categories=[category], at=[at], confidence=confidence)
    rows = []
    for name in names:
        one = comparison.sel(study=name).squeeze()
        cells = [
            with_band(*(f(float(one[f"{kind}{end}"])) for end in ("", "_lower", "_upper")))
            for kind, f in (("probability", chance), ("difference", _signed))
        ]
        rows.append([name, cells[0], cells[1] if name != names[0] else "–", str(studies[name].attrs.get("title", ""))])
    head = ["study", f"probability ({confidence:.0%} interval)", "change", "wall"]
    caption = f"Category {category} or worse with each measure"
    answer = comparison_answer(comparison, category, float(comparison["movement"][0]))
    return [Text([answer]), Table(caption, head, rows, words=(0, 3))]


def _signed(value: float) -> str:
    return "–" if not np.isfinite(value) else f"{value:+.2f}".replace("-", "−")
