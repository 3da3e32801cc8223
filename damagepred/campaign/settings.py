"""The study file: a scene, what is uncertain about it, and how many walls to sample."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field

from damagepred.archive.schema import SCHEMA_VERSION
from damagepred.archive.versions import COUNTS_FROM_1, from_0, from_1, inert_below_log
from damagepred.arrays import FloatArray
from damagepred.damage import DamageTable, load_table
from damagepred.errors import InputError, nearest
from damagepred.formatting import quantity
from damagepred.inputs.input_files import parse_toml, read_toml
from damagepred.inputs.text import check_title
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import Scene
from damagepred.scene.described import described
from damagepred.scene.material_library import material
from damagepred.scene.plausibility import require_possible
from damagepred.scene.quantity import Count, Duration, Pure, to_si
from damagepred.scene.reading import build, plain
from damagepred.solvers.options import SolverOptions
from damagepred.uq.design import Design, Sampler
from damagepred.uq.importance import Proposal, check
from damagepred.uq.stopping import StopWhen
from damagepred.uq.table import WEIGHT, read_table
from damagepred.uq.variable import Variable


def _stop(value: Any) -> Any:
    whole = isinstance(value, int) and not isinstance(value, bool)
    if value is None or value == "none" or (whole and value >= 1):
        return value
    raise ValueError('must be the number of a category, 1 or more, or "none" to solve every path to its end')


_REMOVED = {
    "coarse": "two-level estimates have been removed; take more walls, or `damagepred rare` for small probabilities",
    "crossed": "crossed walls have been removed; `damagepred sensitivity` takes the independent walls of any study",
}
"""Keys of ``[study]`` in files of older versions, and what to use instead."""

VERSION = "schema_version"
"""Key of the frozen copy of a study; without it the study is of version 7 or older."""

Stop = Annotated[Any, BeforeValidator(_stop)]
"""Category at which a path ends, ``"none"``, or None."""


@described
class Sampling:
    """How walls are sampled (``[study]``).

    Attributes
    ----------
    title : str or None
        What the study asks; the scene's title if None.
    samples : int
        Number of walls, unless the command says otherwise.
    seed : int
        Of all random streams.
    sampler : {"sobol", "lhs", "random", "table"}
        For the values that hold for a whole wall. Only a Latin hypercube cannot be extended.
    replicates : int
        Number of independent scrambles of the Sobol points, which take turns. From 4 on, the differences of their means
        give the error of an estimate. With fewer, the points are taken as random, which errs to the safe side.
    table, table_columns : str or None, tuple of str
        CSV file with the samples for ``sampler = "table"`` (see ``damagepred.uq.table.read_table``), by its place
        beside the study file, and the places it gives; the latter are read from it.
    importance : dict of str to Proposal
        Where variables are drawn instead, by place; every sample then has a ``weight``.
    nominal_share : float
        With ``importance``, share of walls drawn as the distributions say; it keeps weights below one over it.
    stop_when : StopWhen or None
        Run no more walls once a quantity is known well enough; ``samples`` is then the most there may be.
    time_budget : float or None
        Begin no more walls after this time (s).
    epistemic : dict
        Alternatives to the distributions, by name: ``[study.epistemic."less sure"."dpc.friction"] cov = 0.3``. Walls
        are not run anew but weighted (``damagepred estimate``).
    fields_from : Scene or None
        The wall on whose joints the fields are drawn, if not the scene's own; a joint has the value of the nearest.
    store_fields : bool
        Whether the design file also records every joint's values. They follow from the seed; the record is for the
        archive.
    material_scatter : bool
        Whether all values of ``scene.material`` with a known scatter are lognormal variables, with the correlations of
        the library, besides the variables that are given.
    stop_at_category : int, "none" or None
        A path ends once this category is reached, and the movement beyond is not solved. None: the table's highest;
        "none": every path is solved to the end of the movement.
    crossed : bool
        Samples come in fours, two walls and two fields in every combination: in archives of 0.1 alone, which replay it.
    movement : {"path", "sampled", "both"}
        What is kept of each wall. ``path``: every increment up to its own sampled movement. ``sampled``: only the end
        of that, one value a sample. ``both``: the latter as ``end_*``. Where the end counts, paths are
        solved to it unless ``stop_at_category`` says otherwise.
    """

    title: Annotated[str, AfterValidator(check_title)] | None = None
    samples: Count = Field(default=100, ge=1)
    seed: Count = Field(default=1, ge=0, lt=2**63)
    sampler: Literal["sobol", "lhs", "random", "table"] = "sobol"
    replicates: Count = Field(default=1, ge=1, le=1024)
    table: str | None = None
    table_columns: tuple[str, ...] = ()
    importance: dict[str, Proposal] = Field(default_factory=dict)
    nominal_share: Pure = Field(default=0.0, ge=0, lt=1)
    stop_when: StopWhen | None = None
    time_budget: Duration | None = Field(default=None, gt=0)
    epistemic: dict[str, dict[str, dict[str, Any]]] = Field(default_factory=dict)
    fields_from: Scene | None = None
    store_fields: bool = True
    material_scatter: bool = False
    stop_at_category: Stop = None
    crossed: bool = False
    movement: Literal["path", "sampled", "both"] = "path"


@described
class StudySettings:
    """Content of a study file.

    Attributes
    ----------
    scene : Scene
        The wall as it is where nothing is sampled.
    study : Sampling
        How to sample.
    variables : dict of str to Variable
        What is uncertain, by its place in the scene.
    correlation : dict of str to dict of str to float
        Correlation of pairs of variables.
    """

    scene: Scene
    study: Sampling = Field(default_factory=Sampling)
    variables: dict[str, Variable] = Field(default_factory=dict)
    correlation: dict[str, dict[str, Pure]] = Field(default_factory=dict)

    @classmethod
    def from_toml(cls, path: str | Path) -> StudySettings:
        """Read a study file.

        Raises
        ------
        InputError
            If it, or the scene it names, is missing or not acceptable.
        """
        file = Path(path)
        tables = read_toml(file)
        scene = tables.get("scene")
        if scene is None:
            what = "is a scene; `damagepred solve` solves it. A study" if "wall" in tables else "has no scene; it"
            raise InputError(f'{file}: {what} names one with scene = "file.toml" at the top, or has tables [scene.*].')
        if isinstance(scene, str):
            source, described_scene = str(file.parent / scene), Scene.from_toml(file.parent / scene)
        else:
            source = f"{file} [scene]"
            described_scene = Scene.from_file_tables(scene, file.parent, source)
        SolverOptions.of(described_scene.solver, source)  # refused with the name of the file
        return cls._checked({**tables, "scene": described_scene}, file.parent, str(file))

    @classmethod
    def from_dict(cls, tables: Mapping[str, Any], source: str = "study") -> StudySettings:
        """Build settings from nested mappings with the scene's tables inside.

        Parameters
        ----------
        tables : mapping
            Nested tables, as in the TOML file.
        source : str
            Name of the file, for messages.

        Raises
        ------
        InputError
            If a key or value is not acceptable.
        """
        scene = tables.get("scene")
        if isinstance(scene, Mapping):
            tables = {**tables, "scene": Scene.from_dict(scene, f"{source} [scene]")}
        return cls._checked(tables, Path(), source)

    @classmethod
    def _checked(cls, tables: Mapping[str, Any], folder: Path, source: str) -> StudySettings:
        """Return the settings of a user's tables, none of them physically impossible."""
        if isinstance(how := tables.get("study"), Mapping):
            for key in (key for key in _REMOVED if how.get(key)):
                warnings.warn(f"{source}: [study] {key} has no effect: {_REMOVED[key]}; leave it out", stacklevel=4)
            tables = {**tables, "study": {key: value for key, value in how.items() if key not in _REMOVED}}
        settings = cls.of_tables(tables, folder, source)
        require_possible(settings.scene, settings.means(), source)
        return settings

    @classmethod
    def of_tables(cls, tables: Mapping[str, Any], folder: Path, source: str) -> StudySettings:
        """Return the settings, with the values of the files in a folder that they name."""
        tables = {key: value for key, value in tables.items() if key != VERSION}
        settings = build(cls, tables, source)._with_places_of_scene(source)._with_material_scatter()
        settings = settings._with_sample_table(folder)._with_measured_values(folder)
        settings.check(source)
        return settings

    def _with_places_of_scene(self, source: str) -> StudySettings:
        """Return the settings with each place as the scene names it: a layer by its name, if it has one."""

        def named(place: str) -> str:
            try:
                return self.scene.place(place)
            except InputError:
                return place  # refused where it stands

        variables: dict[str, Variable] = {}
        for place, variable in self.variables.items():
            try:
                own = self.scene.place(place)
            except InputError as error:
                reason = str(error).removeprefix(f"'{place}': ")
                raise InputError(f'{source}: [variables."{place}"]: {reason}') from None
            if own in variables:
                raise InputError(f'{source}: [variables."{place}"]: is the same number as "{own}"; leave one out.')
            variables[own] = variable
        how = dataclasses.replace(
            self.study,
            importance={named(place): value for place, value in self.study.importance.items()},
            epistemic={n: {named(p): v for p, v in other.items()} for n, other in self.study.epistemic.items()},
        )
        correlation: dict[str, dict[str, float]] = {}
        for a, b, rho in self._pairs():
            correlation.setdefault(named(a), {})[named(b)] = rho
        return dataclasses.replace(self, variables=variables, study=how, correlation=correlation)

    def _with_material_scatter(self) -> StudySettings:
        """Return the settings with the scatter of the library, where it is asked for, about the values of the scene."""
        if not self.study.material_scatter:
            return self
        if self.scene.material is None:
            raise InputError("study.material_scatter: needs scene.material, a name of the library.")
        library = material(self.scene.material)
        variables, pairs = dict(self.variables), {a: dict(row) for a, row in self.correlation.items()}
        for place, value in library.values.items():
            mean = self.scene.numbers.get(place)
            if value.cov is not None and mean is not None and place not in variables:
                source = f"{library.source} (mean {value.confidence}, cov {value.cov_confidence})"
                variables[place] = Variable(distribution="lognormal", mean=mean, cov=value.cov, source=source)
        for (a, b), rho in library.correlation.items():
            if b not in pairs.get(a, {}) and a not in pairs.get(b, {}):
                pairs.setdefault(a, {})[b] = rho
        return dataclasses.replace(self, variables=variables, correlation=pairs)

    def _with_sample_table(self, folder: Path) -> StudySettings:
        """Read and check the table of samples; return the settings with its absolute path and its columns."""
        how = self.study
        if (how.table is None) != (how.sampler != "table"):
            raise InputError('study.table: goes with sampler = "table", which needs it.')
        if how.table is None or how.table_columns:
            return self
        file = str((folder / how.table).resolve())
        table = read_table(file, Scene.unit_of, self.scene.number_places())
        for place, values in table.items():
            for value in {values.min(), values.max()} if place != WEIGHT else ():
                try:
                    self.scene.with_values({place: float(value)})
                except InputError as error:
                    reason = str(error).removeprefix("sampled scene: ")
                    raise InputError(f"{file}: a value the scene cannot take: {reason}") from None
        columns = tuple(table)
        return dataclasses.replace(self, study=dataclasses.replace(how, table=file, table_columns=columns))

    def _with_measured_values(self, folder: Path) -> StudySettings:
        """Return the settings with the values themselves where variables name a file in a folder."""
        read = {p: v.with_values(p, Scene.unit_of(p), folder) for p, v in self.variables.items()}
        return self if read == self.variables else dataclasses.replace(self, variables=read)

    def check(self, source: str) -> None:
        """Check what only all tables together can tell; the source is for messages."""
        table = self.damage_table
        if isinstance(stop := self.study.stop_at_category, int) and stop > table.highest:
            raise InputError(
                f"{source}: [study] stop_at_category = {stop}: {table.name} goes up to category {table.highest}; "
                'take one of those, or "none" to solve every path to its end.'
            )
        if self.scene.dynamics is not None:
            raise InputError(
                f"{source}: [scene.dynamics]: a study follows the movement of the ground without time, so that each "
                "wall tells at which movement it reached a category; leave this table out, or run the walls one by one."
            )
        for place, variable in self.variables.items():
            if variable.field is not None and place.split(".")[0] not in ("joint", "head_joint", "dpc"):
                raise InputError(
                    f'{source}: [variables."{place}"] field: only numbers of joint, head_joint and dpc vary from '
                    "joint to joint."
                )
        self._check_correlation(source, self.scene.numbers)
        self._check_sampling(source)
        self._check_range(source)

    def _check_correlation(self, source: str, places: Collection[str]) -> None:
        stated: dict[frozenset[str], float] = {}
        for a, b, value in self._pairs():
            where, pair = f'{source}: [correlation] "{a}" with "{b}" = {value}', frozenset((a, b))
            for place in (a, b):
                if place in self.study.table_columns:
                    raise InputError(f'{where}: "{place}" is a column of the table, whose samples stay as they are.')
                if place not in self.variables:
                    what = (
                        "is a number of the scene without"
                        if place in places
                        else "is no variable of this study; there is no"
                    )
                    raise InputError(
                        f'{where}: "{place}" {what} table [variables."{place}"].' + nearest(place, self.variables)
                    )
            if a == b:
                raise InputError(f"{where}: a variable has correlation 1 with itself; leave this line out.")
            if not -1 <= value <= 1:
                raise InputError(f"{where}: must be a number from -1 to 1.")
            if stated.setdefault(pair, value) != value:
                raise InputError(f"{where}: the same pair is given {stated[pair]:g} before; leave one of them out.")

    def _check_sampling(self, source: str) -> None:
        how = self.study
        wall = [place for place, v in self.variables.items() if v.field is None]
        if how.replicates > 1 and how.sampler != "sobol":
            raise InputError(f"{source}: study.replicates = {how.replicates}: is for sampler = 'sobol' alone.")
        if how.importance and how.sampler == "table":
            raise InputError(f"{source}: [study.importance]: a table's samples are as they are; give it no importance.")
        if how.nominal_share and not how.importance:
            raise InputError(f"{source}: study.nominal_share = {how.nominal_share:g}: goes with [study.importance].")
        check(wall, how.importance)
        if how.stop_when is not None:
            how.stop_when.check()
            if how.movement == "sampled" and how.stop_when.quantity == "probability":
                raise InputError(
                    f'{source}: [study.stop_when]: with movement = "sampled" each wall is known at its own movement '
                    'alone, which tells no probability at one; take quantity = "median", or movement = "both".'
                )
            if how.stop_when.category > (highest := self.damage_table.highest):
                raise InputError(f"{source}: [study.stop_when] category: the damage table goes up to {highest}.")
            if how.stop_when.first % how.replicates:
                raise InputError(
                    f"{source}: [study.stop_when] first = {how.stop_when.first}: must be a multiple of replicates = "
                    f"{how.replicates}."
                )

    def _check_range(self, source: str) -> None:
        """Refuse distributions of which the scene cannot take the middle, or can never take the ends."""
        try:
            design = self.design()
        except InputError as error:
            library = " Those of the material's library are replaced by values given there." * (
                self.study.material_scatter and str(error).startswith("[correlation]")
            )
            raise InputError(f"{source}: {error}{library}") from None
        for place, marginal in design.marginals.items():
            for share in (1e-6, 0.5, 1 - 1e-6):
                value = float(marginal.ppf(share))
                try:
                    self.scene.with_values({place: value})
                except InputError as error:
                    reason = str(error).removeprefix("sampled scene: ")
                    raise InputError(
                        f'{source}: [variables."{place}"]: one wall in {1 / min(share, 1 - share):.0f} gets a value '
                        f"the scene cannot take: {reason} Use a distribution that stays in range, or lower and upper."
                    ) from None

    @one_blas_thread()
    def mean_wall(self) -> tuple[Scene, str]:
        """Return the scene with every variable at its mean, and a sentence that says so."""
        means = self.means()
        values = ", ".join(f"{place} = {_in_words(place, value)}" for place, value in means.items())
        movement = "" if any(p.split(".")[0] == "movement" for p in means) else ", the movement as given"
        return dataclasses.replace(self.scene.with_values(means), title=f"{self.title}: mean wall"), (
            f"{self.title}: its mean wall, with {values or 'nothing uncertain'}{movement} "
            "(arithmetic means, also of lognormals, above their medians; the same in every joint)"
        )

    def other_means(self) -> list[str]:
        """Return variables of which neither mean nor median is the scene's value, each in a sentence."""
        marginals, found = self.design().marginals, []
        for place, mean in self.means().items():
            variable, own = self.variables.get(place), self.scene.numbers[place]
            stated = [
                to_si(v, Scene.unit_of(place)) for v in (variable and variable.mean, variable and variable.median) if v
            ]
            centres = [mean, *stated, *([float(marginals[place].ppf(0.5))] if place in marginals else [])]
            if not any(math.isclose(own, centre, rel_tol=0.01) for centre in centres):
                default = self.scene.given is not None and place not in self.scene.given
                found.append(
                    f"variable {place}: mean {_in_words(place, mean)}, the scene has {_in_words(place, own)}"
                    f"{' by default' if default else ''}; walls follow the variable"
                )
        return found

    def means(self) -> dict[str, float]:
        """Return the mean of every variable, by place."""
        design = self.design()
        means = {place: float(marginal.mean()) for place, marginal in design.marginals.items()}
        if design.sampler.read_table is not None:
            table = dict(design.sampler.read_table())
            weight = table.pop(WEIGHT, None)
            means |= {place: float(np.average(values, weights=weight)) for place, values in table.items()}
        return means

    def _pairs(self) -> list[tuple[str, str, float]]:
        return [(a, b, value) for a, row in self.correlation.items() for b, value in row.items()]

    @property
    def title(self) -> str:
        """What the study asks."""
        return self.study.title or self.scene.title

    @property
    def shape_varies(self) -> bool:
        """Whether bricks and joints lie otherwise in each sample: numbers of wall, openings or control joints vary."""
        return any(place.split(".")[0] in ("wall", "opening", "control_joint") for place in self.variables)

    @property
    def damage_table(self) -> DamageTable:
        """The scene's damage table, with the plasterboard allowance where the scene asks for it."""
        return load_table(self.scene.damage.table, plasterboard=self.scene.damage.plasterboard)

    @property
    def last_category(self) -> float:
        """Category at which a path ends; infinite if none does."""
        stop = self.study.stop_at_category
        if stop == "none" or (stop is None and self.study.movement != "path"):
            return math.inf
        return stop or self.damage_table.highest

    @one_blas_thread()
    def design(self) -> Design:
        """Return the distributions made ready to draw from."""
        pairs = {frozenset((a, b)): value for a, b, value in self._pairs()}
        units = {place: Scene.unit_of(place) for place in self.variables}
        how = self.study

        def table() -> dict[str, FloatArray]:
            columns = {from_0(place): place for place in how.table_columns}  # headers of older studies
            found = read_table(str(how.table), Scene.unit_of, [*how.table_columns, *columns])
            return found if {*found} == {*how.table_columns} else {columns[place]: v for place, v in found.items()}

        sampler = Sampler(
            how.sampler,
            how.replicates,
            how.importance,
            how.nominal_share,
            how.table_columns,
            table if how.sampler == "table" else None,
            how.crossed,
        )
        return Design.make(self.variables, units, pairs, sampler, how.seed)

    def to_dict(self) -> dict[str, Any]:
        """Return nested dicts of plain values, in SI where the scene is."""
        content: dict[str, Any] = {"study": plain(self.study)}
        content["variables"] = {place: plain(v) for place, v in self.variables.items()}
        if self.correlation:
            content["correlation"] = {a: dict(row) for a, row in self.correlation.items()}
        content["scene"] = self.scene.to_dict()
        return content

    def to_toml(self) -> str:
        """Return the study as TOML, its scene inside, complete with defaults."""
        import tomli_w

        return tomli_w.dumps({VERSION: SCHEMA_VERSION, **self.to_dict()})

    def with_samples(self, samples: int | None, seed: int | None) -> StudySettings:
        """Return the settings with another number of samples or another seed, where given.

        Parameters
        ----------
        samples : int or None
            1 or more; None keeps the number.
        seed : int or None
            0 or more; None keeps the seed.

        Raises
        ------
        InputError
            If one is out of range.
        """
        changes: dict[str, Any] = {k: v for k, v in (("samples", samples), ("seed", seed)) if v is not None}
        if not changes:
            return self
        if changes.get("samples", 1) < 1 or changes.get("seed", 0) < 0:
            raise InputError("the number of samples must be 1 or more, and the seed 0 or more.")
        return dataclasses.replace(self, study=dataclasses.replace(self.study, **changes))


