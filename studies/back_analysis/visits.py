"""Coverage of the intervals of rate and forecast, for walls and histories that are in no archive.

The walls are formulas, so that many surveys can be judged in minutes: a crack opens in proportion to the movement
beyond the wall's own start, a tilt in proportion to all of it. Each case is a new wall with a history drawn from the
prior; its survey has the errors and the discrepancy that the likelihood assumes.
"""

from __future__ import annotations

import datetime as dt
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from damagepred.analyses.inference_options import DEFAULT, InferenceOptions
from damagepred.analyses.posterior_dataset import over_time
from damagepred.analyses.posterior_states import states_of
from damagepred.analyses.stored_walls import StoredWalls
from damagepred.arrays import FloatArray
from damagepred.uq.discrepancy import Discrepancy
from damagepred.uq.history import PARAMETERS, History, drawn_histories, years_from
from damagepred.uq.observations import CrackObservation, MonitorSeries, Observations, SlopeObservation
from damagepred.uq.survey_likelihood import OWN_SHARE

README = Path(__file__).with_name("README.md")
LARGEST, INCREMENTS, STORED, LAST = 10e-3, 20, 80, dt.date(2026, 1, 1)
VISITS = [dt.date(2020, 1, 1), dt.date(2021, 7, 1), dt.date(2023, 3, 1), dt.date(2024, 10, 1), LAST]
MONTHS = [LAST - dt.timedelta(days=90 * k) for k in range(12, -1, -1)]
CATEGORY = 2
START, END = "<!-- written by visits.py -->", "<!-- end of visits -->"
SURVEYS = (
    ("five visits", "steady", 120),
    ("five visits", "steady step", 120),
    ("monitor", "steady step", 80),
    ("monitor", "seasonal", 60),
)


class Formulas(StoredWalls):
    """Walls whose crack and tilt are formulas of the movement."""

    def __post_init__(self) -> None:
        """Draw the walls."""
        random = np.random.default_rng(1)
        self.slope, self.start, self.lean = drawn_walls(STORED, random)
        self.movement = np.linspace(0.0, LARGEST, INCREMENTS + 1) * np.ones((STORED, 1))
        width, tilt = responses(self.movement, self.slope[:, None], self.start[:, None], self.lean[:, None])
        state = ("sample", "increment")
        category = np.searchsorted([1e-3, 5e-3, 15e-3], width).astype(np.int8)
        self.ds = xr.Dataset(
            {"crack_width_max": (state, width), "tilt_max": (state, tilt), "damage_category": (state, category)}
        )
        middle = 0.5 * (self.movement[:, 1:] + self.movement[:, :-1])
        self.edges = np.concatenate((self.movement[:, :1], middle, self.movement[:, -1:]), axis=1)
        self.known, self.weight, self.units = np.ones(STORED, dtype=bool), np.full(STORED, 1 / STORED), "m"


def drawn_walls(count: int, random: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Slope of the crack over the movement, movement at which it opens (m), tilt over movement (1/m)."""
    slope, lean = (np.exp(0.4 * random.standard_normal(count)) for _ in range(2))
    return 0.8 * slope, 1.5e-3 * random.random(count), 1.0 * lean


def responses(movement: FloatArray, slope: Any, start: Any, lean: Any) -> tuple[FloatArray, FloatArray]:
    """Width of the crack (m) and tilt."""
    return slope * np.maximum(movement - start, 0.0), lean * movement


def survey(
    kind: str, days: list[dt.date], width: FloatArray, tilt: FloatArray, random: np.random.Generator
) -> dict[str, Any]:
    """Observations with errors; the discrepancy is drawn from the fit and common to all visits but for a share."""
    fitted = Discrepancy()
    model = fitted.at(random.standard_normal(len(fitted.uncertain)))
    common = np.sqrt(1.0 - OWN_SHARE**2) * random.standard_normal(2)[:, None]
    error = 1e-4 if kind == "monitor" else 2e-4
    spread = np.sqrt(model.width**2 + (model.width_share * width) ** 2)
    own = np.hypot(error, OWN_SHARE * spread) * random.standard_normal(len(days))
    lean = np.abs(
        tilt + common[1] * model.slope + np.hypot(5e-4, OWN_SHARE * model.slope) * random.standard_normal(len(days))
    )
    slopes = tuple(SlopeObservation(date=d, value=v) for d, v in zip(days, lean))
    if kind == "monitor":
        change = (width - width[0] + common[0] * (spread - spread[0]) + own)[1:]
        monitor = MonitorSeries(date=tuple(days), change=(0.0, *change), error=error)
        return {"monitor": (monitor,), "tilt": slopes[-1:]}
    seen = width + common[0] * spread + own
    limit = {"none": True, "visible": 3e-4, "error": error}
    cracks = [{"width": w, "error": error} if w > 3e-4 else limit for w in seen]
    return {"crack": tuple(CrackObservation(date=d, **c) for d, c in zip(days, cracks)), "tilt": slopes}


def cases(
    visits: str, kinds: tuple[str, ...], count: int, seed: int, options: InferenceOptions = DEFAULT
) -> dict[str, FloatArray]:
    """Whether intervals of 90 % hold the truth, probability and truth of the category, effective samples (cases,)."""
    walls, random, rows = Formulas(Path("formulas.dp")), np.random.default_rng(seed), []
    days = MONTHS if visits == "monitor" else VISITS
    prior = History(kind=kinds)
    for _ in range(count):
        kind = int(random.integers(len(kinds)))
        past = drawn_histories(
            prior, kind, random.random((1, max(PARAMETERS.values()))), years_from(LAST, days)[0], LAST
        )
        now, wall = random.uniform(0.0, LARGEST), drawn_walls(1, random)
        reached, _, part = (values[0] for values in past.at(years_from(LAST, days)))
        seen = Observations(
            history=prior, **survey(visits, days, *(part * v for v in responses(now * reached, *wall)), random)
        )
        states = states_of(walls, seen, None, 1, options, None)
        found = over_time(walls, seen, states, options, 3)
        until = years_from(LAST, prior.forecast_dates(LAST))
        later, moved, _ = (values[0] for values in past.at(until))
        truth = [(found["rate_quantile"], now * past.slope[0])]
        truth += [(found["forecast_quantile"][k], now * moved[k]) for k in range(len(until))]
        held = [float(q[0]) <= true <= float(q[-1]) for q, true in truth]
        width = responses(now * later, *wall)[0]
        chance = found["forecast_probability_lower"].values[:, CATEGORY - 1]
        rows.append((*held, chance[1], width[1] > 5e-3, states.effective))
    names = ("rate", "1 year", "5 years", "10 years", "chance", "reached", "effective")
    return dict(zip(names, np.array(rows, dtype=np.float64).T))


def main() -> None:
    """Write the table into the README."""
    lines = [
        "| survey | history | cases | rate | 1 year | 5 years | 10 years | effective histories |",
        "|" + "---|" * 8,
    ]
    for visits, kinds, count in SURVEYS:
        found = cases(visits, tuple(kinds.split()), count, 2)
        held = " | ".join(f"{found[name].mean():.2f}" for name in ("rate", "1 year", "5 years", "10 years"))
        effective = f"{np.median(found['effective']):.0f}"
        lines.append(f"| {visits} | {kinds.replace(' ', ', ')} | {count} | {held} | {effective} |")
        print(lines[-1], flush=True)
    text = README.read_text(encoding="utf-8")
    head, rest = text.split(START)
    table = "\n".join(lines)
    README.write_text(f"{head}{START}\n\n{table}\n\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    main()
