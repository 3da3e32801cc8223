"""Scene: one wall on one footing, one movement, with solver and damage assessment."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, cached_property, reduce
from itertools import combinations
from math import ceil, floor
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from damagepred.arrays import FloatArray
from damagepred.enumerations import LOCAL
from damagepred.errors import InputError, likely_unit, nearest
from damagepred.inputs.input_files import parse_toml, read_toml
from damagepred.inputs.text import check_title
from damagepred.scene.described import build, completed_by, described, plain, takes_number, unit_of
from damagepred.scene.dynamics import Dynamics
from damagepred.scene.input_tables import profiles_in_metres, with_input_tables, with_roof_in_all
from damagepred.scene.loading import Load, Loading, Support, check_loads, check_test
from damagepred.scene.material_library import with_material
from damagepred.scene.materials import BlockMaterial, Dpc, Footing, HeadJoint, Joint, Loads
from damagepred.scene.mound import Mound
from damagepred.scene.movement import Movement
from damagepred.scene.movement_stage import with_largest_stage
from damagepred.scene.plausibility import require_possible
from damagepred.scene.quantity import to_si, unit_in
from damagepred.scene.rig import Rig
from damagepred.scene.settings import Damage, Report, Solver
from damagepred.scene.settlement import POINTS, signed_size
from damagepred.scene.soil import Soil, SoilLayer, Suction, surface_movement, with_climate_zone
from damagepred.scene.strain import Creep, Strain
from damagepred.scene.wall import EDGE_TOLERANCE, ControlJoint, Opening, Wall, thin_strips

STUDY_KEYS = ("scene", "study", "variables", "correlation")  # keys of study files only


class GivenKeys(frozenset[str]):
    """Keys given in a file, with the units that the user wrote."""

    units: dict[str, str]


SIZES = ("mound.surface_movement", "movement.central_deflection", "movement.settlement")
"""Numbers determined by a soil log or by seasons; a soil log also determines the swing of the seasons."""


@described
class Scene:
    """Description of one wall; the tables of the scene file are its fields.

    Without ``dpc`` the wall has no damp-proof course, and without ``dynamics`` the path is static; every other missing
    table has the paper's values.

    Examples
    --------
    >>> from damagepred import Scene
    >>> scene = Scene.from_dict({"wall": {"length": "6 m", "height": "2.4 m"}, "movement": {"kind": "doming"}})
    >>> scene.wall.length, scene.movement.kind
    (6.0, 'doming')
    >>> weaker = scene.with_values({"joint.cohesion": 0.2e6})
    >>> weaker.joint.cohesion
    200000.0
    """

    title: Annotated[str, AfterValidator(check_title)] = "masonry wall"
    """Description of the wall, for plots and archives."""
    material: str | None = None
    """Masonry of the library, such as "clay brick, Dutch, 1940s"; ``damagepred materials`` lists it. Its values are the
    defaults of ``block``, ``joint`` and ``head_joint``. ``"none"`` removes a fracture energy, a compressive strength, a
    brick's tensile strength, or all of ``head_joint``."""
    wall: Wall = Field(default_factory=Wall)
    block: BlockMaterial = Field(default_factory=BlockMaterial)
    joint: Joint = Field(default_factory=Joint)
    head_joint: HeadJoint | None = None
    dpc: Dpc | None = None
    opening: tuple[Opening, ...] = ()
    control_joint: tuple[ControlJoint, ...] = ()
    footing: Footing = Field(default_factory=Footing)
    movement: Movement = Field(default_factory=Movement)
    rig: Rig = Field(default_factory=Rig)
    soil: Soil = Field(default_factory=Soil)
    soil_layer: tuple[SoilLayer, ...] = ()
    suction: Suction | None = None
    mound: Mound = Field(default_factory=Mound)
    loads: Loads = Field(default_factory=Loads)
    support: tuple[Support, ...] = ()
    load: tuple[Load, ...] = ()
    loading: Loading | None = None
    strain: Strain | None = None
    creep: Creep | None = None
    solver: Solver = Field(default_factory=Solver)
    damage: Damage = Field(default_factory=Damage)
    dynamics: Dynamics | None = None
    report: Report | None = None

    given: ClassVar[GivenKeys | None] = None
    """Keys given in the file, such as "joint.cohesion"; None for a scene without a file."""
    in_metres: ClassVar[tuple[str, ...]] = ()
    """Profiles that are read from a file with positions in metres."""

    _completed = completed_by(lambda tables: with_climate_zone(with_largest_stage(with_material(tables))))

    @model_validator(mode="after")
    def _fits_together(self) -> Scene:
        if isinstance(self.wall, tuple):  # a house as the scene of a study: it has checked itself
            return self
        if self.head_joint is not None:
            self.head_joint.joint(self.joint)  # checks the combination of both
        wall = self.wall
        tolerance = 1e-9 * wall.length
        for number, hole in enumerate(self.opening, start=1):
            name = f"opening {number} ({hole.kind})"
            if hole.right > wall.length + tolerance:
                raise ValueError(
                    f"{name}: x + width = {hole.right:g} m reaches outside the wall, whose length is {wall.length:g} m."
                    + likely_unit(hole.right, wall.length, "m")
                )
            if hole.top > wall.height + tolerance:
                raise ValueError(
                    f"{name}: y + height = {hole.top:g} m reaches outside the wall, whose height is {wall.height:g} m."
                    + likely_unit(hole.top, wall.height, "m")
                )
            if hole.top > (lowest := wall.lowest_top(hole.x, hole.right)) + tolerance:
                raise ValueError(
                    f"{name}: y + height = {hole.top:g} m reaches above the top of the wall there, {lowest:g} m; make "
                    "it lower, or raise wall.top"
                )
            if hole.width >= wall.length - tolerance:
                raise ValueError(f"{name}: width = {hole.width:g} m leaves no wall beside it; make it narrower")
            self._outlives_the_gauge(name, hole)
        for (i, first), (j, second) in combinations(enumerate(self.opening, start=1), 2):
            if first.overlaps(second):
                raise ValueError(
                    f"openings {i} and {j} overlap or touch: x {first.x:g}-{first.right:g} m and "
                    f"{second.x:g}-{second.right:g} m; move one or make them one opening"
                )
        if self.dpc is not None:
            courses = max(1, floor(wall.height / wall.block_height * (1 + 1e-9) + 0.5))
            if self.dpc.course >= courses:
                raise ValueError(
                    f"dpc.course = {self.dpc.course}: the wall has {courses} courses, so the dpc can lie on top of "
                    f"1 to {courses - 1} of them"
                )
        self._dpc_is_in_the_wall()
        self._control_joints_fit()
        self._ground_fits()
        self._test_fits()
        if self.movement.stage and self.movement.shape == "jacks" and self.rig.control == "load":
            raise ValueError("movement.stage: on jacks, stages need rig.control = 'deflection'")
        self._take_surface_movement()
        if self.movement.stage and self.movement.shape == "mound":
            self.movement.require_largest("surface_movement", self.mound.surface_movement)
        self._slow_strains_fit()
        if self.movement.stage and self.dynamics is not None:
            raise ValueError("dynamics: a run in time reads no stages; leave out [dynamics], or [[movement.stage]]")
        size = self.movement.size
        if (self.movement.settles or self._deflection_is_given) and size > 0.1 * wall.length:
            raise ValueError(
                f"{self.movement_key} = {size:g} m: more than a tenth of the "
                f"wall's length ({wall.length:g} m) is outside the small rotations of this model."
                + likely_unit(size, 0.1 * wall.length, "m")
            )
        return self

    def _take_surface_movement(self) -> None:
        """Set the surface movement of the mound by a soil log or seasons."""
        on_mound, seasons = self.movement.shape == "mound", self.movement.seasons
        if self.soil_layer and (not on_mound or (self.movement.stage and seasons is None)):
            raise ValueError(
                "soil_layer: gives the surface movement; needs movement.shape = 'mound', and seasons in place of stages"
            )
        if self.suction is not None and not self.soil_layer:
            raise ValueError("suction: only read with [[soil_layer]]")
        if self.soil_layer and self.mound.shape == "tunnel":
            raise ValueError("soil_layer: clay gives no movement over a tunnel, leave it out")
        if on_mound and (self.soil_layer or seasons is not None):
            if self.soil_layer:
                movement = surface_movement(self.soil_layer, self.suction or Suction(), self.mound.suction_depth)
            if self.soil_layer and seasons is not None:
                swinging = replace(seasons, swing=seasons.swing_share * movement)
                object.__setattr__(self, "movement", replace(self.movement, seasons=swinging))
            if seasons is not None:
                movement = self.movement.largest
            object.__setattr__(self, "mound", replace(self.mound, surface_movement=movement))

    def _outlives_the_gauge(self, name: str, hole: Opening) -> None:
        """Refuse openings, and strips of wall beside them, that are too narrow for joints on both sides."""
        wall = self.wall
        along, up = EDGE_TOLERANCE * wall.block_length / 2, EDGE_TOLERANCE * wall.block_height
        for what, size, least in (
            ("width", hole.width, along),
            ("strip of wall on its left", hole.x, along),
            ("strip of wall on its right", wall.length - hole.right, along),
            ("height", hole.height, up),
            ("strip of wall below it", hole.y, up),
            ("strip of wall above it", wall.lowest_top(hole.x, hole.right) - hole.top, up),
        ):
            if 1e-9 * wall.length < size <= least:
                raise ValueError(
                    f"{name}: the {what} is {size:g} m and would vanish as bricks are laid; take more than {least:g} m"
                )

    def _dpc_is_in_the_wall(self) -> None:
        if self.dpc is None:
            return
        level = self.dpc.course * self.wall.block_height
        for number, hole in enumerate(self.opening, start=1):
            if hole.kind == "window" and hole.y + 0.5 * self.wall.block_height < level < hole.top:
                below = floor(hole.y / self.wall.block_height + 1e-9)
                above = ceil(hole.top / self.wall.block_height - 1e-9)
                raise ValueError(
                    f"dpc.course = {self.dpc.course}: the dpc would lie {level:g} m up, in opening {number} (window), "
                    f"which reaches from {hole.y:g} to {hole.top:g} m; take {below}, below the window, or "
                    f"{above}, above a basement window"
                )

    def _control_joints_fit(self) -> None:
        half = 0.5 * self.wall.block_length * (1 - 1e-9)
        positions = [0.0, *sorted(joint.x for joint in self.control_joint), self.wall.length]
        for number, joint in enumerate(self.control_joint, start=1):
            before, after = positions[positions.index(joint.x) - 1], positions[positions.index(joint.x) + 1]
            if joint.x >= self.wall.length or min(joint.x - before, after - joint.x) < half:
                raise ValueError(
                    f"control joint {number}: x = {joint.x:g} m must lie half a brick ({half:g} m) or more from the "
                    f"ends of the wall (0 and {self.wall.length:g} m) and from other control joints"
                )
        if self.control_joint and self.dynamics is not None:
            raise ValueError(
                "dynamics: a run in time has no control joints; leave out [dynamics], or [[control_joint]]"
            )

    def _ground_fits(self) -> None:
        shape, footing = self.movement.shape, self.solver.footing
        if footing == "beam" and self.movement.prescribed:
            raise ValueError(
                f"solver.footing = 'beam': goes with movement.shape = 'jacks' or 'mound', on which the footing finds "
                f"its own form; here movement.shape = '{shape}'. Take footing = 'none' or 'deformable', or leave it out"
            )
        if footing == "none" and not self.movement.prescribed:
            raise ValueError(
                f"solver.footing = 'none': movement.shape = '{shape}' needs a footing that finds its own form; take "
                "footing = 'beam' or 'deformable', or leave it out"
            )
        if footing == "deformable" and self.footing.concrete is not None:
            raise ValueError(
                "footing.concrete: zones of a footing stay elastic, so it cannot crack with solver.footing = "
                "'deformable'; take footing = 'beam', or leave out [footing.concrete]"
            )
        self.movement.check_settlement(self.wall.length)
        if self.movement.local and not (self.movement.settles or (shape == "mound" and self.mound.shape in LOCAL)):
            raise ValueError(
                f"movement.kind = '{self.movement.kind}': goes with movement.shape = 'mound' and mound.shape = "
                f"{' or '.join(map(repr, LOCAL))}, where the ground moves in one place, or with movement.settlement; "
                f"here movement.shape = '{shape}'"
                + (f" and mound.shape = '{self.mound.shape}'" if shape == "mound" else "")
                + ". Take 'dishing' or 'doming'"
            )
        if shape == "mound" and self.mound.largest(self.movement.kind) > 0.1 * self.wall.length:
            raise ValueError(
                f"mound.surface_movement = {self.mound.surface_movement:g} m: it moves the ground by more than a tenth "
                f"of the wall's length ({self.wall.length:g} m), outside the small rotations of this model."
                + likely_unit(self.mound.surface_movement, 0.1 * self.wall.length, "m")
            )
        if shape == "jacks":
            self.rig.check_places(self.wall.length)
            if self.dynamics is not None:
                raise ValueError(
                    "dynamics: a run in time has no jacks; leave out [dynamics], or take another movement.shape "
                    "than 'jacks'"
                )

    def _test_fits(self) -> None:
        """Check loads and a laboratory test."""
        for key, what in (("soil_layer", "layers"), ("load", "loads")):
            names = step_names(getattr(self, key))
            if twice := [name for name in names if names.count(name) > 1]:
                raise ValueError(f"{key}: two {what} have the name '{twice[0]}'; give each its own")
        shape = self.movement.shape
        for number, load in enumerate(self.load, start=1):
            if not load.sized and shape != "loads":
                raise ValueError(
                    f"load {load.name or number}: has no size; give force, line_load, or pressure and breadth "
                    f"(only movement.shape = 'loads', a test, has loads without a size; here it is '{shape}')"
                )
        check_loads(self.load, self.opening, self.wall)
        if shape != "loads":
            for name in ("support", "loading"):
                if getattr(self, name):
                    raise ValueError(f"{name}: only read with movement.shape = 'loads'; here it is '{shape}'")
            return
        if self.loading is None:
            raise ValueError("loading: is missing; movement.shape = 'loads' needs a controlled quantity")
        if self.footing_model != "none" or self.dynamics is not None:
            raise ValueError("movement.shape = 'loads': a test has no footing and no [dynamics]; leave them out")
        if self.loading.control != "force" and self.solver.method == "explicit":
            raise ValueError(f"loading.control = '{self.loading.control}': the explicit solver takes 'force' only")
        if self.wall.top and self.loading.beam != "none":
            raise ValueError(f"loading.beam = '{self.loading.beam}': lies on a level top; leave it or wall.top out")
        check_test(self.support, self.load, self.wall.length)

    def _slow_strains_fit(self) -> None:
        """Check strains of the bricks and creep of the joints against the movement."""
        strain, creep, history = self.strain, self.creep, self.movement.increments_of_history()
        by_time = creep is not None and creep.relaxation_time is not None
        if self.dynamics is not None and (strain is not None or by_time):
            raise ValueError("strain, creep.relaxation_time: a run in time has none; leave out [dynamics], or these")
        if self.movement.shape == "loads" and (by_time or self.strain_of_increments is not None):
            raise ValueError(
                "strain, creep.relaxation_time: a test in stages has none; leave them out, or [[movement.stage]]"
            )
        timed = history is not None and history.time is not None
        still = history is not None and self.movement.largest == 0.0
        if still and not (by_time or self.strain_of_increments is not None):
            raise ValueError("movement.stage: nothing moves; give a movement, a strain or creep.relaxation_time")
        if history is not None and strain is not None and not timed:
            raise ValueError("strain: in a history each stage needs a time (years); or give the stages a strain each")
        if strain is not None and strain.temperature_swing and history is None:
            raise ValueError("strain.temperature_swing: needs a history, [[movement.stage]] or [movement.seasons]")
        if by_time and not timed:
            raise ValueError("creep.relaxation_time: needs a history whose stages have times (years), or seasons")

    @property
    def strain_of_increments(self) -> FloatArray | None:
        """Strain of the bricks at each increment of a history (increments + 1,), or None."""
        history = self.movement.increments_of_history()
        if history is None or (self.strain is None and history.strain is None):
            return None
        by_stage = np.zeros_like(history.load_factors) if history.strain is None else history.strain
        return by_stage if self.strain is None or history.time is None else by_stage + self.strain.over(history.time)

    @property
    def heads(self) -> Joint:
        """Head joints: the mortar with the values of ``[head_joint]``."""
        return self.joint if self.head_joint is None else self.head_joint.joint(self.joint)

    @property
    def bending(self) -> Literal["dishing", "doming"]:
        """Bending of the wall by the ground; for settle and heave by its middle, relative to the line of the ends."""
        kind, length = self.movement.kind, self.wall.length
        if kind == "dishing" or kind == "doming":
            return kind
        if self.movement.settles:
            x = np.linspace(0.0, length, POINTS)
            return "doming" if signed_size(self.movement.profile(x, length), x, "relative") > 0 else "dishing"
        start, middle, end = self.mound.profile(np.array([0.0, 0.5 * length, length]), length, kind)
        return "doming" if middle > 0.5 * (start + end) else "dishing"

    def ground_rise(self, x: FloatArray, factor: float = 1.0) -> FloatArray:
        """Upward displacement (m) of the ground before the footing presses it.

        Parameters
        ----------
        x, factor
            Distance from the left end of the wall (m); load factor, below 0 on the side opposite to ``movement.kind``.
        """
        movement, length = self.movement, self.wall.length
        if movement.shape != "mound":
            return movement.profile(x, length, factor)
        kind = movement.kind if factor >= 0.0 else movement.other
        return self.mound.at(abs(factor)).profile(x, length, kind)

    def unread(self) -> set[str]:
        """Keys that this movement does not read: no inputs of a report, no assumed values."""
        movement, tables, keys = self.movement, self.to_dict(), set()
        for name, shape in (("rig", "jacks"), ("soil", "mound"), ("mound", "mound")):
            if movement.shape != shape:
                keys |= {f"{name}.{key}" for key in tables[name]}
        if movement.shape == "mound":
            read = self.mound.read_keys(movement)
            read |= {"suction_depth"} if self.soil_layer else set()
            keys |= {f"mound.{key}" for key in {*tables["mound"]} - read}
            keys.add(f"soil.{self.soil.stiffness_key(movement.other)}")
        if movement.shape == "loads":  # the ground stays
            keys.add("movement.kind")
        if movement.shape == "loads" or not self._deflection_is_given:
            keys.add("movement.central_deflection")
        return keys | ({"movement.increments"} if movement.stage else set())

    @property
    def _deflection_is_given(self) -> bool:
        """Whether ``movement.central_deflection`` controls the movement."""
        jacked = self.movement.shape == "jacks" and self.rig.control == "deflection"
        return (self.movement.prescribed and not self.movement.settles) or jacked

    @property
    def movement_key(self) -> str:
        """Key of the size of the movement."""
        key = "central_deflection" if self.movement.shape == "loads" else self.movement.size_key
        return f"{'mound' if self.movement.shape == 'mound' else 'movement'}.{key}"

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """The wall alone, or the walls of a house."""
        return (self,)

    @property
    def span(self) -> float:
        """Length of the wall (m), of a house of its longest wall."""
        return self.wall.length

    @property
    def moves_in_plan(self) -> str | None:
        """Movement of the ground under a house, in a sentence; None for one wall."""
        return None

    @property
    def footing_model(self) -> Literal["none", "beam", "deformable"]:
        """Model of the footing: ``solver.footing``, by default from the movement's shape."""
        return self.solver.footing or ("none" if self.movement.prescribed else "beam")

    @classmethod
    def from_toml(cls, path: str | Path) -> Scene:
        """Read a scene file (TOML): numbers are SI, strings may carry a unit.

        Raises InputError if the file is missing or unreadable, or a key or value is not acceptable.
        """
        tables = read_toml(path)
        if not tables:
            raise InputError(f"{path}: is empty; `damagepred new` writes a commented template.")
        if study_keys := [key for key in STUDY_KEYS if key in tables]:
            raise InputError(
                f"{path}: is a study (it has {study_keys[0]}), and a scene is needed; `damagepred study` runs studies."
            )
        return cls.from_file_tables(tables, Path(path).parent, str(path))

    @classmethod
    def from_file_tables(cls, tables: Mapping[str, Any], folder: Path, source: str) -> Scene:
        """Build a scene from the tables of a file, and record the given keys.

        Parameters
        ----------
        tables, folder, source
            Tables of the scene, folder of the files that they name, and name of their own file for messages.
        """
        in_metres, tables = profiles_in_metres(tables, folder), with_input_tables(tables, folder)
        scene = cls.from_dict(tables, source=source)
        cls = type(scene)
        object.__setattr__(scene, "in_metres", in_metres)
        if scene.dynamics is not None:
            scene.dynamics.check_base()
            scene.solver.require_no_zones()
        written = dict(_written(tables, ""))
        given = GivenKeys(written)
        units = ((key, unit_in(value)) for key, value in written.items())
        given.units = {key: unit for key, unit in units if unit and cls.takes_number(key)}
        object.__setattr__(scene, "given", given)
        return scene

    @classmethod
    def from_dict(cls, tables: Mapping[str, Any], source: str = "scene") -> Scene:
        """Build a scene from nested mappings, as TOML gives them.

        Parameters
        ----------
        tables : mapping
            Content of the scene file.
        source : str
            Name of the source, for messages.

        Raises
        ------
        InputError
            If a key or value is not acceptable, contradicts another, or is physically impossible.
        """
        if isinstance(tables, Mapping) and isinstance(tables.get("wall"), list | tuple):
            from damagepred.scene.house import House, house_tables

            cls, tables = House, house_tables(tables, source)
        else:
            tables = with_roof_in_all(tables)
        scene = build(cls, tables, source)
        scene._require_consistent(tables, source)
        return scene

    def _require_consistent(self, stated: Any, source: str) -> None:
        """Refuse impossible numbers, and stated numbers (tables, or objects made in Python) that follow from others."""
        require_possible(self, {}, source)
        for scene in self.scenes if isinstance(stated, Mapping) else ():
            for thin in thin_strips(scene.wall, scene.opening):
                raise InputError(f"{source}: {thin}.")
        log = bool(self.soil_layer)
        for path in self._following:
            given = stated
            for key in path.split("."):
                given = (given if isinstance(given, Mapping) else getattr(given, "stated", {})).get(key)
            if given is not None and to_si(given, "m") != (value := self.numbers[path]):
                raise InputError(
                    f"{source}: {path} = {given}: follows from {'[[soil_layer]]' if log else '[movement.seasons]'} "
                    f"({1e3 * value:.3g} mm); {'give swing_share' if path.endswith('swing') else 'leave it out'}."
                )

    def require_own_length(self, where: str) -> None:
        """Refuse another length of the wall, which would stretch a profile in metres; ``where``: for the message."""
        if self.in_metres:
            raise InputError(
                f"{where}: wall.length must stay as it is, because {self.in_metres[0]} has positions in metres, which "
                "another length would stretch. Give fractions, in a column 'x (1)', to scale the profile with the wall."
            )

    def to_dict(self) -> dict[str, Any]:
        """Nested dicts of plain values in SI, without None and empty values."""
        return plain(self)

    def to_toml(self, path: str | Path | None = None) -> str:
        """Scene as TOML, complete with defaults; also written to ``path`` if given."""
        import tomli_w

        text = tomli_w.dumps(self.to_dict())
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text

    @classmethod
    def takes_number(cls, place: str) -> bool:
        """Whether a key of a scene can be a real number, such as an optional one."""
        return takes_number(cls._with_key(place), place.split("."))

    @classmethod
    def _with_key(cls, place: str) -> type[Scene]:
        """Class whose tables have a key: a house for a place in a named wall or a corner."""
        from damagepred.scene.house import House

        return next((kind for kind in (House, Scene) if takes_number(kind, place.split("."))), cls)

    @property
    def _following(self) -> tuple[str, ...]:
        """Keys of the numbers that others determine."""
        if self.soil_layer:
            return (*SIZES, "movement.seasons.swing")
        return SIZES if self.movement.seasons else ()

    def free_tables(self) -> dict[str, Any]:
        """``to_dict`` without the numbers determined by a soil log or seasons."""
        tables = self.to_dict()
        for path in self._following:
            *way, key = path.split(".")
            reduce(lambda table, step: table.get(step, {}), way, tables).pop(key, None)
        return tables

    def number_places(self) -> list[str]:
        """Keys of all real numbers in this scene, such as ``"joint.cohesion"``; lists count from 1."""
        return list(self.numbers)

    @cached_property
    def numbers(self) -> dict[str, float]:
        """All real numbers of this scene by key."""
        return {key: value for key, value in _walk(self, "") if isinstance(value, float)}

    def place(self, text: str) -> str:
        """Key of a number as in ``number_places``, with the names of layers; an unknown key raises InputError."""
        return ".".join(step for step, _ in self._steps(text))

    def places(self, text: str) -> set[str]:
        """Keys of the numbers with this key: one, of a key of all walls of a house one per wall."""
        try:
            return {self.place(text)}
        except InputError:
            return {text}

    def _steps(self, text: str) -> list[tuple[str, Any]]:
        """Steps to a number: each as in ``number_places``, and its key in ``to_dict``."""
        steps: list[tuple[str, Any]] = []
        value: Any = self
        for step in text.split("."):
            if not isinstance(value, tuple):
                value = getattr(value, step, None)
                steps.append((step, step))
                continue
            names, where = step_names(value), ".".join(name for name, _ in steps)
            if (number := entry_number(value, step)) < 0:
                words = [name for name in names if not name.isdecimal()]
                count = f"numbers count from 1, here to {len(names)}" if names else "the scene has none"
                count += f"; names are {', '.join(words)}" if words else ""
                older = f" Older files counted from 0: {where}.0 is {where}.1." if step == "0" and names else ""
                hint = nearest(step, words)
                raise InputError(f"'{text}': the scene has no {where} '{step}'; {count}.{older}{hint}")
            value = value[number]
            steps.append((names[number], number))
        if not isinstance(value, float):
            raise InputError(
                f"'{text}': the scene leaves this number out; give it a value there first."
                if self.takes_number(text)
                else f"'{text}': no such number in this scene." + nearest(text, self.number_places())
            )
        return steps

    @classmethod
    @cache
    def unit_of(cls, place: str) -> str:
        """SI unit of a number by its key, ``"1"`` for a pure number."""
        return unit_of(cls._with_key(place), place.split("."))

    def with_values(self, values: Mapping[str, float]) -> Scene:
        """Copy with other numbers: SI values by key, such as ``"joint.tensile_strength"`` or ``"opening.1.width"``.

        Raises InputError if a key does not exist or a value is not acceptable.
        """
        values = {self.place(path): value for path, value in values.items()}
        tables = self.free_tables()
        for path, value in values.items():
            *way, last = (key for _, key in self._steps(path))
            target: Any = reduce(lambda table, key: table[key], way, tables)
            target[last] = float(value)
        full = self.movement_key
        self._require_free(full, values)
        if self.movement.stage and full in values:  # scales the history
            table, key = full.split(".")
            for stage in tables["movement"]["stage"]:
                stage[key] = float(values[full]) * (stage[key] / getattr(getattr(self, table), key))
        scene = build(type(self), tables, source="sampled scene")
        object.__setattr__(scene, "given", self.given)
        return scene

    def _require_free(self, full: str, values: Mapping[str, float]) -> None:
        """Refuse values that others determine: stages with seasons, and the full movement."""
        fixed = []
        if self.movement.seasons is not None:
            fixed = [key for key in values if key == full or key.startswith("movement.stage.")]
        if self.soil_layer:
            fixed += [key for key in values if key in (full, "movement.seasons.swing")]
        if fixed:
            layer = step_names(self.soil_layer)[:1]
            by = f"soil_layer.{layer[0]}.shrink_swell_index" if layer else "movement.seasons.swing"
            raise InputError(f"'{fixed[0]}': follows from other keys; sample these, such as {by}.")

    def with_seed(self, *entropy: int) -> Scene:
        """Copy with another seed of its seasons and survey errors, such as a study's seed and a sample's number."""
        if self.movement.seasons is None and not self.movement.survey_error:
            return self
        scene = replace(self, movement=self.movement.with_seed(*entropy))
        object.__setattr__(scene, "given", self.given)
        return scene


