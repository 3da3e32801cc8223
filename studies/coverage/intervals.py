"""Synthetic samples with known true values, and the intervals that the toolkit gives for them.

A case draws samples and returns, for each quantity, the interval's ends and the true value; both ends NaN where the
toolkit gives no interval.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import numpy as np
import xarray as xr
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.uq.estimate import probability
from damagepred.uq.exceedance import exceedance
from damagepred.uq.fragility import fit_fragility, fit_surface
from damagepred.uq.samplers import unit_points
from damagepred.uq.sensitivity import sensitivity_indices
from damagepred.uq.stopping import StopWhen, interim_confidence, interim_sizes
from damagepred.uq.subset import subset_simulation

Found = dict[str, tuple[float, float, float]]
"""Lower end, upper end, true value, by quantity."""

Case = Callable[[np.random.Generator], Found]

BOOTSTRAP = 500
"""Resamples of an interval; the command line takes 1000."""

DAMAGED = (3, 5, 20)
"""Walls that reach the category, on average."""


def seed_of(random: np.random.Generator) -> int:
    """Return a seed."""
    return int(random.integers(2**31))


# -- fragility curves -------------------------------------------------------------------------------------------------


def paths(capacity: FloatArray, end: float, increments: int) -> xr.Dataset:
    """Return a study whose walls reach category 1, 2, ... at given movements, array (walls,) or (walls, categories)."""
    movement = np.linspace(0.0, end, increments + 1)
    each = capacity.reshape(len(capacity), -1)
    category = (movement[None, :, None] >= each[:, None, :]).sum(axis=2).astype(np.int8)
    count = len(each)
    return xr.Dataset(
        {
            "damage_category": (("sample", "increment"), category),
            "central_deflection": (("sample", "increment"), np.tile(movement, (count, 1)), {"units": "m"}),
            "status": ("sample", np.zeros(count, dtype=np.int8)),
        },
        attrs={"highest_category": each.shape[1]},
    )


def _ends(curve: xr.Dataset, median: float, dispersion: float) -> Found:
    """Return the intervals of a curve: at 0.8 of the movement also that of the probability."""
    at = float(curve["intensity"][4])
    truth = {
        "median": median,
        "dispersion": dispersion,
        "probability": float(special.ndtr(np.log(at / median) / dispersion)),
    }
    found = {}
    for name, value in truth.items():
        one = curve.isel(intensity=4) if name == "probability" else curve
        found[name] = (float(one[f"{name}_lower"]), float(one[f"{name}_upper"]), value)
    return found


def curve(
    random: np.random.Generator,
    damaged: int,
    share: float,
    *,
    median: float = 8e-3,
    dispersion: float = 0.4,
    increments: int = 40,
    weighted: bool = False,
) -> Found:
    """Give a lognormal curve of walls of which a given share is damaged at the end."""
    walls = round(damaged / share)
    end = median * np.exp(dispersion * special.ndtri(min(share, 0.9995)))
    normal, weight = random.standard_normal(walls), np.ones(walls)
    if weighted:  # half of the walls are sampled one standard deviation weaker
        shifted = random.random(walls) < 0.5
        normal = normal - shifted
        weight = 1.0 / (0.5 + 0.5 * np.exp(-normal - 0.5))
    ds = paths(median * np.exp(dispersion * normal), end, increments)
    if weighted:
        ds["weight"] = ("sample", weight)
    fitted = fit_fragility(ds, categories=[1], bootstrap=BOOTSTRAP, seed=seed_of(random), points=6)
    return _ends(fitted.isel(category=0), median, dispersion)


def common(random: np.random.Generator, walls: int, dispersion: float = 0.4) -> Found:
    """Give three curves of one dispersion; the second is evaluated."""
    medians = 8e-3 * np.array([1.0, 1.6, 2.4])
    capacity = medians * np.exp(dispersion * random.standard_normal(walls))[:, None]
    ds = paths(capacity, 20e-3, 40)
    fitted = fit_fragility(ds, model="common", bootstrap=BOOTSTRAP, seed=seed_of(random), points=6)
    return _ends(fitted.isel(category=1), float(medians[1]), dispersion)


def empirical(random: np.random.Generator, walls: int) -> Found:
    """Give a nonparametric curve."""
    ds = paths(8e-3 * np.exp(0.4 * random.standard_normal(walls)), 15e-3, 30)
    one = fit_fragility(ds, model="empirical", bootstrap=BOOTSTRAP, seed=seed_of(random), points=31).isel(category=0)
    found = {"median": (float(one["median_lower"]) - 0.5e-3, float(one["median_upper"]), 8e-3)}  # known to an increment
    for place, name in ((6, "probability 0.04"), (12, "probability 0.31"), (24, "probability 0.84")):
        at = one.isel(intensity=place)
        truth = float(special.ndtr(np.log(float(at["intensity"]) / 8e-3) / 0.4))
        found[name] = (float(at["probability_lower"]), float(at["probability_upper"]), truth)
    return found


def counted(random: np.random.Generator, each: int, model: str = "separate") -> Found:
    """Give curves of walls that are each observed at one of five movements."""
    movement = np.array([4e-3, 6e-3, 9e-3, 13e-3, 20e-3])
    medians, dispersion = np.array([8e-3, 14e-3]), 0.5
    capacity = medians * np.exp(dispersion * random.standard_normal((5, each)))[:, :, None]
    category = (movement[:, None, None] >= capacity).sum(axis=2)
    ds = xr.Dataset(
        {
            "damage_category": ("sample", category.astype(np.int8).ravel()),
            "status": ("sample", np.zeros(category.size, dtype=np.int8)),
            "central_deflection": ("sample", np.repeat(movement, each), {"units": "m"}),
        },
        attrs={"highest_category": 2},
    )
    fitted = fit_fragility(ds, model=model, bootstrap=BOOTSTRAP, seed=seed_of(random), points=6)  # type: ignore[arg-type]
    return _ends(fitted.isel(category=0), float(medians[0]), dispersion)


def surface(random: np.random.Generator, walls: int, slope: float = 0.7) -> Found:
    """Give a surface against a second variable."""
    strength = np.exp(0.3 * random.standard_normal(walls))
    ds = paths(8e-3 * strength**slope * np.exp(0.4 * random.standard_normal(walls)), 14e-3, 40)
    ds["joint.cohesion"] = ("sample", strength)
    found = fit_surface(ds, 1, "joint.cohesion", bootstrap=BOOTSTRAP, seed=seed_of(random), points=(6, 5))
    z = float(found["second"][2])
    at = float(found["intensity"][4])
    middle = found.isel(second=2)
    truth = {
        "slope": (found, slope),
        "dispersion": (found, 0.4),
        "median": (middle, 8e-3 * z**slope),
        "probability": (middle.isel(intensity=4), float(special.ndtr(np.log(at / (8e-3 * z**slope)) / 0.4))),
    }
    return {k: (float(one[f"{k}_lower"]), float(one[f"{k}_upper"]), value) for k, (one, value) in truth.items()}


def own_movements(random: np.random.Generator, walls: int) -> Found:
    """Give a probability from walls that are each observed at an individual movement."""
    at = random.uniform(2e-3, 20e-3, walls)
    hit = (at >= 8e-3 * np.exp(0.4 * random.standard_normal(walls))).astype(np.int8)
    ds = xr.Dataset(
        {
            "damage_category": ("sample", hit),
            "central_deflection": ("sample", at),
            "status": ("sample", np.zeros(walls, dtype=np.int8)),
        },
        attrs={"highest_category": 1},
    )
    e = exceedance(ds, 1, 6e-3).estimate
    return {"probability": (e.lower, e.upper, float(special.ndtr(np.log(6 / 8) / 0.4)))}


# -- probabilities ----------------------------------------------------------------------------------------------------


def binomial(random: np.random.Generator, walls: int, share: float) -> Found:
    """Give a share of random walls."""
    e = probability(random.random(walls) < share)
    return {"probability": (e.lower, e.upper, share)}


def scrambles(random: np.random.Generator, walls: int, share: float) -> Found:
    """Give a share of Sobol points of eight scrambles."""
    u = unit_points("sobol", 3, walls, seed_of(random), 8)
    normal = (special.ndtri(u).sum(axis=1) + random.standard_normal(walls)) / 2.0
    e = probability(normal < special.ndtri(share), replicate=np.arange(walls) % 8)
    return {"probability": (e.lower, e.upper, share)}


def importance(random: np.random.Generator, walls: int, beta: float, shift: float, nominal: float = 0.0) -> Found:
    """Give a small share of weighted walls: two normals in one direction, the proposal's mean shifted."""
    z = random.standard_normal((walls, 2))
    along = z.sum(axis=1) / np.sqrt(2)
    moved = random.random(walls) >= nominal
    z = z + (moved * shift / np.sqrt(2))[:, None]
    along = z.sum(axis=1) / np.sqrt(2)
    weight = 1.0 / (nominal + (1 - nominal) * np.exp(shift * along - shift**2 / 2))
    e = probability(along > beta, weight=weight)
    return {"probability": (e.lower, e.upper, float(special.ndtr(-beta)))}


