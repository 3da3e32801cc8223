"""Study file: a scene, its uncertain numbers, and the number of walls."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Collection, Iterable, Mapping
from copy import copy
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from damagepred.archive.schema import SCHEMA_VERSION
from damagepred.archive.versions import COUNTS_FROM_1, ELASTIC_BRICKS, from_0, from_1, with_defaults_of
from damagepred.arrays import FloatArray
from damagepred.campaign.sampling import Sampling
from damagepred.damage import DamageTable
from damagepred.damage.judge import Rules
from damagepred.damage.table import STATE_TAKES
from damagepred.errors import InputError, nearest
from damagepred.formatting import quantity
from damagepred.inputs.input_files import parse_toml, read_toml
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import Report, Scene
from damagepred.scene.described import build, described, plain
from damagepred.scene.material_library import material
from damagepred.scene.plausibility import require_possible
from damagepred.scene.quantity import Pure, to_si
from damagepred.scene.scene import unchecked_scene
from damagepred.solvers.options import SolverOptions
from damagepred.uq.design import Design, Sampler
from damagepred.uq.importance import check
from damagepred.uq.samplers import WEIGHT, read_table
from damagepred.uq.variable import Variable

_REMOVED = {
    "coarse": "two-level estimates have been removed; take more walls, or `damagepred rare` for small probabilities",
    "crossed": "crossed walls have been removed; `damagepred sensitivity` takes the independent walls of any study",
    "time_budget": "budgets of time have been removed; `timeout 2h damagepred study` ends a run, which can be resumed",
}
"""Keys of ``[study]`` in files of older versions, and what to use instead."""

VERSION = "schema_version"  # key of the frozen copy of a study; without it the study is of version 7 or older


@described
class StudySettings:
    """Content of a study file."""

    scene: Scene
    """Wall without the sampled numbers."""
    study: Sampling = Field(default_factory=Sampling)
    """Sampling of the walls."""
    variables: dict[str, Variable] = Field(default_factory=dict)
    """Uncertain numbers, by key of the scene."""
    correlation: dict[str, dict[str, Pure]] = Field(default_factory=dict)
    """Correlation of pairs of variables."""
    report: Report | None = None
    """Head of the report, from the study file or its scene. It is no part of the study."""

    @classmethod
    def from_toml(cls, path: str | Path) -> StudySettings:
        """Read a study file; a missing or invalid file or scene raises InputError."""
        file = Path(path)
        tables = read_toml(file)
        scene = tables.get("scene")
        if scene is None:
            what = "is a scene; `damagepred solve` solves it. A study" if "wall" in tables else "has no scene; it"
            raise InputError(f'{file}: {what} names one with scene = "file.toml" at the top, or has tables [scene.*].')
        if not isinstance(scene, str):
            return cls.from_file_tables(tables, Scene.from_file_tables(scene, file.parent, f"{file} [scene]"), file)
        described_scene = Scene.from_toml(file.parent / scene)
        SolverOptions.of(described_scene.solver, str(file.parent / scene))  # errors name the file
        return cls.from_file_tables(tables, described_scene, file)

    @classmethod
    def from_file_tables(cls, tables: Mapping[str, Any], scene: Scene, file: Path) -> StudySettings:
        """Settings of the tables of a study file and its scene, which may come from another file."""
        SolverOptions.of(scene.solver, f"{file} [scene]")
        return cls._checked({**tables, "scene": scene}, file.parent, str(file))

    @classmethod
    def from_dict(cls, tables: Mapping[str, Any], source: str = "study") -> StudySettings:
        """Settings from nested mappings, as in the TOML file, with the scene's tables inside."""
        scene = tables.get("scene")
        if isinstance(scene, Mapping):
            tables = {**tables, "scene": Scene.from_dict(scene, f"{source} [scene]")}
        return cls._checked(tables, Path(), source)

    @classmethod
    def _checked(cls, tables: Mapping[str, Any], folder: Path, source: str) -> StudySettings:
        """Settings of a user's tables, without physically impossible numbers."""
        if isinstance(how := tables.get("study"), Mapping):
            for key in (key for key in _REMOVED if how.get(key)):
                warnings.warn(f"{source}: [study] {key} has no effect: {_REMOVED[key]}; leave it out", stacklevel=4)
            tables = {**tables, "study": {key: value for key, value in how.items() if key not in _REMOVED}}
        if isinstance(scene := tables.get("scene"), Scene) and scene.report is not None:
            scene, of_scene = copy(scene), plain(scene.report)
            object.__setattr__(scene, "report", None)
            head = tables.get("report", {})
            tables = {**tables, "scene": scene, "report": {**of_scene, **head} if isinstance(head, Mapping) else head}
        settings = cls.of_tables(tables, folder, source)
        require_possible(settings.scene, settings.means(), source)
        settings.damage_table.by_measures(dict.fromkeys(STATE_TAKES, np.zeros(2)))  # refuses faulty functions
        return settings

    @classmethod
    def of_tables(cls, tables: Mapping[str, Any], folder: Path, source: str) -> StudySettings:
        """Settings with the values of their files, which are in a folder."""
        tables = {key: value for key, value in tables.items() if key != VERSION}
        if isinstance(scene := tables.get("scene"), Mapping):
            tables["scene"] = unchecked_scene(scene, f"{source}: [scene]")
        if isinstance(how := tables.get("study"), Mapping) and isinstance(other := how.get("fields_from"), Mapping):
            tables["study"] = {**how, "fields_from": unchecked_scene(other, f"{source}: [study.fields_from]")}
        settings = build(cls, tables, source)._with_places_of_scene(source)._with_material_scatter()
        settings = settings._with_sample_table(folder)
        where = {p: f'[variables."{p}"]' for p in settings.variables}
        measured = {p: v.with_values(where[p], Scene.unit_of(p), folder) for p, v in settings.variables.items()}
        if measured != settings.variables:
            settings = dataclasses.replace(settings, variables=measured)
        settings.check(source)
        return settings

    def _with_places_of_scene(self, source: str) -> StudySettings:
        """Settings with the keys of the scene: layers by name, if they have one."""

        def named(key: str) -> str:
            try:
                return self.scene.place(key)
            except InputError:
                return key  # a later check refuses it

        variables: dict[str, Variable] = {}
        for key, variable in self.variables.items():
            try:
                place = self.scene.place(key)
            except InputError as error:
                reason = str(error).removeprefix(f"'{key}': ")
                raise InputError(f'{source}: [variables."{key}"]: {reason}') from None
            if place in variables:
                raise InputError(f'{source}: [variables."{key}"]: is the same number as "{place}"; leave one out.')
            variables[place] = variable
        how = dataclasses.replace(
            self.study,
            importance={named(key): value for key, value in self.study.importance.items()},
            epistemic={n: {named(p): v for p, v in other.items()} for n, other in self.study.epistemic.items()},
        )
        correlation: dict[str, dict[str, float]] = {}
        for a, b, rho in self._pairs():
            correlation.setdefault(named(a), {})[named(b)] = rho
        return dataclasses.replace(self, variables=variables, study=how, correlation=correlation)

    def _with_material_scatter(self) -> StudySettings:
        """Settings with the scatter of the library about the values of the scene, if requested."""
        if not self.study.material_scatter:
            return self
        if self.scene.material is None:
            raise InputError("study.material_scatter: needs scene.material, a name of the library.")
        library = material(self.scene.material)
        variables, pairs = dict(self.variables), {a: dict(row) for a, row in self.correlation.items()}
        for key, value in library.values.items():
            mean = self.scene.numbers.get(key)
            if value.cov is not None and mean is not None and key not in variables:
                source = f"{library.source} (mean {value.confidence}, cov {value.cov_confidence})"
                variables[key] = Variable(distribution="lognormal", mean=mean, cov=value.cov, source=source)
        for (a, b), rho in library.correlation.items():
            if b not in pairs.get(a, {}) and a not in pairs.get(b, {}):
                pairs.setdefault(a, {})[b] = rho
        return dataclasses.replace(self, variables=variables, correlation=pairs)

    def _with_sample_table(self, folder: Path) -> StudySettings:
        """Settings with the absolute path and the columns of the checked table of samples."""
        how = self.study
        if how.table is None or how.table_columns:
            return self
        file = str((folder / how.table).resolve())
        table = read_table(file, Scene.unit_of, list(self.scene.numbers))
        for key, values in table.items():
            for value in {values.min(), values.max()} if key != WEIGHT else ():
                try:
                    self.scene.with_values({key: float(value)})
                except InputError as error:
                    reason = str(error).removeprefix("sampled scene: ")
                    raise InputError(f"{file}: a value the scene cannot take: {reason}") from None
        columns = tuple(table)
        return dataclasses.replace(self, study=dataclasses.replace(how, table=file, table_columns=columns))

    def check(self, source: str) -> None:
        """Check the combination of all tables."""
        table = self.damage_table
        if isinstance(stop := self.study.stop_at_category, int) and stop > table.highest:
            raise InputError(
                f"{source}: [study] stop_at_category = {stop}: {table.name} goes up to category {table.highest}; "
                'take one of those, or "none" to solve every path to its end.'
            )
        if self.scene.dynamics is not None:
            raise InputError(
                f"{source}: [scene.dynamics]: a study follows the movement of the ground without time, to find the "
                "movement at which each wall reaches a category; leave this table out, or run the walls one by one."
            )
        if "wall.length" in (*self.variables, *self.study.table_columns):
            self.scene.require_own_length(f'{source}: [variables."wall.length"]')
        for key, variable in self.variables.items():
            if variable.field is not None and key.split(".")[-2] not in ("joint", "head_joint", "dpc"):
                raise InputError(
                    f'{source}: [variables."{key}"] field: only numbers of joint, head_joint and dpc vary from '
                    "joint to joint."
                )
        if (others := self.study.fields_from) is not None and len(others.scenes) != len(self.scene.scenes):
            raise InputError(f"{source}: study.fields_from: must have as many walls as the scene.")
        self._check_correlation(source, self.scene.numbers)
        check([key for key, variable in self.variables.items() if variable.field is None], self.study.importance)
        if self.study.stop_when is not None and self.study.stop_when.category > table.highest:
            raise InputError(f"{source}: [study.stop_when] category: must be at most {table.highest}.")
        self._check_range(source)

    def _check_correlation(self, source: str, places: Collection[str]) -> None:
        stated: dict[frozenset[str], float] = {}
        for a, b, value in self._pairs():
            where, pair = f'{source}: [correlation] "{a}" with "{b}" = {value}', frozenset((a, b))
            for key in (a, b):
                if key in self.study.table_columns:
                    raise InputError(f'{where}: "{key}" is a column of the table, whose samples stay as they are.')
                if key not in self.variables:
                    what = "is no variable of this study; there is no"
                    what = "is a number of the scene without" if key in places else what
                    hint = nearest(key, self.variables)
                    raise InputError(f'{where}: "{key}" {what} table [variables."{key}"].{hint}')
            if a == b:
                raise InputError(f"{where}: a variable has correlation 1 with itself; leave this line out.")
            if not -1 <= value <= 1:
                raise InputError(f"{where}: must be a number from -1 to 1.")
            if stated.setdefault(pair, value) != value:
                raise InputError(f"{where}: the same pair is given {stated[pair]:g} before; leave one of them out.")

    def _check_range(self, source: str) -> None:
        """Refuse distributions whose median or tails the scene cannot take."""
        try:
            design = self.design()
        except InputError as error:
            library = " Those of the material's library are replaced by values given there." * (
                self.study.material_scatter and str(error).startswith("[correlation]")
            )
            raise InputError(f"{source}: {error}{library}") from None
        for key, marginal in design.marginals.items():
            for share in (1e-6, 0.5, 1 - 1e-6):
                value = float(marginal.ppf(share))
                try:
                    self.scene.with_values({key: value})
                except InputError as error:
                    reason = str(error).removeprefix("sampled scene: ")
                    raise InputError(
                        f'{source}: [variables."{key}"]: one wall in {1 / min(share, 1 - share):.0f} gets a value '
                        f"the scene cannot take: {reason} Use a distribution that stays in range, or lower and upper."
                    ) from None

    @one_blas_thread()
    def mean_wall(self) -> tuple[Scene, str]:
        """Scene with every variable at its mean, and a sentence about it."""
        means = self.means()
        values = ", ".join(f"{key} = {_in_words(key, value)}" for key, value in means.items())
        movement = "" if any(p.split(".")[0] == "movement" for p in means) else ", the movement as given"
        return dataclasses.replace(self.scene.with_values(means), title=f"{self.title}: mean wall"), (
            f"{self.title}: its mean wall, with {values or 'nothing uncertain'}{movement} "
            "(arithmetic means, also of lognormals, above their medians; the same in every joint)"
        )

    def other_means(self) -> list[str]:
        """Variables with neither mean nor median at the scene's value, each in a sentence."""
        marginals, sentences = self.design().marginals, []
        for key, mean in self.means().items():
            variable, of_scene = self.variables.get(key), self.scene.numbers[key]
            given = (variable.mean, variable.median) if variable else ()
            stated = [to_si(value, Scene.unit_of(key)) for value in given if value]
            centres = [mean, *stated, *([float(marginals[key].ppf(0.5))] if key in marginals else [])]
            if not any(math.isclose(of_scene, centre, rel_tol=0.01) for centre in centres):
                default = self.scene.given is not None and key not in self.scene.given
                sentences.append(
                    f"variable {key}: mean {_in_words(key, mean)}, the scene has {_in_words(key, of_scene)}"
                    f"{' by default' if default else ''}; samples follow the variable"
                )
        return sentences

    def require_not_drawn(self, keys: Iterable[str], scene: Mapping[str, Any]) -> None:
        """Refuse values by key of the tables of a changed scene, if the variables would replace them in each sample."""
        named = scene.get("material") is not None and not self.study.material_scatter
        by_material = material(str(scene["material"])).values if named else ()
        places = {key: self.scene.places(key) for key in self.variables}
        given = [key for name in keys for key in (by_material if name == "material" else (name,))]
        drawn = {key: [v for v in places if places[v] & self.scene.places(key)] for key in given}
        if names := [key for key in given if drawn[key]]:
            others = dict.fromkeys(variable for key in names for variable in drawn[key] if variable != key)
            each = "house" if isinstance(scene.get("wall"), list) else "wall"
            raise InputError(
                f"{', '.join(names)}: the study draws {', '.join(others) or 'this number'} for each {each}, so another "
                "value has no effect; take it out of [variables], or draw joint.strength_factor instead."
            )

    def means(self) -> dict[str, float]:
        """Mean of every variable, by key."""
        design = self.design()
        means = {key: float(marginal.mean()) for key, marginal in design.marginals.items()}
        if design.sampler.read_table is not None:
            table = dict(design.sampler.read_table())
            weight = table.pop(WEIGHT, None)
            means |= {key: float(np.average(values, weights=weight)) for key, values in table.items()}
        return means

    def _pairs(self) -> list[tuple[str, str, float]]:
        return [(a, b, value) for a, row in self.correlation.items() for b, value in row.items()]

    @property
    def title(self) -> str:
        """Question of the study."""
        return self.study.title or self.scene.title

    @property
    def shape_varies(self) -> bool:
        """Whether samples have different bricks and joints: numbers of wall, openings or control joints vary."""
        steps = [key.split(".") for key in self.variables]
        materials = ("block", "joint", "head_joint", "loads")  # of one wall of a house
        return any(s[0] in ("wall", "opening", "control_joint") and s[-2] not in materials for s in steps)

    @property
    def damage_table(self) -> DamageTable:
        """Damage table or own states of the scene."""
        return Rules.from_settings(**dataclasses.asdict(self.scene.damage)).table

    @property
    def last_category(self) -> float:
        """Category at which a path ends, or infinity."""
        stop = self.study.stop_at_category
        if stop == "none" or (stop is None and self.study.movement != "path"):
            return math.inf
        return stop or self.damage_table.highest

    @one_blas_thread()
    def design(self) -> Design:
        """Distributions, ready to draw from."""
        pairs = {frozenset((a, b)): value for a, b, value in self._pairs()}
        units = {key: Scene.unit_of(key) for key in self.variables}
        how = self.study

        def table() -> dict[str, FloatArray]:
            columns = {from_0(key): key for key in how.table_columns}  # headers of older studies
            read = read_table(str(how.table), Scene.unit_of, [*how.table_columns, *columns])
            return read if {*read} == {*how.table_columns} else {columns[key]: v for key, v in read.items()}

        drawn = how.sampler, how.replicates, how.importance, how.nominal_share, how.table_columns
        sampler = Sampler(*drawn, table if how.sampler == "table" else None, how.crossed)
        return Design.make(self.variables, units, pairs, sampler, how.seed)

    def to_dict(self) -> dict[str, Any]:
        """Nested dicts of plain values, the scene in SI."""
        content: dict[str, Any] = {"study": plain(self.study)}
        content["variables"] = {key: plain(v) for key, v in self.variables.items()}
        if self.correlation:
            content["correlation"] = {a: dict(row) for a, row in self.correlation.items()}
        content["scene"] = self.scene.to_dict()
        return content

    def to_toml(self) -> str:
        """Study as TOML with its scene, complete with defaults."""
        import tomli_w

        return tomli_w.dumps({VERSION: SCHEMA_VERSION, **self.to_dict()})

    def with_samples(self, samples: int | None, seed: int | None) -> StudySettings:
        """Settings with another number of samples or another seed; None keeps the present one."""
        changes: dict[str, Any] = {k: v for k, v in (("samples", samples), ("seed", seed)) if v is not None}
        if not changes:
            return self
        if changes.get("samples", 1) < 1 or changes.get("seed", 0) < 0:
            raise InputError("the number of samples must be 1 or more, and the seed 0 or more.")
        return dataclasses.replace(self, study=dataclasses.replace(self.study, **changes))


