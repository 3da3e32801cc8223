"""Collapse of dry walls: both solvers against limit analysis by linear programming, and that against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

import damagepred
from damagepred.scene import Solver
from tests.verification.dry_walls import DryWall, arch, box, leaning, portal, running_bond
from tests.verification.limit_analysis import collapse_factor
from tests.verification.manual import Verify, chapter

closed_form = chapter("Limit analysis")

BLOCK = closed_form(
    title="Limit analysis of one block, and of a leaning wall",
    formula="block: λ = min(μ, b/h);   courses that lean by tan β against the push: λ = (μ - tan β)/(1 + μ tan β)",
    source="Coulomb; the weight leaves the base. Sliding of all that is above a bed joint.",
    note="A check of the linear program itself.",
)
SEMICIRCLE = closed_form(
    title="Thinnest semicircular arch under its own weight",
    formula="t/R = 0.1075   (R: radius of the middle line; radial joints, weight where it is)",
    source="Milankovitch, Z. Math. Phys. 55 (1907); Ochsendorf, Struct. Engineer 84 (2006).",
    note="For infinitely many voussoirs. With n of them hinges form at joints only and the arch may be a little "
    "thinner; the solvers are judged by the linear program for the same n. No equilibrium found counts as fallen.",
)
FERRIS = closed_form(
    title="Dry wall of Ferris and Tin-Loi, example 1",
    formula="λ = 0.640 (joints that do not dilate), 0.643 (that do: limit analysis)",
    source="Ferris and Tin-Loi, Int. J. Mech. Sci. 43 (2001) 209-224: 33 blocks of 400 x 175 mm in 6 courses, half "
    "blocks at the ends of the lowest, μ = 0.65, horizontal force λ times the weight.",
    note="Computed is the largest factor at which the solver found an equilibrium, the load growing from nothing.",
)
PUSHED = closed_form(
    title="Dry walls pushed over",
    formula="max λ:  equilibrium of every block under dead load + λ live load,   n >= 0,  |t| <= μ n",
    source="Static theorem of limit analysis, by linear programming (scipy.optimize.linprog, HiGHS); own geometry, "
    "nothing shared with the solvers.",
    note="Limit analysis takes joints to dilate as they slide; the solvers' do not, and where walls both turn and "
    "slide they may fall a little earlier, never later. Computed is the largest factor at which an equilibrium was "
    "found. Near its limit the explicit solver may neither settle nor fall; what it has not settled counts as not "
    "standing, and its load grows in 200 steps.",
)

FERRIS_WALL = DryWall("33 blocks", running_bond(6, 5, 0.4, 0.175, True), 0.65)
WALLS = (
    (0.27, DryWall("portal: piers 5 x (300 x 300), 1.2 m apart, lintel", portal(5, 1.2, 0.3, 0.3, 0.3), 0.3)),
    (0.5, DryWall("arch of 11 voussoirs, R 1.0 to 1.2 m, 149°", arch(13, 1.0, 1.2, 2.6), 0.4, (0, 12))),
    (0.4, DryWall("arch of 11 voussoirs, loaded on the fourth", arch(13, 1.0, 1.2, 2.6), 0.3, (0, 12), "load", 4)),
    (0.37, DryWall("panel 0.8 m x 14 courses of 175 mm", running_bond(14, 2, 0.4, 0.175, True), 0.3)),
    (0.5, DryWall("panel 0.8 m x 10 courses of 175 mm", running_bond(10, 2, 0.4, 0.175, True), 0.4)),
    (0.27, DryWall("panel 1.2 m x 12 courses of 175 mm", running_bond(12, 3, 0.4, 0.175, True), 0.2)),
    (
        0.27,
        DryWall("panel 1.2 m x 5 courses, leaning by 0.1", leaning(running_bond(5, 3, 0.4, 0.175, True), -0.1), 0.3),
    ),
)
"""How far the explicit solver pushes, somewhere beyond the fall, and the wall."""


def limit(wall: DryWall) -> float:
    """Return the factor at which a wall falls, by linear programming."""
    return collapse_factor(wall.blocks, set(wall.held), wall.friction, *wall.loads())


def standing(wall: DryWall, solver: Solver, top: float) -> float:
    """Return the largest factor on the live load, up to ``top``, at which a solver finds an equilibrium."""
    top = top * 1.5 if solver.method == "quasi_static" else top  # further beyond it sees more clearly that all falls
    assembly = wall.assembly()
    if wall.push == "sideways":
        assembly.push_body(x=top)
    else:
        assembly.push(wall.loaded, y=top * wall.loads()[1][wall.loaded, 1])
    # the quasi-static solver brackets the collapse itself; the explicit one continues in steps until it does not
    # converge
    increments = 1 if solver.method == "quasi_static" else 200
    settings = solver
    if solver.method == "explicit":
        # at the limit contacts open and close; with the default step 14 courses alternate between sticking and slipping
        # above 1e-4
        settings = replace(solver, tolerance=1e-4, time_step_safety=0.5)
    ds = damagepred.solve(assembly, solver=settings, increments=increments, on_failure="return")
    assert ds.attrs["status"] in ("collapsed", "failed")
    if ds.attrs["status"] == "collapsed":
        return top * ds.attrs["collapse_progress"]
    return top * (ds.sizes["increment"] - 1) / increments


@pytest.mark.parametrize(("b", "h", "friction"), [(0.3, 1.0, 0.2), (0.3, 1.0, 0.4), (1.0, 0.5, 0.7)])
def test_linear_program_for_one_block(verify: Verify, b: float, h: float, friction: float) -> None:
    wall = DryWall("block", [box(-1.0, -1.0, 3.0, 1.0), box(0.0, 0.0, b, h)], friction)
    case = f"b = {b:g} m, h = {h:g} m, μ = {friction:g}"
    verify(BLOCK, case, "linear program", "λ", limit(wall), min(friction, b / h), 1e-9)


def semicircle(voussoirs: int, ratio: float) -> DryWall:
    """Return a semicircular arch of mean radius 1 m between two abutments, to be loaded by a share of its weight."""
    blocks = arch(voussoirs + 2, 1 - ratio / 2, 1 + ratio / 2, np.pi)
    return DryWall("", blocks, 0.7, (0, voussoirs + 1))


def thinnest(voussoirs: int) -> float:
    """Return t/R of the thinnest arch that stands, by linear programming."""
    low, high = 0.09, 0.12
    while high - low > 1e-5:
        middle = (low + high) / 2
        try:
            limit(semicircle(voussoirs, middle))
        except ValueError:  # no equilibrium even without the push
            low = middle
        else:
            high = middle
    return high


@pytest.mark.parametrize("voussoirs", [pytest.param(300, marks=pytest.mark.slow)])
def test_the_thinnest_arch(verify: Verify, voussoirs: int) -> None:
    verify(SEMICIRCLE, f"n = {voussoirs}, μ = 0.7", "linear program", "t/R", thinnest(voussoirs), 0.1075, 1e-3)


@pytest.mark.parametrize("offset", [-0.03, 0.03])
@pytest.mark.parametrize("voussoirs", [15, pytest.param(40, marks=pytest.mark.slow)])
def test_an_arch_too_thin_falls(verify: Verify, solver: Solver, voussoirs: int, offset: float) -> None:
    bound = thinnest(voussoirs)
    assembly = semicircle(voussoirs, bound * (1 + offset)).assembly()
    settings = solver
    if solver.method == "explicit":
        # at the limit contacts open and close; with the default step 14 courses alternate between sticking and slipping
        # above 1e-4
        settings = replace(solver, tolerance=1e-4, time_step_safety=0.5)
    try:
        status = damagepred.solve(assembly, solver=settings, increments=1).attrs["status"]
    except damagepred.SolverError:
        status = "no equilibrium"
    case = f"n = {voussoirs}, μ = 0.7, t {1 + offset:g} times the thinnest of n ({bound:.4f} R)"
    computed = "stands" if status == "complete" else "falls"
    verify(SEMICIRCLE, case, solver.method, "verdict", computed, "stands" if offset > 0 else "falls")


def test_linear_program_for_ferris_and_tin_loi(verify: Verify) -> None:
    verify(FERRIS, "33 blocks, dilating joints", "linear program", "λ", limit(FERRIS_WALL), 0.643, 1e-3)


@pytest.mark.parametrize("method", ["quasi_static", pytest.param("explicit", marks=pytest.mark.thorough)])
def test_ferris_and_tin_loi(verify: Verify, method: str) -> None:
    solver = Solver(method=method, lump_block_elasticity=False)
    verify(FERRIS, "33 blocks", solver.method, "λ", standing(FERRIS_WALL, solver, 0.83), 0.640, 0.03)


@pytest.mark.parametrize(
    ("wall", "top", "method"),
    [
        pytest.param(
            wall, top, method, marks=() if method == "quasi_static" or i == 0 else pytest.mark.slow, id=f"{method}-{i}"
        )
        for method in ("explicit", "quasi_static")
        for i, (top, wall) in enumerate(WALLS)
        if method == "quasi_static" or len(wall.blocks) < 30
    ],
)
def test_a_dry_wall_is_pushed_over(verify: Verify, wall: DryWall, top: float, method: str) -> None:
    """The explicit solver takes minutes near the limit of more than 30 blocks."""
    solver = Solver(method=method, lump_block_elasticity=False)
    exact = limit(wall)
    words = "pushed sideways" if wall.push == "sideways" else "loaded by a share of its weight"
    case = f"{wall.name}, {words}, μ = {wall.friction:g}"
    verify(PUSHED, case, method, "λ", standing(wall, solver, top), exact, 0.01 if method == "quasi_static" else 0.02)