def archived_scene(attributes: Mapping[str, Any], source: str = "the dataset's scene") -> Scene:
    """Scene in the attributes of a result, without checks of plausibility."""
    return unchecked_scene(parse_toml(str(attributes["scene"]), source), source)


def unchecked_scene(tables: Mapping[str, Any], source: str) -> Scene:
    """Scene or house of its complete tables in SI, without checks of plausibility."""
    from damagepred.scene.house import House

    return build(House if isinstance(tables.get("wall"), list) else Scene, tables, source)


def step_names(items: Sequence[Any]) -> list[str]:
    """Names of the items of a list in keys: their own, or their number from 1."""
    names = [item.get("name") if isinstance(item, Mapping) else getattr(item, "name", None) for item in items]
    return [str(name or number) for number, name in enumerate(names, start=1)]


def entry_number(items: Sequence[Any], step: str) -> int:
    """Number from 0 of the entry of a list with a name, or a number from 1; -1 if there is none."""
    names = step_names(items)
    number = int(step) if step.isdecimal() else names.index(step) + 1 if step in names else 0
    return number - 1 if number <= len(names) else -1


def _written(tables: Any, key: str) -> list[tuple[str, Any]]:
    """Keys of all values in nested tables, each with the value as written."""
    if isinstance(tables, Mapping):
        pairs = [(str(name), value) for name, value in tables.items()]
    elif isinstance(tables, list) and any(isinstance(item, Mapping) for item in tables):
        pairs = list(zip(step_names(tables), tables))
    else:
        return [(key, tables)]
    return [nested for name, value in pairs for nested in _written(value, f"{key}.{name}" if key else name)]


def _walk(value: Any, key: str) -> list[tuple[str, Any]]:
    """(key, number or None) of all fields below ``value``."""
    if dataclasses.is_dataclass(value):
        pairs = [(f.name, getattr(value, f.name)) for f in dataclasses.fields(value)]
    elif isinstance(value, tuple):
        pairs = list(zip(step_names(value), value))
    else:
        return [(key, value)]
    return [nested for name, item in pairs for nested in _walk(item, f"{key}.{name}" if key else name)]