def _in_words(key: str, value: float) -> str:
    shown, unit = quantity(value, Scene.unit_of(key))
    return shown if unit == "–" else f"{shown} {unit}"


def study_tables(file: Path) -> tuple[dict[str, Any], Path]:
    """Tables of a study file with the scene's own tables inside, and the folder of the scene's files."""
    tables, folder = read_toml(file), file.parent
    if isinstance(name := tables["scene"], str):
        tables["scene"], folder = read_toml(folder / name), (folder / name).parent
    return tables, folder


def read_frozen(text: str) -> StudySettings:
    """Study settings from their frozen copy; of a pair correlated twice the last value counts, as before."""
    tables = parse_toml(text, "study.toml")
    how, removed = tables.get("study", {}), {"coarse", "time_budget"}
    if how.get("stop_when", {}).get("quantity") == "median":
        removed.add("stop_when")
    tables["study"] = {key: value for key, value in how.items() if key not in removed}
    pairs = {frozenset((a, b)): (a, b, r) for a, row in tables.get("correlation", {}).items() for b, r in row.items()}
    if pairs:
        tables["correlation"] = {a: {d: r for c, d, r in pairs.values() if c == a} for a, *_ in pairs.values()}
    if (version := tables.get(VERSION, 0)) < ELASTIC_BRICKS:
        tables = _of_older(tables, version)
    return StudySettings.of_tables(tables, Path(), "study.toml")