def _in_words(place: str, value: float) -> str:
    shown, unit = quantity(value, Scene.unit_of(place))
    return shown if unit == "–" else f"{shown} {unit}"


def merged(tables: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Nested tables with changes; lists are replaced."""
    both = dict(tables)
    for key, value in changes.items():
        old = both.get(key)
        both[key] = merged(old if isinstance(old, Mapping) else {}, value) if isinstance(value, Mapping) else value
    return both


def differing_keys(first: Mapping[str, Any], second: Mapping[str, Any], place: str = "") -> list[str]:
    """List the keys, dotted, in which two nested mappings differ."""
    found: list[str] = []
    for key in sorted({*first, *second}):
        here = f"{place}.{key}" if place else str(key)
        a, b = first.get(key), second.get(key)
        if isinstance(a, Mapping) and isinstance(b, Mapping):
            found += differing_keys(a, b, here)
        elif a != b:
            found.append(f"{here} (was {a!r}, is {b!r})")
    return found


def read_frozen(text: str) -> StudySettings:
    """Study settings from their frozen copy; of a pair correlated twice the last value counts, as it did."""
    tables = parse_toml(text, "study.toml")
    tables["study"] = {key: value for key, value in tables.get("study", {}).items() if key != "coarse"}
    pairs = {frozenset((a, b)): (a, b, r) for a, row in tables.get("correlation", {}).items() for b, r in row.items()}
    if pairs:
        tables["correlation"] = {a: {d: r for c, d, r in pairs.values() if c == a} for a, *_ in pairs.values()}
    if tables.get(VERSION, 0) < COUNTS_FROM_1:
        tables = _of_older(tables)
    return StudySettings.of_tables(tables, Path(), "study.toml")


def _of_older(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables of a frozen study whose places count from 0 and whose soil is inert below its log."""

    def counted(values: Mapping[str, Any]) -> dict[str, Any]:
        return {from_1(place): value for place, value in values.items()}

    how = dict(tables["study"])
    found = {**tables, "study": how, "variables": counted(tables.get("variables", {}))}
    found["correlation"] = counted({a: counted(row) for a, row in tables.get("correlation", {}).items()})
    how["importance"] = counted(how.get("importance", {}))
    how["epistemic"] = {name: counted(other) for name, other in how.get("epistemic", {}).items()}
    how["table_columns"] = [from_1(place) for place in how.get("table_columns", ())]
    for holder, key in ((found, "scene"), (how, "fields_from")):
        if key in holder:
            holder[key] = inert_below_log(holder[key])
    return found
