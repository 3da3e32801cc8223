"""Settings of the solver and of the damage assessment."""

from __future__ import annotations

import itertools
import re
import warnings
from collections.abc import Mapping
from dataclasses import field, replace
from datetime import date, datetime
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from damagepred.errors import InputError
from damagepred.inputs.text import category_names, check_title, written_date
from damagepred.scene.accuracy import Accuracy, filled_in, preset
from damagepred.scene.described import completed_by, described
from damagepred.scene.quantity import Count, Length, Pure

AdvancedTables = dict[str, dict[str, Any]]
"""Options of the solvers' algorithms by table and key; ``damagepred.solvers.options`` checks them."""


def _of_today(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return a ``[solver]`` table of an older version in the keys of this one."""
    table = {key: value for key, value in given.items() if key != "rigid_error"}
    if table.get("blocks") == "auto":
        table["blocks"] = "elastic"
        warnings.warn(
            "solver.blocks = 'auto' is read as 'elastic': bricks are no longer cut by an estimate; write 'elastic', or "
            "'deformable' for zones in all of them",
            stacklevel=2,
        )
    return table


@described
class Solver:
    """Solver of the equilibrium path (``[solver]``).

    Examples
    --------
    >>> from damagepred import Solver
    >>> Solver(method="explicit").method
    'explicit'
    >>> Solver().blocks, Solver(accuracy="standard").blocks
    ('elastic', 'rigid')
    """

    method: Literal["quasi_static", "explicit"] = "quasi_static"
    """``quasi_static``: the equilibrium path itself, bond by bond, without time, damping or loading rate. ``explicit``:
    Cundall's scheme, time stepping with damping until forces balance."""
    accuracy: Accuracy = "fine"
    """Preset of the keys below; a key given here takes precedence. ``fine`` are their defaults, ``standard`` has rigid
    bricks. ``damagepred check --full`` shows the keys of each preset and its measured errors. Without this key and
    ``blocks``, zones in a part, and ``lump_block_elasticity = false``, imply ``standard``."""
    blocks: Literal["rigid", "elastic", "deformable"] = "elastic"
    """``rigid``: their elasticity is lumped in series with the joints. ``elastic``: rectangles also stretch along their
    bed and bend; other polygons, supported and moved blocks and the footing stay rigid. ``deformable``: cut into
    constant-strain triangles, zones, with assumed strains in bending. "auto" of older files is read as ``elastic``."""
    above_dpc: Literal["rigid", "elastic", "deformable"] | None = None
    """Kind of blocks above the dpc; None: as ``blocks``. Without a dpc the whole wall is above."""
    below_dpc: Literal["rigid", "elastic", "deformable"] | None = None
    """Kind of blocks below the dpc; None: as ``blocks``."""
    zone_size: Length | None = Field(default=None, gt=0)
    """Largest edge of the cells, of four zones each, of deformable blocks (m). None: the width of the block for
    ``quasi_static``, half of it for ``explicit``."""
    zone_size_above_dpc: Length | None = Field(default=None, gt=0)
    """Size above the dpc (m); None: ``zone_size``."""
    zone_size_below_dpc: Length | None = Field(default=None, gt=0)
    """Size below the dpc (m); None: ``zone_size``."""
    zone_size_footing: Length | None = Field(default=None, gt=0)
    """Size in the footing (m). None: half its depth for ``quasi_static``, a quarter for ``explicit``, and a sixth on
    jacks and on a mound."""
    footing: Literal["none", "beam", "deformable"] | None = None
    """``none``: the underside of the wall follows the movement. ``beam``: the footing is a chain of segments on jacks
    or on a mound. ``deformable``: it is a beam of zones under the wall, with a mortar bed between. None: ``beam`` on
    jacks and on a mound, ``none`` with a prescribed movement."""
    elastic_subdivisions: Count = Field(default=4, ge=2, le=16)
    """Parts, along the length of an elastic block, of its bed joint on a body that does not bend: ground or footing."""
    plane: Literal["stress", "strain"] = "stress"
    """Whether zones are free to expand out of plane, as in a wall, or held."""
    brick_cracks: Literal["reached", "all", "none"] = "reached"
    """Whether rigid and elastic bricks have a potential crack in the middle, where ``[block]`` has tensile_strength and
    fracture_energy. ``reached``: a path is solved with whole bricks, and again with bricks that break once one has 80 %
    of its strength. ``all``: bricks that break from the start. ``none``: bricks do not break."""
    lump_block_elasticity: bool = True
    """Whether the elasticity of rigid blocks is lumped into the joints (True), or only the joints are elastic."""
    quadrature: Literal["lobatto", "midpoint"] = "lobatto"
    """Position of the contacts of an interface. Lobatto includes both ends and is exact for the elastic joint from 3
    contacts on (Simpson); with 2 the joint is three times too stiff in rotation."""
    contacts_per_interface: Count = Field(default=3, ge=1, le=9)
    """2 to 9 (Lobatto) or 1 to 9 (midpoint)."""
    no_tension_subdivisions: Count | None = Field(default=None, ge=1, le=16)
    """Equal parts of interfaces of joints without a bond (dpc, soil, dry joints), each with its contacts (composite
    quadrature). Such joints are in contact over a part of their length, which three contacts resolve too coarsely.
    None: 4 with the three contacts of Lobatto, 1 with any other quadrature and in dynamic runs."""
    tolerance: Pure | None = Field(default=None, gt=0)
    """Largest unbalanced force in equilibrium, as a multiple of the mean block weight. None: 1e-6 for ``quasi_static``,
    1e-3 for ``explicit``."""
    step_energy_tolerance: Pure = Field(default=0.01, gt=0)
    """Energy error along the path that the quasi-static solver allows, as a share of the largest external work. A step
    with too much opening or slip is repeated in shorter steps, so that opening and friction are followed closely with
    any number of increments. With a large value each increment is one step."""
    condense: bool = True
    """Whether the quasi-static solver condenses parts of the wall statically while their joints stay elastic. A part is
    recovered when one of its joints would slide or break. False checks every joint in every step."""
    damping: Pure = Field(default=0.8, ge=0, lt=1)
    """Local damping of the explicit solver: share of the unbalanced force that opposes the motion, 0 <= damping < 1.
    Where zones do not settle between failing joints, it is reduced to 0.1."""
    ramp_cycles: Count = Field(default=10_000, ge=1)
    """Cycles over which the explicit solver applies one increment's movement before the wall settles. A fast movement
    may crack joints that a slow one does not."""
    ramp_pieces: Count = Field(default=100, ge=1)
    """Straight pieces of a ramp. Where the form of the ground changes as its movement grows, every point of the ground
    moves in a straight line between its exact states at their ends."""
    maximum_cycles: Count = Field(default=200_000, ge=1)
    """Limit of the explicit solver's cycles in an increment that does not settle."""
    time_step_safety: Pure = Field(default=0.9, gt=0, le=1)
    """Fraction of the explicit solver's largest stable time step, which follows from stiffness and damping."""
    energy_tolerance: Pure = Field(default=0.05, gt=0)
    """Energy error, as a share of the largest work done, above which screen, archive and report show a caution. Changes
    no result."""
    snap_through_tolerance: Pure = Field(default=0.05, gt=0)
    """Energy released in snap-through, as a share of the largest work done, above which they show a caution. In
    snap-through the wall moves by itself to a distant equilibrium, and the result depends on the number of increments.
    Changes no result."""
    displacement_tolerance: Pure = Field(default=0.05, gt=0)
    """Displacement of a block beyond the ground's, as a share of the larger of the wall's length and height. Above it a
    wall is marked ``implausible``, as the equations are for small displacements. Changes no result."""
    crack_tolerance: Pure = Field(default=0.05, gt=0)
    """Width of the widest crack, as a share of the same, above which a wall is marked ``implausible``. Changes no
    result."""
    symmetric_half: bool = True
    """Whether one half is solved of a wall that is its own mirror image in geometry, properties, loads and movement.
    False solves it in full."""
    advanced: AdvancedTables | None = field(default=None, hash=False)
    """Tables of options of the algorithms, for experts, such as ``[solver.advanced.newton] max_iterations = 30``; keys,
    meanings and defaults: ``damagepred.solvers.options``."""

    _by_accuracy = completed_by(lambda table: filled_in(_of_today(table)))

    def with_accuracy(self, accuracy: Accuracy) -> Solver:
        """Same settings with all keys of another preset."""
        return replace(self, accuracy=accuracy, **preset(accuracy, self.method))

    @property
    def no_tension_parts(self) -> int:
        """Number of parts of interfaces without a bond."""
        if self.no_tension_subdivisions is not None:
            return self.no_tension_subdivisions
        return 4 if (self.quadrature, self.contacts_per_interface) == ("lobatto", 3) else 1

    @property
    def tolerance_used(self) -> float:
        """Given tolerance, or the default of the method."""
        if self.tolerance is not None:
            return self.tolerance
        return 1e-6 if self.method == "quasi_static" else 1e-3

    def require_no_zones(self) -> None:
        """Refuse deformable blocks and footings, for runs in time."""
        for key in ("blocks", "above_dpc", "below_dpc", "footing"):
            if getattr(self, key) == "deformable":
                raise InputError(
                    f"solver.{key} = 'deformable': a run in time has no zones; take "
                    f"'{'beam' if key == 'footing' else 'elastic'}', or leave out [dynamics]."
                )

    @model_validator(mode="after")
    def _quadrature_exists(self) -> Solver:
        if self.quadrature == "lobatto" and self.contacts_per_interface < 2:
            raise ValueError("contacts_per_interface = 1: Lobatto needs 2 or more; or take quadrature = 'midpoint'")
        return self


@described
class DamageState:
    """Damage state in one's own words (``[[damage.state]]``), from the undamaged wall up.

    The first state has a name alone. A wall is in the highest state of which it reaches any threshold.

    Examples
    --------
    >>> from damagepred import Damage, scene
    >>> crack = scene.DamageState(name="Haarriss", width="0.2 mm", psi=1.5)
    >>> Damage(state=(scene.DamageState(name="schadlos"), crack)).state[1].width
    0.0002
    """

    name: str
    """Name in any language: letters, digits, spaces, ``_`` and ``-``."""
    width: Length | None = Field(default=None, gt=0)
    """Smallest width of the widest crack (m)."""
    band: Length | None = Field(default=None, gt=0)
    """Smallest width of the widest crack band (m)."""
    count: Pure | None = Field(default=None, gt=0)
    """Smallest number of separate cracks of 0.1 mm or more."""
    length: Length | None = Field(default=None, gt=0)
    """Smallest length of all cracks together (m)."""
    psi: Pure | None = Field(default=None, gt=0)
    """Smallest damage parameter Psi (1)."""
    distortion: Pure | None = Field(default=None, gt=0)
    """Smallest distortion of an opening: change of a right angle at its corners (rad)."""
    value: Pure | None = Field(default=None, gt=0)
    """Smallest value of ``damage.function``."""


STATE_MEASURES = ("width", "band", "count", "length", "psi", "distortion", "value")
MOST_STATES = 6  # number of states up to which drawings have colours


@described
class Damage:
    """Damage category from openings (``[damage]``).

    Examples
    --------
    >>> from damagepred import Damage
    >>> Damage().table
    'as2870'
    >>> Damage(measure="band").band_gauge
    0.75
    """

    table: Literal["as2870", "bre251"] = "as2870"
    """Limits of crack width: AS 2870-2011 Table C1, or BRE Digest 251 with its category 5."""
    plasterboard: bool = False
    """Whether the wall is lined with easily repaired plasterboard or similar: limits rise by half (AS 2870)."""
    count_rule: bool = True
    """Whether a group of cracks of 3 mm or more is moderate damage even if all are narrower than 5 mm (AS 2870)."""
    group_distance: Length = Field(default=1.0, gt=0)
    """Largest distance between the widest points of cracks in a group (m)."""
    group_count: Count = Field(default=2, ge=2)
    """Number of cracks in a group."""
    dpc_threshold: Length = Field(default=1e-3, gt=0)
    """Opening above which the dpc counts as separated (m)."""
    measure: Literal["joint", "band"] = "joint"
    """Width that determines the category. ``joint``: the widest crack, the opening of one joint, which depends on how
    neighbouring joints share an opening. ``band``: the widest crack band, the openings of neighbouring joints added up
    along a gauge. Archives also have the category by the band, as ``damage_category_band``."""
    band_gauge: Length = Field(default=0.75, gt=0)
    """Length of the gauge across a crack band (m); see ``damage.crack_bands``. The default spans three bricks of 240 mm
    and their four head joints. Their sum depends less on how they share an opening than the widest of them. Where bonds
    of less than 10 kPa break at once, it also depends on the solver (``studies/quasi_static_agreement``). Take about
    three units if they are longer. It is less than ``group_distance``: cracks of a group are separate cracks, which
    ``count_rule`` counts."""
    band_threshold: Length = Field(default=0.0, ge=0)
    """Opening above which a broken joint counts in a crack band (m). Above 0 the width depends on how neighbouring
    joints share an opening."""
    footing_threshold: Length = Field(default=1e-3, gt=0)
    """Opening of the bed on the footing above which it counts as separated (m)."""
    count_footing_gap: bool = False
    """Whether a gap along the bed on the footing counts as a crack of a wall without a dpc. By default no: damage
    tables have the widths of cracks in walls, and a wall that lifts off as a whole is not torn. With the gap the
    category would follow the ground's movement alone. But an owner sees it as a crack: reports show where it would
    increase the category."""
    state: tuple[DamageState, ...] = ()
    """Own states, instead of the table: two to six, from the undamaged wall up."""
    function: str | None = None
    """Python function ``module:function`` of the measure ``value``, of an installed module or of one in the working
    folder. It takes a dictionary of arrays by archive variable (``crack_width_max``, ``crack_band_width_max``,
    ``crack_count``, ``crack_length_total``, ``psi``, ``opening_distortion`` and the widths below the wall proper), and
    returns an array of the same shape."""

    @model_validator(mode="after")
    def _states_rise(self) -> Damage:
        if self.function is not None and re.fullmatch(r"[\w.]+:\w+", self.function) is None:
            raise ValueError(f"function = '{self.function}': must be module:function, such as 'mine:severity'")
        values = [state.value for state in self.state if state.value is not None]
        if bool(values) != (self.function is not None):
            raise ValueError("function: goes with value in [[damage.state]]; give both, or neither of them")
        if not self.state:
            if self.plasterboard and self.table != "as2870":
                raise ValueError(
                    f"plasterboard = true: table '{self.table}' has no such allowance; use table = 'as2870'"
                )
            return self
        if not 2 <= len(self.state) <= MOST_STATES:
            raise ValueError(f"state: there are {len(self.state)}; give 2 to {MOST_STATES}, the undamaged wall first")
        if self.table != "as2870" or self.plasterboard:
            raise ValueError("state: own states replace the damage table; leave out table and plasterboard, or them")
        names = category_names(state.name for state in self.state)
        for number, (name, state) in enumerate(zip(names, self.state), 1):
            given = [measure for measure in STATE_MEASURES if getattr(state, measure) is not None]
            if number == 1 and given:
                raise ValueError(f"state 1, '{name}', {given[0]}: the first state is the undamaged wall; name it alone")
            if number > 1 and not given:
                raise ValueError(f"state {number}, '{name}': needs a threshold ({', '.join(STATE_MEASURES)})")
        for measure in STATE_MEASURES:
            limits = [(n, v) for n, s in zip(names, self.state) if (v := getattr(s, measure)) is not None]
            for (lower, before), (higher, limit) in itertools.pairwise(limits):
                if limit <= before:
                    raise ValueError(
                        f"state: {measure} = {limit:g} of '{higher}' must be greater than {before:g} of '{lower}'"
                    )
        return self


def _iso_date(value: Any) -> Any:
    """Date as ``2026-11-28``."""
    day = isinstance(value, date) and not isinstance(value, datetime)
    return (value if day else written_date(str(value))).isoformat()


@described
class Report:
    """Head of the report (``[report]``, in scene and study files), for the file. It changes no result.

    To change the head of a finished study, edit its file and run the same ``damagepred study`` command again.

    Examples
    --------
    >>> from damagepred.scene import Report
    >>> Report(client="A. Owner", date="2026-11-28").date
    '2026-11-28'
    """

    project: Annotated[str, AfterValidator(check_title)] | None = None
    """Project or address."""
    client: Annotated[str, AfterValidator(check_title)] | None = None
    """Client."""
    author: Annotated[str, AfterValidator(check_title)] | None = None
    """Author of the report."""
    date: Annotated[str, BeforeValidator(_iso_date)] | None = None
    """Date of the report or of the site visit, such as ``2026-11-28``."""
    revision: Annotated[str, AfterValidator(check_title)] | None = None
    """Revision, such as ``"B"``."""
