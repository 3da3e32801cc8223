"""Common parts of the checks of the footing: the beam alone, its solution, and the equivalent Timoshenko beam."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model, footing_alone
from damagepred.enumerations import ContactKind
from damagepred.scene import Footing, Mound, Movement, Rig, Scene, Soil, Solver, Wall
from damagepred.solvers import Increment, solve_path

GRAVITY = 9.81


@dataclass(frozen=True)
class Strip:
    """A footing: length, width, depth (m), E (Pa), density (kg/m3), Poisson's ratio 0.2."""

    name: str
    length: float
    width: float
    depth: float
    modulus: float
    density: float = 2400.0

    def __str__(self) -> str:
        size = f"{self.length:g} m, {1e3 * self.width:g} x {1e3 * self.depth:g} mm"
        return f"{size}, E {self.modulus / 1e6:g} MPa"

    @property
    def bending(self) -> float:
        """E I (N m2)."""
        return self.modulus * self.width * self.depth**3 / 12

    @property
    def shear(self) -> float:
        """kappa G A (N) of a rectangle, kappa = 5/6."""
        return 5 / 6 * self.modulus / (2 * 1.2) * self.width * self.depth

    @property
    def line_weight(self) -> float:
        """Own weight (N/m)."""
        return GRAVITY * self.density * self.width * self.depth

    def scene(self, movement: Movement, pieces: int, **tables: Any) -> Scene:
        """Return a scene with this footing, divided into a number of segments."""
        step = self.length / pieces
        wall = Wall(length=self.length, height=0.075, block_length=step, bond="stack")
        footing = Footing(
            width=self.width,
            depth=self.depth,
            elastic_modulus=self.modulus,
            density=self.density,
            poisson_ratio=0.2,
            segment_length=step,
        )
        return Scene(wall=wall, footing=footing, movement=movement, **tables)

    def on_jacks(self, kind: str, deflection: float, pieces: int, *, load: float = 0.0, **rig: Any) -> Model:
        """Return the model of the footing alone on a rig, with a line load (N/m) besides its weight."""
        movement = Movement(kind=kind, shape="jacks", central_deflection=deflection)
        return footing_alone(self.scene(movement, pieces, rig=Rig(**rig)), load)

    def on_soil(
        self,
        stiffness: float,
        pieces: int,
        *,
        kind: str = "doming",
        load: float = 0.0,
        mound: Mound | None = None,
        friction: float = 0.0,
    ) -> Model:
        """Return the model of the footing alone on soil (Pa/m), by default smooth and one that does not move."""
        soil = Soil(
            swelling_stiffness=stiffness,
            shrinking_stiffness=stiffness,
            shear_stiffness=stiffness if friction else max(1e-3 * stiffness, 1e4),
            friction=friction,
        )
        movement = Movement(kind=kind, shape="mound")
        still = mound or Mound(surface_movement=0.0)
        return footing_alone(self.scene(movement, pieces, soil=soil, mound=still), load)


SLENDER = Strip("slender", 12.0, 0.3, 0.1, 25e9)
PAPER = Strip("paper's", 6.0, 0.3, 0.3, 7e9, 2130.0)
STOCKY = Strip("stocky", 3.0, 0.4, 0.9, 30e9)
STRIPS = (SLENDER, PAPER, STOCKY)


def path_of(model: Model, solver: Solver, increments: int = 1, **settings: Any) -> list[Increment]:
    """Return the path of a model; for a stiff beam on soft soil the explicit solver needs many cycles."""
    if solver.method == "explicit":
        settings = {"tolerance": 1e-5, "maximum_cycles": 1_000_000} | settings
    return list(solve_path(model, replace(solver, **settings), increments))


def with_force(model: Model, x: float, force: float) -> Model:
    """Return the model with a dead load (N, downwards) at a place on it (m)."""
    blocks, load = model.blocks, model.supports.load.copy()
    block = int(np.abs(blocks.x - x).argmin())
    load[3 * block + 1] -= force
    load[3 * block + 2] -= force * (x - blocks.x[block])
    return replace(model, supports=model.supports._replace(load=load))


def level(model: Model, increment: Increment, x: FloatArray | float) -> FloatArray:
    """Return how far the axis of the beam has gone up at places x (m); where segments meet, the mean of the two."""
    blocks = model.blocks
    half = np.diff(blocks.x).max() / 2
    places = np.atleast_1d(np.asarray(x, dtype=float))
    moved = increment.displacement
    found = np.empty(len(places))
    for i, place in enumerate(places):
        here = np.abs(blocks.x - place) <= half * (1 + 1e-6)
        found[i] = np.mean(moved[here, 1] + moved[here, 2] * (place - blocks.x[here]))
    return found


def reactions(model: Model, increment: Increment, kind: ContactKind) -> tuple[FloatArray, FloatArray]:
    """Return places (m) and upward forces (N) of the contacts with the ground of one kind."""
    face = model.interfaces
    own = face.kind == kind
    place = face.x[own, None] + face.normal_y[own, None] * face.contact_offset[own]
    return place.ravel(), -(increment.normal_stress[own] * face.contact_area[own]).ravel()


def moments(model: Model, increment: Increment) -> tuple[FloatArray, FloatArray]:
    """Return places (m) and bending moments (N m, sagging positive) of the sections between segments."""
    face = model.interfaces
    own = np.flatnonzero(face.kind == ContactKind.FOOTING_SECTION)
    turn = increment.displacement[face.block_b[own], 2] - increment.displacement[face.block_a[own], 2]
    # about the section's middle: stress times arm, taken from the contacts; opening at the underside is sagging
    tangent_y = -face.normal_x[own]
    arm = tangent_y[:, None] * face.contact_offset[own]
    moment = -(increment.normal_stress[own] * face.contact_area[own] * arm).sum(axis=1)
    assert (np.sign(turn) == np.sign(moment))[np.abs(moment) > 1e-6 * np.abs(moment).max()].all()
    return face.x[own], moment
