import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.archive.schema import VARIABLES
from damagepred.scene import BlockMaterial, Damage, Dpc, Footing, Joint, Loads, Movement, Opening, Scene, Solver, Wall

WALL = Wall(length=1.2, height=0.3)
RIGID = Solver(blocks="rigid")


@pytest.fixture(scope="session")
def cracked() -> xr.Dataset:
    """A tiny wall of weak mortar that cracks, without dpc."""
    joint = Joint(tensile_strength=0.001e6, cohesion=0.003e6)
    movement = Movement(kind="doming", central_deflection=6e-3, increments=3)
    scene = Scene(title="weak little wall", wall=WALL, joint=joint, movement=movement, solver=RIGID)
    return damagepred.solve(scene)


@pytest.fixture(scope="session")
def on_dpc() -> xr.Dataset:
    """A tiny wall on a dpc that separates, with a window that reaches its top."""
    scene = Scene(
        title="little wall on a dpc",
        wall=WALL,
        dpc=Dpc(course=1),
        opening=(Opening(x=0.48, y=0.15, width=0.24, height=0.15),),
        movement=Movement(kind="dishing", central_deflection=6e-3, increments=3),
        damage=Damage(dpc_threshold=0.2e-3),
        solver=RIGID,
    )
    return damagepred.solve(scene)


@pytest.fixture(scope="session")
def deformable() -> xr.Dataset:
    """A tiny wall of deformable bricks below its dpc, rigid ones above, some of whose zones yield."""
    scene = Scene(
        title="soft foot",
        wall=Wall(length=0.96, height=0.3),
        block=BlockMaterial(cohesion=12e3, friction=0.3, tensile_strength=2e3),
        dpc=Dpc(course=2),
        movement=Movement(kind="doming", central_deflection=1e-3, increments=2),
        loads=Loads(roof=2000.0),
        solver=Solver(method="explicit", below_dpc="deformable", zone_size=0.04, tolerance=1e-2),
    )
    return damagepred.solve(scene)


@pytest.fixture(scope="session")
def on_jacks() -> xr.Dataset:
    """A tiny wall on a dpc on a footing on jacks, dishing until they carry no load."""
    return damagepred.solve(_on_footing("dishing", "jacks"))


@pytest.fixture(scope="session")
def on_mound() -> xr.Dataset:
    """The same on a mound that grows under its middle."""
    return damagepred.solve(_on_footing("doming", "mound"))


def _on_footing(kind: str, shape: str) -> Scene:
    return Scene(
        title="little wall on a footing",
        wall=WALL,
        dpc=Dpc(course=1),
        footing=Footing(width=0.1, depth=0.05, elastic_modulus=1e9),
        movement=Movement(kind=kind, shape=shape, central_deflection=0.2e-3, increments=4),
        solver=RIGID,
    )


@pytest.fixture
def study() -> xr.Dataset:
    """Eight synthetic walls: cracks grow linearly; one collapsed, one failed, one is missing."""
    deflection = np.tile(np.linspace(0.0, 40e-3, 5), (8, 1))
    width = deflection * np.linspace(0.05, 0.4, 8)[:, None]
    category = np.searchsorted([0.1e-3, 1e-3, 5e-3, 15e-3], width, side="right").astype(np.int8)
    status = np.zeros(8, dtype=np.int8)
    status[:3] = 1, 2, 3
    for sample, known in ((0, 2), (1, 3), (2, 0)):
        width[sample, known:], category[sample, known:] = np.nan, -1
    both = ("sample", "increment")
    ds = xr.Dataset(
        {
            "crack_width_max": (both, width, VARIABLES["crack_width_max"].attributes()),
            "damage_category": (both, category, VARIABLES["damage_category"].attributes()),
            "status": (("sample",), status, VARIABLES["status"].attributes()),
            "joint.tensile_strength": (("sample",), np.linspace(0.2e6, 0.6e6, 8), {"units": "Pa", "role": "input"}),
        },
        coords={
            "central_deflection": (both, deflection, VARIABLES["central_deflection"].attributes()),
            "deflection_ratio": (both, deflection / 6.0, VARIABLES["deflection_ratio"].attributes()),
        },
        attrs={"title": "eight walls", "damage_table": "AS 2870-2011 Table C1"},
    )
    return ds


@pytest.fixture
def curves() -> xr.Dataset:
    """Synthetic fragility curves: two fitted, one not."""
    x = np.linspace(0.0, 40e-3, 21)
    rise = np.stack([np.clip(x / m, 0.0, 1.0) for m in (20e-3, 60e-3)] + [np.full(21, np.nan)])
    both = ("category", "intensity")
    return xr.Dataset(
        {
            "probability": (both, rise),
            "probability_lower": (both, 0.8 * rise),
            "probability_upper": (both, np.minimum(1.2 * rise, 1.0)),
            "median": (("category",), [10e-3, 60e-3, np.nan]),
            "dispersion": (("category",), [0.4, 0.35, np.nan]),
            "fit_status": (("category",), ["fitted", "fitted", "never reached"]),
        },
        coords={
            "category": [1, 2, 3],
            "category_name": ("category", ["very_slight", "slight", "moderate"]),
            "intensity": ("intensity", x, {"long_name": "central deflection", "units": "m"}),
        },
        attrs={"title": "fragility of eight walls", "confidence": 0.9, "samples": 8, "samples_failed": 1},
    )
