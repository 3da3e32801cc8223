"""Model discrepancy of crack widths, fitted on the cases of the validation.

    python studies/validation/discrepancy.py

reads the scores of the cases, and writes ``data/statistics/discrepancy.toml`` and the table of the README. It takes a
second; `run.py` makes the scores.

The likelihood is that of ``damagepred infer``: an observed width is normal about that of a wall. Its variance is the
sum of the observation's, of `width` squared and of `width_share` times the width squared. It is averaged over the
predicted walls. Widths of one case share its error: the log likelihoods of one case are averaged, so that each case
counts once.
Both standard deviations have priors that are uniform in their logarithms.
"""

from __future__ import annotations

import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import special, stats

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from damagepred.arrays import FloatArray  # noqa: E402
from damagepred.inputs.data_files import data_file  # noqa: E402
from damagepred.uq.discrepancy import Discrepancy  # noqa: E402
from damagepred.uq.observations import CrackObservation  # noqa: E402
from damagepred.uq.survey_likelihood import CrackPrediction, series_fit  # noqa: E402
from studies.pages import put_in  # noqa: E402

MARKS = "<!-- written by discrepancy.py -->", "<!-- end of discrepancy -->"


@dataclass(frozen=True)
class Prior:
    """Ranges of the standard deviations, and how finely they are divided.

    Attributes
    ----------
    width : (float, float)
        Range of the absolute one (m).
    share : (float, float)
        Range of the share of the width.
    points : int
        Points of each range.
    walls : int
        Quantiles that stand for the predicted walls.
    """

    width: tuple[float, float] = (5e-5, 2e-3)
    share: tuple[float, float] = (0.05, 3.0)
    points: int = 61
    walls: int = 64


class Width(NamedTuple):
    """A width that was predicted and observed (m)."""

    case: str
    quantity: str
    observed: float
    error: float
    predicted: FloatArray


def _from_psi(psi: FloatArray) -> FloatArray:
    """Return the width (m) of one crack with a value of Psi = 2 n^0.15 c^0.3, c in mm (Korswagen 2024)."""
    return 1e-3 * (np.asarray(psi) / 2.0) ** (1.0 / 0.3)


def widths(prior: Prior) -> list[Width]:
    """Return the observed crack widths of all cases, with the walls predicted for them.

    The scores have the 5 and 95 % quantiles; the walls are lognormal between and beyond them.
    """
    found = []
    for case, quantity, factor in (
        ("spandrels", "opening at the peak", 1e-6),
        ("shear_wall", "Psi at a drift of 0.41 per mille", None),
        ("shear_wall", "Psi at a drift of 0.68 per mille", None),
        ("ramsgate", "front wall: widest crack", 1e-3),
        ("bryant", "doming: opening of the dpc at the ends", 1e-3),
    ):
        rows = pd.read_csv(HERE / case / "scores.csv")
        row = rows[(rows.quantity == quantity) & rows.blind].iloc[0]
        low, high = np.log([row.predicted_5, row.predicted_95])
        normal = stats.norm.ppf((np.arange(prior.walls) + 0.5) / prior.walls) / stats.norm.ppf(0.95)
        values = np.exp(0.5 * (low + high) + 0.5 * (high - low) * normal)
        seen, scatter = float(row.observed_mean), np.nan_to_num(float(row.observed_cov))
        error = seen * scatter / np.sqrt(row.observations)
        if factor is None:
            found.append(Width(case, quantity, float(_from_psi(np.array(seen))), 0.0, _from_psi(values)))
        else:
            found.append(Width(case, quantity, factor * seen, factor * error, factor * values))
    return found


class Posterior(NamedTuple):
    """Quantiles of both standard deviations, arrays (5 %, median, 95 %), correlation of their logarithms, and cases."""

    width: FloatArray
    share: FloatArray
    correlation: float
    cases: int


