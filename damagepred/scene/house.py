"""House: walls in plan on joined strip footings, over one surface of the ground."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from pydantic import Field, model_validator

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.scene.described import described, takes_number
from damagepred.scene.keys import require_own_names, step_names
from damagepred.scene.materials import Loads
from damagepred.scene.mound import REACTIVE, Mound
from damagepred.scene.movement import Movement
from damagepred.scene.movement_stage import OPPOSITE, Kind
from damagepred.scene.plan import Corner, Junction, PlanWall, junctions
from damagepred.scene.plan_ground import GroundSource, Outline, PlanMound, check_grid, drift, rise
from damagepred.scene.scene import Scene
from damagepred.scene.wall import Wall

OF_EACH_WALL = ("opening", "control_joint", "load")  # tables that a house has per wall
OF_ALL_WALLS = tuple(f.name for f in fields(Wall) if f.name != "length" and takes_number(Wall, [f.name]))
"""Lengths (m) that are one key where all walls share them, such as ``wall.thickness``."""
ROOF = "loads.roof: belongs to one wall; write [wall.loads] roof = '3 kN/m' below its [[wall]]"
POINTS_ALONG = 101  # points of the ground along each wall, in the scene of the wall alone
NOT_IN_A_HOUSE = ("support", "loading", "strain", "creep", "dynamics")  # tables of one wall alone


@described
class House(Scene):
    """Description of a house; its file has a ``[[wall]]`` per wall, and the other tables of a scene.

    Each wall stays in its plane, with two displacements and a rotation per block, on its own strip footing on soil.
    Walls that meet pass vertical shear (``[corner]``); footings that meet move up and down together. The ground is one
    surface over the plan, which each wall reads along its axis.

    Examples
    --------
    >>> from damagepred.scene import House
    >>> plan = {"left": [0, 4], "front": [0, 0], "right": [6, 0], "back": [6, 4]}
    >>> ends = [*plan.values(), [0, 4]]
    >>> walls = [{"name": name, "start": ends[k], "end": ends[k + 1]} for k, name in enumerate(plan)]
    >>> house = House.from_dict({"wall": walls})
    >>> house.scenes[1].wall.length, sorted(junction.point for junction in house.junctions)
    (6.0, [(0.0, 0.0), (0.0, 4.0), (6.0, 0.0), (6.0, 4.0)])
    """

    title: str = "masonry house"
    wall: tuple[PlanWall, ...]  # type: ignore[assignment]
    """The walls; corners and T-joints follow from their ends."""
    corner: Corner = Field(default_factory=Corner)
    """Vertical shear between walls that meet."""
    mound: PlanMound = Field(default_factory=PlanMound)
    """Surface of the ground."""
    source: tuple[GroundSource, ...] = ()
    """Further movements of the ground, which are added."""
    movement: Movement = Field(default_factory=lambda: Movement(shape="mound"))
    """Movement of the ground; only ``shape = "mound"``."""

    @model_validator(mode="after")
    def _fits_together(self) -> House:
        if not self.wall:
            raise ValueError("wall: is an empty list; give the walls of the house, each as [[wall]]")
        require_own_names("wall", self.wall, "walls")
        for name in OF_EACH_WALL:
            if getattr(self, name):
                raise ValueError(f"{name}: belongs to one wall; write it as [[wall.{name}]] below its [[wall]]")
        for name in NOT_IN_A_HOUSE:
            if getattr(self, name):
                raise ValueError(f"{name}: a house has none; leave it out")
        if self.loads.roof:
            raise ValueError(ROOF)
        if self.movement.shape != "mound":
            raise ValueError(
                f"movement.shape = '{self.movement.shape}': the footings of a house lie on soil whose surface moves; "
                "take 'mound'"
            )
        solver = self.solver
        if solver.footing == "deformable" or "deformable" in (solver.blocks, solver.above_dpc, solver.below_dpc):
            raise ValueError("solver: a house has rigid or elastic bricks on beams; leave 'deformable' out")
        _ = self.junctions
        self._take_surface_movement()
        self._ground_in_plan_fits()
        _ = self.scenes
        return self

    def _ground_in_plan_fits(self) -> None:
        self._mound_fits(self.mound, self.movement.kind, "movement.kind")
        if self.source and not self.mound.surface_movement:
            raise ValueError("source: comes in addition to a movement of [mound]; describe one source there")
        require_own_names("source", self.source, "sources")
        for name, source in zip(step_names(self.source), self.source):
            try:
                self._mound_fits(source, source.kind, "kind")
            except ValueError as error:
                raise ValueError(f"source {name}: {str(error).replace('mound.', '')}") from None

    def _mound_fits(self, mound: PlanMound, kind: Kind, key: str) -> None:
        outline = self.outline
        if (kind in ("settle", "heave")) == (mound.shape in REACTIVE):
            words = "'dishing' or 'doming'" if mound.shape in REACTIVE else "'settle' or 'heave'"
            raise ValueError(f"{key} = '{kind}': mound.shape = '{mound.shape}' goes with kind = {words}")
        if self.soil_layer and mound.shape in ("corner", "tilt", "levels"):
            raise ValueError(f"soil_layer: clay gives no movement with mound.shape = '{mound.shape}'; leave it out")
        check_grid(mound, outline)
        if mound.shape in REACTIVE and min(outline.size) > 0.0:
            for axis, end in product((0, 1), outline):
                on_side = [w for w in self.wall if max(abs(p[axis] - end[axis]) for p in (w.start, w.end)) < 1e-3]
                length = sum(w.length for w in on_side)
                if abs(length - outline.size[1 - axis]) > 1e-2:
                    raise ValueError(
                        f"mound.shape = '{mound.shape}': spans a rectangular outline; at {'xy'[axis]} = {end[axis]:g} "
                        f"m walls cover {length:.4g} of {outline.size[1 - axis]:.4g} m. Give the surface as "
                        "shape = 'levels'"
                    )
        if mound.shape == "corner" and mound.point is not None:
            ends = np.array([end for w in self.wall for end in (w.start, w.end)])
            away = np.hypot(*(ends - np.array(mound.point)).T)
            if away.min() > 1e-3:
                x, y = ends[away.argmin()]
                raise ValueError(
                    f"mound.point: lies {away.min():.4g} m off the nearest corner, ({x:g}, {y:g}) m; take that, or "
                    "shape = 'pipe'"
                )

    @property
    def names(self) -> list[str]:
        """Names of the walls."""
        return [wall.name for wall in self.wall]

    @cached_property
    def numbers(self) -> dict[str, float]:
        """All real numbers by key; ``wall.thickness`` is the thickness of all walls where they have the same."""
        shared = {}
        for name in OF_ALL_WALLS:
            values = {getattr(wall, name) for wall in self.wall}
            if len(values) == 1 and isinstance(value := values.pop(), float):
                shared[f"wall.{name}"] = value
        return super().numbers | shared

    def place(self, text: str) -> str:  # noqa: D102
        if text in self._of_all_walls:
            return text
        values = {key: self.numbers[key] for key in self._keys_of_walls(text) & self.numbers.keys()}
        if len(values) > 1:
            low, high = min(values.values()), max(values.values())
            raise InputError(f"'{text}': the walls have {low:g} m to {high:g} m; name one, such as {min(values)}")
        return super().place(text)

    def places(self, text: str) -> set[str]:  # noqa: D102
        return self._keys_of_walls(text) or super().places(text)

    def _keys_of_walls(self, text: str) -> set[str]:
        """Keys of a number of all walls, one per wall; none for other keys."""
        table, _, key = text.partition(".")
        return {f"wall.{name}.{key}" for name in self.names} if table == "wall" and key in OF_ALL_WALLS else set()

    @property
    def _of_all_walls(self) -> set[str]:
        """Keys of numbers that all walls share."""
        return {key for key in self.numbers if key.count(".") == 1 and key.startswith("wall.")}

    def free_tables(self) -> dict[str, Any]:  # noqa: D102
        tables = super().free_tables()
        for wall in tables["wall"]:
            del wall["length"]
        return tables

    def with_values(self, values: Mapping[str, float]) -> Scene:  # noqa: D102
        shared = {key: value for key, value in values.items() if key in self._of_all_walls}
        own = {key: value for key, value in values.items() if key not in shared}
        of_walls = {key.replace("wall.", f"wall.{n}.", 1): v for key, v in shared.items() for n in self.names}
        return super().with_values(of_walls | own)

    @cached_property
    def junctions(self) -> tuple[Junction, ...]:
        """Places where two walls meet."""
        return junctions(self.wall)

    @cached_property
    def outline(self) -> Outline:
        """Rectangle around the axes of the walls."""
        ends = np.array([end for wall in self.wall for end in (wall.start, wall.end)])
        return Outline(tuple(ends.min(axis=0).tolist()), tuple(ends.max(axis=0).tolist()))

    @cached_property
    def scenes(self) -> tuple[Scene, ...]:
        """Each wall as the scene of one wall, without the form of its ground."""
        return tuple(self._scene_of(wall) for wall in self.wall)

    def _scene_of(self, wall: PlanWall) -> Scene:
        own = {name: getattr(wall, name) for name in OF_EACH_WALL}
        own["loads"] = wall.loads or Loads()
        own |= {"block": wall.block or self.block, "joint": wall.joint or self.joint}
        own["head_joint"] = wall.head_joint or (self.head_joint if wall.joint is None else None)
        common = {name: getattr(self, name) for name in ("dpc", "footing", "movement", "soil", "solver", "damage")}
        try:
            return Scene(
                title=f"{self.title}: {wall.name}",
                wall=Wall(**{field.name: getattr(wall, field.name) for field in fields(Wall)}),
                mound=self._ground_along(wall),
                **own,
                **common,
            )
        except InputError as error:
            raise ValueError(f"wall '{wall.name}': {str(error).removeprefix('Scene: ')}") from None

    def _ground_along(self, wall: PlanWall) -> Mound:
        """Ground along a wall at full movement, as a table."""
        share, size = np.linspace(0.0, 1.0, POINTS_ALONG), self.mound.surface_movement
        moved = self.surface(wall.points(share * wall.length))
        fraction = moved / (self.movement.sign * size) if size > 0.0 else 0.0 * moved
        return Mound(shape="table", surface_movement=size, table=tuple(zip(share.tolist(), fraction.tolist())))

    def surface(self, points: FloatArray, factor: float = 1.0) -> FloatArray:
        """Upward displacement (m) of the ground before the footings press it.

        Parameters
        ----------
        points, factor
            Points in plan (..., 2) (m); load factor, below 0 on the side opposite to ``movement.kind``.
        """
        return self._moved(rise, points, factor)

    def _drift(self, points: FloatArray, factor: float = 1.0) -> FloatArray:
        """Horizontal displacement (m) of the ground (..., 2)."""
        return self._moved(drift, points, factor)

    def _moved(self, displacement: Callable[..., FloatArray], points: FloatArray, factor: float) -> FloatArray:
        """Sum of the displacements of the mound and all sources."""
        total: Any = 0.0
        for mound, kind in self._grounds:
            size = abs(factor) * mound.surface_movement
            side = kind if factor >= 0.0 else OPPOSITE[kind]
            total = total + displacement(replace(mound, surface_movement=size), points, self.outline, side)
        return np.asarray(total)

    @property
    def _grounds(self) -> list[tuple[PlanMound, Kind]]:
        return [(self.mound, self.movement.kind), *((source, source.kind) for source in self.source)]

    @property
    def ground_is_proportional(self) -> bool:
        """Whether the surfaces of smaller movements have the same form."""
        lengths = [length for length in self.outline.size if length > 0.0]
        return all(mound.proportional(length, kind) for mound, kind in self._grounds for length in lengths)


def require_one_wall(scene: Scene, what: str) -> None:
    """Refuse a house; ``what`` names the function or command."""
    if isinstance(scene, House):
        raise InputError(f"{what}: takes one wall, and this is a house of {len(scene.wall)}; give one of its `scenes`.")


def house_tables(tables: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Tables of a house with its kind of movement, and loads of the roof per length ("3 kN/m") in all (N)."""
    from damagepred.scene.input_tables import with_roof_in_all
    from damagepred.scene.plan import plan_length

    if isinstance(loads := tables.get("loads"), Mapping) and loads.get("roof"):
        raise InputError(f"{source}: {ROOF}.")
    walls = []
    for wall in tables["wall"]:
        length = plan_length(wall) if isinstance(wall, Mapping) else None
        if length is not None and "loads" in wall:
            both = with_roof_in_all({"wall": {"length": length}, "loads": wall["loads"]})
            wall = {**wall, "loads": both["loads"]}
        walls.append(wall)
    movement = tables.get("movement", {})
    given = {"movement": {"shape": "mound", **movement}} if isinstance(movement, Mapping) else {}
    return {**tables, **given, "wall": walls}