def stopped(random: np.random.Generator, share: float, half_width: float = 0.05) -> Found:
    """Give a share of the walls that a stopping rule requires."""
    rule = StopWhen(category=1, at=0.01, half_width=half_width)
    at = interim_sizes(32, 2048)
    each = _each(tuple(at))
    hit = random.random(2048) < share
    found = [probability(hit[:n], confidence=each) for n in at]
    e = next((one for one in found if rule.met(one)), found[-1])
    return {"probability": (e.lower, e.upper, share)}


@cache
def _each(at: tuple[int, ...]) -> float:
    return interim_confidence(list(at), 0.9, replicated=False)


def linear(z: FloatArray, _: object) -> FloatArray:
    """Return margins of one region."""
    return np.asarray(3.0 - z.sum(axis=1) / np.sqrt(z.shape[1]))


def two_regions(z: FloatArray, _: object) -> FloatArray:
    """Return margins of two regions, equally likely, to either side."""
    return np.asarray(3.2 - np.abs(z.sum(axis=1)) / np.sqrt(z.shape[1]))


def second_region(z: FloatArray, _: object) -> FloatArray:
    """Return margins of two equally likely regions, one of which appears only at late levels."""
    return np.minimum(3.3 - z[:, 0], 0.4 * (3.3 - z[:, 1]) + 0.6 * np.maximum(2.6 - z[:, 1], 0.0))


