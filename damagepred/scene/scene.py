"""Scene: one wall on one footing, one movement, with solver and damage assessment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache, cached_property, reduce
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, nearest
from damagepred.inputs.input_files import parse_toml, read_toml
from damagepred.inputs.text import check_title
from damagepred.scene.consistency import check_movement, check_tables
from damagepred.scene.described import build, completed_by, described, plain, takes_number, unit_of
from damagepred.scene.dynamics import Dynamics
from damagepred.scene.input_tables import with_input_tables, with_roof_in_all
from damagepred.scene.keys import entry_number, field_values, step_names, written_values
from damagepred.scene.loading import Load, Loading, Support
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
from damagepred.scene.wall import ControlJoint, Opening, Wall, thin_strips

STUDY_KEYS = ("scene", "study", "variables", "correlation")  # keys of study files only


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

    given: ClassVar[Mapping[str, str] | None] = None
    """Keys given in the file, such as "joint.cohesion", and the units that the user wrote; None without a file."""
    in_metres: ClassVar[tuple[str, ...]] = ()
    """Profiles that are read from a file with positions in metres."""

    _completed = completed_by(lambda tables: with_climate_zone(with_largest_stage(with_material(tables))))

    @model_validator(mode="after")
    def _fits_together(self) -> Scene:
        if isinstance(self.wall, tuple):  # a house as the scene of a study: it has checked itself
            return self
        _ = self.heads  # checks the combination with the joints
        check_tables(self)
        self._take_surface_movement()
        check_movement(self)
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
        if movement.shape == "loads" or not self.deflection_is_given:
            keys.add("movement.central_deflection")
        return keys | ({"movement.increments"} if movement.stage else set())

    @property
    def deflection_is_given(self) -> bool:
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
        tables, in_metres = with_input_tables(tables, folder)
        scene = cls.from_dict(tables, source=source)
        cls = type(scene)
        object.__setattr__(scene, "in_metres", in_metres)
        if scene.dynamics is not None:
            scene.dynamics.check_base()
            scene.solver.require_no_zones()
        written = dict(written_values(tables))
        given = {key: unit_in(value) if cls.takes_number(key) else "" for key, value in written.items()}
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

    @cached_property
    def numbers(self) -> dict[str, float]:
        """All real numbers of this scene by key, such as ``"joint.cohesion"``; lists count from 1."""
        return {key: value for key, value in field_values(self) if isinstance(value, float)}

    def place(self, text: str) -> str:
        """Key of a number as in ``numbers``, with the names of layers; an unknown key raises InputError."""
        return ".".join(step for step, _ in self._steps(text))

    def places(self, text: str) -> set[str]:
        """Keys of the numbers with this key: one, of a key of all walls of a house one per wall."""
        try:
            return {self.place(text)}
        except InputError:
            return {text}

    def _steps(self, text: str) -> list[tuple[str, Any]]:
        """Steps to a number: each as in ``numbers``, and its key in ``to_dict``."""
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
                else f"'{text}': no such number in this scene." + nearest(text, self.numbers)
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
