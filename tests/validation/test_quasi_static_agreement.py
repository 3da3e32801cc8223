"""The quasi-static solver gives what the explicit one gives under slow loading, in any number of increments."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.enumerations import ContactKind
from damagepred.scene import BlockMaterial, Dpc, Joint, Loads, Movement, Opening, Scene, Solver, Wall

QUASI_STATIC = Solver(method="quasi_static")
SLOW = Solver(method="explicit", tolerance=1e-4, ramp_cycles=10_000)
DPC = 2


def random_scene(number: int) -> Scene:
    """Any wall of 0.7-3 m whose mortar does not break."""
    rng = np.random.default_rng([7, number])
    length, height = round(float(rng.uniform(0.7, 3.0)), 2), round(float(rng.uniform(0.5, 1.2)), 2)
    opening: tuple[Opening, ...] = ()
    shape = rng.integers(0, 3) if length > 1.4 else 0
    left, width = round(float(rng.uniform(0.25, 0.5)) * length, 2), round(0.25 * length, 2)
    if shape == 1:
        opening = (Opening(x=left, y=round(0.3 * height, 2), width=width, height=round(0.35 * height, 2)),)
    if shape == 2:
        opening = (Opening(kind="door", x=left, width=width, height=round(0.7 * height, 2)),)
    block_length = float(rng.choice([0.24, 0.3, 0.4]))
    block_height = float(rng.choice([0.075, 0.1, 0.15]))
    bond = rng.choice(["running", "stack"])
    wall = Wall(length=length, height=height, block_length=block_length, block_height=block_height, bond=bond)
    dpc = Dpc(course=int(rng.integers(1, 3)), friction=float(rng.uniform(0.3, 0.7)))
    joint = Joint(
        normal_stiffness=float(rng.uniform(20e9, 100e9)),
        shear_stiffness=float(rng.uniform(8e9, 40e9)),
        tensile_strength=100e6,
        cohesion=200e6,
        friction=float(rng.uniform(0.5, 0.9)),
    )
    block = BlockMaterial(elastic_modulus=float(rng.uniform(3e9, 15e9)), density=float(rng.uniform(1600, 2200)))
    movement = Movement(
        kind=rng.choice(["dishing", "doming"]),
        central_deflection=length * float(rng.uniform(0.2e-3, 1.5e-3)),
        increments=4,
        shape=rng.choice(["parabola", "arc", "three_loads"]),
    )
    loads = Loads(roof=float(rng.choice([0.0, 1000.0, 6000.0])))
    return Scene(wall=wall, opening=opening, dpc=dpc, joint=joint, block=block, movement=movement, loads=loads)


def off_by(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def compare(scene: Scene, increments: int | None = None, slow: Solver = SLOW) -> None:
    quasi = damagepred.solve(scene, solver=QUASI_STATIC, increments=increments)
    slowly = damagepred.solve(scene, solver=slow, increments=increments)
    on_dpc = quasi["contact_kind"].values == DPC
    strong = quasi["contact_tensile_strength"].values > 0
    # the dpc apart, nothing brittle happens, so that the path is unique
    assert not (quasi["contact_state"].values == 1)[:, strong].any()
    last = {"increment": -1}
    for name in ("contact_normal_stress", "contact_shear_stress"):
        assert off_by(quasi[name][last].values, slowly[name][last].values) < 0.01, name
    opening = [np.maximum(ds["contact_opening"][last].values[on_dpc], 0.0) for ds in (quasi, slowly)]
    assert opening[1].max() > 1e-6, "nothing opened"
    assert off_by(*opening) < 0.01
    np.testing.assert_allclose(quasi["base_reaction"], slowly["base_reaction"], rtol=1e-3)
    slips = [slip_without_drift(ds.isel(last), on_dpc) for ds in (quasi, slowly)]
    assert off_by(*slips) < 0.01


def slip_without_drift(end: xr.Dataset, on_dpc: np.ndarray) -> np.ndarray:
    """Slip along the dpc, less its mean: the wall above may translate."""
    slip = end["contact_slip"].values[on_dpc]
    return slip - slip.mean()


@pytest.mark.parametrize("number", [1, 6, 8, 10, 14])
def test_random_walls(number: int) -> None:
    compare(random_scene(number))


DATA = Path(__file__).resolve().parents[2] / "data"


def bryant(name: str, dpc: bool = True) -> Scene:
    scene = Scene.from_toml(DATA / f"{name}.toml")
    return replace(scene, solver=QUASI_STATIC, dpc=scene.dpc if dpc else None)


@pytest.mark.quick_cases
@pytest.mark.parametrize(
    ("name", "dpc"), [("bryant_dishing", True), ("bryant_dishing", False), ("bryant_doming", True)]
)
def test_the_number_of_increments_does_not_matter(name: str, dpc: bool) -> None:
    scene = bryant(name, dpc)
    ends = [damagepred.solve(scene, increments=n).isel(increment=-1) for n in (5, 20, 80)]
    widest = "dpc_opening_max" if dpc else "crack_width_max"
    for end in ends[1:]:
        assert float(end[widest]) == pytest.approx(float(ends[0][widest]), rel=2e-3)
        other = (end["contact_state"].values == 1) != (ends[0]["contact_state"].values == 1)
        # a contact of the dpc where the wall begins to rest may open between two increments, and shut again
        assert (end["contact_kind"].values[other] == ContactKind.DPC).all()
        assert float(end["contact_length"].values[other].sum()) < 0.01 * scene.wall.length