def late_region(z: FloatArray, _: object) -> FloatArray:
    """Return margins of two equally likely regions, one of which has few samples at early levels."""
    return np.minimum(3.3 - z[:, 0], 5.0 * (3.3 - z[:, 1]))


EXACT = {
    "one region": special.ndtr(-3.0),
    "two regions": 2 * special.ndtr(-3.2),
    "second region": 1 - special.ndtr(3.3) ** 2,
    "late region": 1 - special.ndtr(3.3) ** 2,
}
MARGINS = {"one region": linear, "two regions": two_regions, "second region": second_region, "late region": late_region}


def subset(random: np.random.Generator, kind: str, dimensions: int, samples: int = 200, runs: int = 5) -> Found:
    """Give a small probability by subset simulation."""
    e = subset_simulation(MARGINS[kind], dimensions, samples=samples, seed=seed_of(random), runs=runs)
    return {"probability": (e.lower, e.upper, float(EXACT[kind]))}


# -- sensitivity ------------------------------------------------------------------------------------------------------

_EFFECTS = np.array([1.0, 0.6, 0.0])
_NOISE = 0.7


def _output(x: FloatArray, random: np.random.Generator) -> FloatArray:
    return np.asarray(x @ _EFFECTS + _NOISE * random.standard_normal(len(x)))


@cache
def _true_ranks() -> dict[str, FloatArray]:
    random = np.random.default_rng(0)
    x = random.standard_normal((400_000, 3))
    found = sensitivity_indices({n: x[:, k] for k, n in enumerate("abc")}, _output(x, random), resamples=0)
    return {key: found[key].values for key in ("spearman", "partial")}