def resumed(settings: StudySettings, text: str) -> StudySettings:
    """Settings for a folder with a frozen study: one with the former default, rigid bricks, retains it."""
    tables, scene = parse_toml(text, "study.toml"), settings.scene
    unstated = scene.given is not None and scene.given.keys().isdisjoint(("solver.blocks", "solver.accuracy"))
    former = tables.get(VERSION, 0) < ELASTIC_BRICKS and tables["scene"].get("solver", {}).get("blocks") == "rigid"
    if not (unstated and former) or scene.solver.blocks == "rigid":
        return settings
    warnings.warn(
        "the bricks of this folder are rigid, the default of the version that made it, and stay so; to have elastic "
        "bricks, the present default, take another folder; to state rigid ones, write solver.blocks = 'rigid'",
        stacklevel=3,
    )
    scene = copy(scene)
    object.__setattr__(scene, "solver", dataclasses.replace(scene.solver, accuracy="standard", blocks="rigid"))
    return dataclasses.replace(settings, scene=scene)


def _of_older(tables: Mapping[str, Any], version: int) -> dict[str, Any]:
    """Tables of a frozen study of an older version, whose keys may count from 0."""

    def counted(values: Mapping[str, Any]) -> dict[str, Any]:
        return {from_1(key) if version < COUNTS_FROM_1 else key: value for key, value in values.items()}

    how = dict(tables["study"])
    migrated = {**tables, "study": how, "variables": counted(tables.get("variables", {}))}
    migrated["correlation"] = counted({a: counted(row) for a, row in tables.get("correlation", {}).items()})
    how["importance"] = counted(how.get("importance", {}))
    how["epistemic"] = {name: counted(other) for name, other in how.get("epistemic", {}).items()}
    how["table_columns"] = list(counted(dict.fromkeys(how.get("table_columns", ()))))
    for holder, key in ((migrated, "scene"), (how, "fields_from")):
        if key in holder:
            holder[key] = with_defaults_of(version, holder[key])
    return migrated
