"""Shapes of the footing against independent solutions of the beam, and fragility curves of synthetic walls."""

import numpy as np
import pytest
import xarray as xr
from scipy import special
from scipy.integrate import cumulative_simpson

import damagepred
from damagepred import Movement, Scene, Solver, Wall, fit_fragility
from damagepred.damage.table import load_table
from tests.verification.manual import Verify, chapter

closed_form = chapter("Footing and fragility")

BEAM = closed_form(
    title="Footing beam under three equal loads at the quarter points",
    formula="E I w'' = -M(x),   w(0) = w(L) = 0;   δ = 19 P L³/(384 E I),   w(L/4)/δ = 27/38,   w'(0) = (60/19) δ/L",
    source="Euler-Bernoulli beam on two supports, its equation integrated numerically (Simpson, 4000 pieces a half); "
    "the closed forms follow from integrating by hand.",
)
ARC = closed_form(
    title="Footing on a circular arc",
    formula="(x - L/2)² + (w - w_c)² = R²,   through both ends and δ above them in the middle",
    source="The three points satisfy the circle's equation: R by linear algebra.",
)
GROUND = closed_form(
    title="Wall that follows its footing",
    formula="opening of the footing interface + displacement of the ground = displacement of the wall's underside",
    source="Kinematics; the ground's displacement from the beam of the first check.",
    note="A flexible wall: its first course rests on the ground everywhere, so it takes the ground's shape, to the "
    "closing of the joint.",
)
FRAGILITY = closed_form(
    title="Fragility of walls whose cracks grow with the movement",
    formula="w = c d X,  X = LN(0, β):   P(category >= k) = Φ(ln(c d/w_k)/β),   median w_k/c,   dispersion β",
    source="Derived; w_k: limits of AS 2870-2011 Table C1 (0.1, 1, 5, 15 mm).",
    note="4000 walls at the quantiles (i + 1/2)/4000 of X, so nothing is left to chance; each wall's category is known "
    "at the increments only.",
)