def ranks(random: np.random.Generator, walls: int) -> Found:
    """Give rank correlations of an output with three inputs."""
    x = random.standard_normal((walls, 3))
    found = sensitivity_indices({n: x[:, k] for k, n in enumerate("abc")}, _output(x, random), seed=seed_of(random))
    return {
        f"{key} {name}": (float(found[f"{key}_lower"][k]), float(found[f"{key}_upper"][k]), float(truth[k]))
        for key, truth in _true_ranks().items()
        for k, name in ((0, "strong"), (2, "none"))
    }


def shares(random: np.random.Generator, walls: int) -> Found:
    """Give shares of variance of three inputs from given walls."""
    x = random.standard_normal((walls, 3))
    found = sensitivity_indices({n: x[:, k] for k, n in enumerate("abc")}, _output(x, random), seed=seed_of(random))
    truth = _EFFECTS**2 / (_EFFECTS @ _EFFECTS + _NOISE**2)
    return {
        name: (float(found["first_order_lower"][k]), float(found["first_order_upper"][k]), float(truth[k]))
        for k, name in ((0, "strong"), (1, "weak"), (2, "none"))
    }


# -- all of them ------------------------------------------------------------------------------------------------------


def cases() -> dict[tuple[str, str], Case]:
    """Return all cases, by interval and samples."""
    found: dict[tuple[str, str], Case] = {}
    for n in DAMAGED:
        for share, words in ((1.0, "all"), (0.5, "half"), (0.1, "a tenth")):
            found["curve", f"{n} damaged, {words} of the walls"] = partial(curve, damaged=n, share=share)
    five = partial(curve, damaged=5, share=0.5)
    found["curve", "5 damaged, half, median 2 mm, dispersion 0.2"] = partial(five, median=2e-3, dispersion=0.2)
    found["curve", "5 damaged, half, median 30 mm, dispersion 0.9"] = partial(five, median=30e-3, dispersion=0.9)
    found["curve", "5 damaged, half, 10 increments"] = partial(five, increments=10)
    found["curve, weighted", "5 damaged, half"] = partial(five, weighted=True)
    for n in (4, 12):
        found["curve, one movement a wall", f"5 stripes of {n}"] = partial(counted, each=n)
        found["curve, one movement a wall, common", f"5 stripes of {n}"] = partial(counted, each=n, model="common")
    for n in (20, 30):
        found["curve, common dispersion", f"{n} walls"] = partial(common, walls=n)
    for n in (20, 60):
        found["curve, empirical", f"{n} walls"] = partial(empirical, walls=n)
    for n in (8, 60):
        found["surface", f"{n} walls"] = partial(surface, walls=n)
    for n in (30, 200):
        found["estimate, each wall its own movement", f"{n} walls"] = partial(own_movements, walls=n)
    for n in (20, 200):
        for p in (0.02, 0.2):
            found["estimate, random walls", f"{n} walls, probability {p:g}"] = partial(binomial, walls=n, share=p)
    for n in (64, 256):
        for p in (0.02, 0.2):
            found["estimate, 8 scrambles", f"{n} walls, probability {p:g}"] = partial(scrambles, walls=n, share=p)
    for n in (64, 300):
        for beta, shift, nominal in ((2.0, 2.0, 0.0), (3.0, 3.0, 0.1), (3.0, 2.0, 0.1), (3.0, 4.0, 0.1)):
            name = f"{n} walls, index {beta:g}, shift {shift:g}, nominal share {nominal:g}"
            found["estimate, importance", name] = partial(importance, walls=n, beta=beta, shift=shift, nominal=nominal)
    for p in (0.05, 0.1, 0.4):
        found["stopped early", f"probability {p:g}"] = partial(stopped, share=p)
    for d in (2, 50, 500):
        found["subset simulation", f"one region, {d} dimensions"] = partial(subset, kind="one region", dimensions=d)
    for kind in ("two regions", "second region", "late region"):
        found["subset simulation", f"{kind}, 2 dimensions"] = partial(subset, kind=kind, dimensions=2)
    found["subset simulation", "second region, 100 dimensions"] = partial(subset, kind="second region", dimensions=100)
    for n in (30, 100):
        found["rank correlation", f"{n} walls"] = partial(ranks, walls=n)
        found["shares of variance", f"{n} walls"] = partial(shares, walls=n)
    return found