def fit(seen: list[Width], prior: Prior) -> Posterior:
    """Return the posterior of both standard deviations on a grid."""
    grid = [np.geomspace(*ends, prior.points) for ends in (prior.width, prior.share)]
    total = np.zeros((prior.points, prior.points))
    cases = sorted({one.case for one in seen})
    for case in cases:
        own = [one for one in seen if one.case == case]
        for one in own:
            crack = CrackObservation(width=one.observed, error=one.error)
            walls = CrackPrediction(one.predicted, one.predicted)
            for i, width in enumerate(grid[0]):
                for j, share in enumerate(grid[1]):
                    model = Discrepancy(width=width, width_share=share)
                    total[i, j] += special.logsumexp(series_fit([crack], [walls], model).log_likelihood) / len(own)
    weight = special.softmax(total)
    logs = np.array([part.ravel() for part in np.meshgrid(*map(np.log, grid), indexing="ij")])
    covariance = np.cov(logs, aweights=weight.ravel())
    found = []
    for points, own_weight in ((grid[0], weight.sum(axis=1)), (grid[1], weight.sum(axis=0))):
        middle = (np.cumsum(own_weight) - 0.5 * own_weight) / own_weight.sum()
        found.append(np.exp(np.interp([0.05, 0.5, 0.95], middle, np.log(points))))
    return Posterior(*found, float(covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])), len(cases))


def data_text(found: Posterior) -> str:
    """Return the text of the data file."""
    text = data_file("statistics", "discrepancy.toml").read_text(encoding="utf-8")
    kept = {name: one for name, one in tomllib.loads(text).items() if one["confidence"] == "assumed"}
    lines = [
        "# Standard deviations of the model against real walls, as `damagepred infer` takes them. The derived ones",
        "# come from `python studies/validation/discrepancy.py`, which writes this file anew.",
        "# low and high: interval of 90 %. correlation: of the logarithms with those of another term.",
    ]
    source = f"{found.cases} cases of studies/validation, each of which counts once"
    for name, (low, value, high), unit in (("width", found.width, "m"), ("width_share", found.share, "1")):
        ends = f"low = {low:.2g}\nhigh = {high:.2g}"
        lines.append(f'\n[{name}]\nvalue = {value:.2g}\nunit = "{unit}"\n{ends}\nsource = "{source}"')
        lines.append('confidence = "derived"')
    lines.append(f"correlation = {{ width = {found.correlation:.2g} }}")
    for name, one in kept.items():
        lines.append(f'\n[{name}]\nvalue = {one["value"]:g}\nunit = "{one["unit"]}"\nsource = "{one["source"]}"')
        lines.append('confidence = "assumed"')
    return "\n".join(lines) + "\n"


def page_text(seen: list[Width], found: Posterior) -> str:
    """Return the table of the page."""
    lines = [
        "| case | quantity | seen, mm | predicted: median, 5 to 95 %, mm |",
        "|---|---|---|---|",
        *(
            f"| {one.case} | {one.quantity} | {1e3 * one.observed:.3g} | {1e3 * np.median(one.predicted):.3g}, "
            f"{1e3 * np.quantile(one.predicted, 0.05):.3g} to {1e3 * np.quantile(one.predicted, 0.95):.3g} |"
            for one in seen
        ),
    ]
    width, share = 1e3 * found.width, found.share
    lines.append("")
    lines.append(
        f"Standard deviation of a width: {width[1]:.2g} mm (90 % interval {width[0]:.2g} to {width[2]:.2g}) and "
        f"{share[1]:.2g} of the width ({share[0]:.2g} to {share[2]:.2g}), added in squares. The correlation of "
        f"their logarithms is {found.correlation:.2g}; {found.cases} cases."
    )
    return "\n".join(lines)


def main() -> None:
    """Fit, and write the data file and the table of the page."""
    prior = Prior()
    seen = widths(prior)
    found = fit(seen, prior)
    data_file("statistics", "discrepancy.toml").write_text(data_text(found), encoding="utf-8")
    text = page_text(seen, found)
    print(text)
    put_in(HERE / "README.md", text, *MARKS)


if __name__ == "__main__":
    main()