def beam_under_three_loads(xi: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Return the deflection over that of the middle, P L³/(E I δ) and δ'(0) L/δ, by integrating twice."""
    x = np.linspace(0.0, 0.5, 4001)  # symmetric: the slope of the middle is 0
    moment = 1.5 * x - np.maximum(x - 0.25, 0.0)  # in P L
    slope = cumulative_simpson(-moment, x=x, initial=0)
    slope -= slope[-1]
    deflection = cumulative_simpson(slope, x=x, initial=0)
    middle = deflection[-1]
    return np.interp(np.minimum(xi, 1 - xi), x, deflection) / middle, 1 / middle, slope[0] / middle


def test_figures_of_the_footing(verify: Verify) -> None:
    shape, stiffness, slope = beam_under_three_loads(np.array([0.25]))
    profile = Movement(kind="doming", central_deflection=1.0).profile
    step = 1e-7
    computed = [profile(np.array([0.25]), 1.0)[0], profile(np.array([step]), 1.0)[0] / step]
    verify(BEAM, "L = 1, δ = 1", "profile", "w(L/4) and w'(0)", computed, [27 / 38, 60 / 19], 1e-6)
    computed = [shape[0], slope, stiffness]
    verify(BEAM, "L = 1, δ = 1", "beam equation", "w(L/4), w'(0) and P", computed, [27 / 38, 60 / 19, 384 / 19], 1e-9)


@pytest.mark.parametrize(("length", "deflection"), [(6.0, 8e-3), (6.0, 1.0), (10.0, 1e-3)])
def test_the_arc_is_a_circle(verify: Verify, length: float, deflection: float) -> None:
    movement = Movement(kind="doming", shape="arc", central_deflection=deflection)
    x = np.linspace(0.0, length, 61)
    w = movement.profile(x, length)
    # x² + w² = 2 a x + 2 b w + c through the three points
    points = np.array([[0.0, 0.0], [length, 0.0], [length / 2, deflection]])
    a, b, c = np.linalg.solve(np.column_stack((2 * points, np.ones(3))), (points**2).sum(axis=1))
    case = f"L = {length:g} m, δ = {1e3 * deflection:g} mm"
    verify(ARC, case, "profile", "deflection (m)", w, b + np.sqrt(c + a**2 + b**2 - (x - a) ** 2), 1e-6)


@pytest.mark.parametrize("kind", ["dishing", "doming"])
def test_a_flexible_wall_follows_its_footing(verify: Verify, kind: str) -> None:
    wall = Wall(length=4.8, height=0.15)
    scene = Scene(wall=wall, movement=Movement(kind=kind, central_deflection=2e-4, increments=2))
    ds = damagepred.solve(scene, solver=Solver(blocks="rigid", tolerance=1e-9)).isel(increment=-1)
    ground = ds["contact_kind"].values == 3
    x = ds["contact_x"].values[ground]
    shape, _, _ = beam_under_three_loads(x / wall.length)
    rise = shape * 2e-4 * (1 if kind == "doming" else -1)
    underside = np.empty_like(x)
    for i, place in enumerate(x):
        inside = (np.abs(ds["block_x"].values - place) <= wall.block_length / 2 + 1e-9) & (
            ds["block_course"].values == 0
        )
        moved = ds["block_displacement_y"].values + ds["block_rotation"].values * (place - ds["block_x"].values)
        opening = ds["contact_opening"].values[ground][i]
        underside[i] = moved[inside][np.abs(moved[inside] - rise[i] - opening).argmin()]
    case = f"{kind}, 4.8 m x 0.15 m, δ = 0.2 mm"
    computed = underside - ds["contact_opening"].values[ground]
    verify(GROUND, case, "quasi_static", "underside less opening (m)", computed, rise, 1e-6)


@pytest.mark.parametrize("dispersion", [0.2, 0.45, 0.8])
@pytest.mark.parametrize("slope", [0.05, 0.4, 2.0])
def test_fragility_is_recovered(verify: Verify, slope: float, dispersion: float) -> None:
    limits = np.array(load_table("as2870").limits)
    count, end, increments = 4000, 20e-3, 80
    factor = np.exp(dispersion * special.ndtri((np.arange(count) + 0.5) / count))
    movement = np.arange(increments + 1) * end / increments
    width = slope * movement * factor[:, None]
    both = ("sample", "increment")
    ds = xr.Dataset(
        {
            "damage_category": (both, load_table("as2870").by_width(width)),
            "status": ("sample", np.zeros(count, dtype=np.int8)),
            "central_deflection": (both, np.tile(movement, (count, 1)), {"units": "m"}),
        }
    )
    # those that at least 5 % of the walls reach, none of them before the fifth increment
    median = limits / slope
    seen = [
        k + 1
        for k, m in enumerate(median)
        if special.ndtr(np.log(end / m) / dispersion) > 0.05
        and special.ndtr(np.log(movement[5] / m) / dispersion) < 0.3
    ]
    curves = fit_fragility(ds, categories=seen, bootstrap=0, points=41)
    case = f"c = {slope:g}, β = {dispersion:g}, categories {', '.join(map(str, seen))}, to {1e3 * end:g} mm"
    who = "maximum likelihood"
    # beyond the movement of the walls the fit is told apart, and the median is its lower bound
    fitted = np.where(curves["median"] < end, curves["median"], curves["median_extrapolated"])
    ratio, one = fitted / median[np.array(seen) - 1], np.ones(len(seen))
    verify(FRAGILITY, case, who, "medians over exact ones", ratio, one, 5e-3)
    verify(FRAGILITY, case, who, "dispersions", curves["dispersion"].values, dispersion * one, 5e-3)
    d, found = curves["intensity"].values, curves["probability"].values
    with np.errstate(divide="ignore"):
        exact = special.ndtr(np.log(d / median[np.array(seen) - 1][:, None]) / dispersion)
    verify(FRAGILITY, case, who, "probability, error in probability itself", found, exact, 2e-3, scale=1.0)
