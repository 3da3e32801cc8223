"""Settings of the solver and of the judgement of damage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any, Literal

from pydantic import Field, model_validator
from pydantic_core import ArgsKwargs

from damagepred.scene.accuracy import Accuracy, filled_in, preset
from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Length, Pure

AdvancedTables = dict[str, dict[str, Any]]
"""Options of the solvers' algorithms by table and key; ``damagepred.solvers.options`` checks them."""


@described
class Solver:
    """How the path of equilibria is found (``[solver]``).

    Attributes
    ----------
    method : {"quasi_static", "explicit"}
        ``quasi_static``: the path of equilibria itself, bond by bond, without time, damping or loading rate.
        ``explicit``: Cundall's scheme, time stepping with damping until forces balance.
    accuracy : {"draft", "standard", "fine", "reference"}
        A preset: what it sets of the keys below, each of which may be given besides and then stands. ``standard`` are
        their defaults. ``damagepred check`` tells what each sets and the errors that were measured with it; see
        ``damagepred.scene.accuracy``.
    blocks : {"rigid", "elastic", "deformable", "auto"}
        ``rigid``: their elasticity is lumped in series with the joints. ``elastic``: rectangles stretch along their bed
        and bend besides; other polygons, supported and moved blocks and the footing stay rigid. ``deformable``: cut
        into constant-strain triangles, zones, with assumed strains in bending. ``auto``: the wall is solved with rigid
        blocks first, and those are cut for which the joints' forces say that it matters; see ``rigid_error``.
    rigid_error : float
        For ``auto``: the strain energy that rigid blocks leave out or make up, as a share of that in the wall.
    above_dpc, below_dpc : {"rigid", "elastic", "deformable"} or None
        Another choice for the blocks of one part of the wall; None: as ``blocks`` says. Without a dpc all is above.
    zone_size : float or None
        Largest edge of the cells, of four zones each, into which deformable blocks are cut (m). None: the width of the
        block for ``quasi_static``, half of it for ``explicit``.
    zone_size_above_dpc, zone_size_below_dpc, zone_size_footing : float or None
        Another size in one part of the wall (m). The footing's is half its depth for ``quasi_static``, a quarter for
        ``explicit``, and a sixth where it finds its own shape (on jacks, on a mound), unless given here.
    footing : {"none", "beam", "deformable"} or None
        ``none``: the underside of the wall follows the movement. ``beam``: the footing is a chain of segments on jacks
        or on a mound. ``deformable``: it is a beam of zones under the wall, with a mortar bed between. None: ``beam``
        on jacks and on a mound, ``none`` with a prescribed movement.
    elastic_subdivisions : int
        Parts, along the length of an elastic block, of its bed joint on a body that does not bend: ground or footing.
    plane : {"stress", "strain"}
        Whether zones are free to expand out of plane, as in a wall, or held.
    lump_block_elasticity : bool
        Whether the elasticity of rigid blocks is lumped into the joints (True), or the joints alone are elastic.
    quadrature : {"lobatto", "midpoint"}
        Where the contacts of an interface lie. Lobatto includes both ends and is exact for the elastic joint
        from 3 contacts on (Simpson); with 2 the joint is three times too stiff in rotation.
    contacts_per_interface : int
        2 to 9 (Lobatto) or 1 to 9 (midpoint).
    no_tension_subdivisions : int or None
        Equal parts into which interfaces of joints without a bond (dpc, soil, dry joints) are cut. Each part has its
        contacts (composite quadrature). These stand on a part of their length, and three contacts see that too
        coarsely. None: 4 with the three contacts of Lobatto, 1 with any other quadrature and in dynamic runs.
    tolerance : float or None
        Forces are in balance when the largest unbalanced force is below this multiple of the mean block weight.
        None: 1e-6 for ``quasi_static``, 1e-3 for ``explicit``.
    step_energy_tolerance : float
        Energy error, summed along the path, that the quasi-static solver allows as a share of the largest external
        work. A step in which joints open or slide too much for it is repeated in shorter ones. So it follows opening
        and friction closely, whatever the number of increments. A large value leaves the steps as the increments make
        them.
    condense : bool
        Whether the quasi-static solver condenses parts of the wall statically while their joints stay elastic. A part
        is recovered when one of its joints would slide or break. False looks at every joint in every step.
    damping : float
        Local damping of the explicit solver: share of the unbalanced force that opposes the motion, 0 <= damping < 1.
        Where zones do not settle between joints that give way, it goes down by itself, to 0.1.
    ramp_cycles : int
        Cycles over which the explicit solver applies one increment's movement before the wall is left to settle. A
        faster movement cracks joints that a slow one leaves whole.
    ramp_pieces : int
        Straight pieces of which such a ramp is made. Where the form of the ground changes as its movement grows, every
        point of the ground moves in a straight line between its exact states at their ends.
    maximum_cycles : int
        Cycles after which the explicit solver gives up an increment that has not settled.
    time_step_safety : float
        Fraction of the explicit solver's largest stable time step, which is known from the stiffness and the damping.
    energy_tolerance : float
        Energy error, as a share of the largest work done, beyond which the screen, the archive and the report say so.
        Changes no result.
    snap_through_tolerance : float
        Energy set free in snap-through, as a share of the largest work done, beyond which the same places say so. In
        snap-through the wall moves by itself to an equilibrium that is not near, and the result depends on the number
        of increments. Changes no result.
    displacement_tolerance : float
        Displacement of a block beyond that of the ground, as a share of the larger of the wall's length and height.
        Above it a wall is marked ``implausible``, as the equations take displacements as small. Changes no result.
    crack_tolerance : float
        Width of the widest crack, as a share of the same, above which a wall is marked so. Changes no result.
    symmetric_half : bool
        Whether one half is solved of a wall that is its own mirror image in geometry, properties, loads and movement.
        False solves it in full.
    advanced : mapping or None
        Tables of options of the algorithms, for experts, such as ``[solver.advanced.newton] max_iterations = 30``;
        keys, meanings and defaults: ``damagepred.solvers.options``.

    Examples
    --------
    >>> from damagepred import Solver
    >>> Solver(method="explicit").method
    'explicit'
    >>> Solver(blocks="elastic").blocks
    'elastic'
    """

    method: Literal["quasi_static", "explicit"] = "quasi_static"
    accuracy: Accuracy = "standard"
    blocks: Literal["rigid", "elastic", "deformable", "auto"] = "rigid"
    rigid_error: Pure = Field(default=0.01, gt=0)
    above_dpc: Literal["rigid", "elastic", "deformable"] | None = None
    below_dpc: Literal["rigid", "elastic", "deformable"] | None = None
    zone_size: Length | None = Field(default=None, gt=0)
    zone_size_above_dpc: Length | None = Field(default=None, gt=0)
    zone_size_below_dpc: Length | None = Field(default=None, gt=0)
    zone_size_footing: Length | None = Field(default=None, gt=0)
    footing: Literal["none", "beam", "deformable"] | None = None
    elastic_subdivisions: Count = Field(default=4, ge=2, le=16)
    plane: Literal["stress", "strain"] = "stress"
    lump_block_elasticity: bool = True
    quadrature: Literal["lobatto", "midpoint"] = "lobatto"
    contacts_per_interface: Count = Field(default=3, ge=1, le=9)
    no_tension_subdivisions: Count | None = Field(default=None, ge=1, le=16)
    tolerance: Pure | None = Field(default=None, gt=0)
    step_energy_tolerance: Pure = Field(default=0.01, gt=0)
    condense: bool = True
    damping: Pure = Field(default=0.8, ge=0, lt=1)
    ramp_cycles: Count = Field(default=10_000, ge=1)
    ramp_pieces: Count = Field(default=100, ge=1)
    maximum_cycles: Count = Field(default=200_000, ge=1)
    time_step_safety: Pure = Field(default=0.9, gt=0, le=1)
    energy_tolerance: Pure = Field(default=0.05, gt=0)
    snap_through_tolerance: Pure = Field(default=0.05, gt=0)
    displacement_tolerance: Pure = Field(default=0.05, gt=0)
    crack_tolerance: Pure = Field(default=0.05, gt=0)
    symmetric_half: bool = True
    advanced: AdvancedTables | None = field(default=None, hash=False)

    @model_validator(mode="before")
    @classmethod
    def _by_accuracy(cls, given: Any) -> Any:
        if isinstance(given, ArgsKwargs):
            return ArgsKwargs(given.args, filled_in(given.kwargs or {}))
        return filled_in(given) if isinstance(given, Mapping) else given

    def with_accuracy(self, accuracy: Accuracy) -> Solver:
        """Return the same settings with all that another preset sets, whatever these keys are now.

        Parameters
        ----------
        accuracy : {"draft", "standard", "fine", "reference"}
            The preset.
        """
        return replace(self, accuracy=accuracy, **preset(accuracy, self.method))

    @property
    def no_tension_parts(self) -> int:
        """Parts into which the interfaces of joints without a bond are cut."""
        if self.no_tension_subdivisions is not None:
            return self.no_tension_subdivisions
        return 4 if (self.quadrature, self.contacts_per_interface) == ("lobatto", 3) else 1

    @property
    def tolerance_used(self) -> float:
        """The tolerance, or the method's own."""
        if self.tolerance is not None:
            return self.tolerance
        return 1e-6 if self.method == "quasi_static" else 1e-3

    @model_validator(mode="after")
    def _quadrature_exists(self) -> Solver:
        if self.quadrature == "lobatto" and self.contacts_per_interface < 2:
            raise ValueError("contacts_per_interface = 1: Lobatto needs 2 or more; or take quadrature = 'midpoint'")
        return self


@described
class Damage:
    """How openings become a damage category (``[damage]``).

    Attributes
    ----------
    table : {"as2870", "bre251"}
        Limits of crack width: AS 2870-2011 Table C1, or BRE Digest 251 with its category 5.
    plasterboard : bool
        Whether the wall is lined with easily repaired plasterboard or the like: limits rise by half (AS 2870).
    count_rule : bool
        Whether a group of cracks of 3 mm or more is moderate damage even if none reaches 5 mm (AS 2870).
    group_distance : float
        Cracks whose widest points lie within this distance form a group (m).
    group_count : int
        Number of such cracks that makes a group.
    dpc_threshold : float
        Opening of the dpc from which it counts as separated (m).
    measure : {"joint", "band"}
        Width that the category is found by. ``joint``: the widest single joint, which hangs on how neighbouring joints
        share an opening. ``band``: the widest crack band, what a gauge reads that spans neighbouring joints. Archives
        hold the category by the band besides, as ``damage_category_band``.
    band_gauge : float
        Length of the gauge laid across a crack band (m); see ``damagepred.damage.bands``. The default spans three
        bricks of 240 mm and their four head joints: across them solvers agree where single joints do not
        (``studies/quasi_static_agreement``). Take about three units where they are longer. It is less than
        ``group_distance``: cracks that make a group are cracks of their own, which ``count_rule`` counts.
    band_threshold : float
        Opening from which a broken joint counts in a crack band (m). Above 0 the width hangs on how neighbouring joints
        share an opening, of which a band's width is otherwise free.
    footing_threshold : float
        Opening of the bed on the footing from which it counts as separated (m).
    count_footing_gap : bool
        Whether a gap along the bed on the footing counts as a crack of a wall without a dpc. Not by default: the widths
        of damage tables are those of cracks in walls, and a wall that lifts off as a whole is not torn. The gap would
        make the category follow the ground's movement alone. But an owner sees it as a crack: reports say where it
        would make the category higher.

    Examples
    --------
    >>> from damagepred import Damage
    >>> Damage().table
    'as2870'
    >>> Damage(measure="band").band_gauge
    0.75
    """

    table: Literal["as2870", "bre251"] = "as2870"
    plasterboard: bool = False
    count_rule: bool = True
    group_distance: Length = Field(default=1.0, gt=0)
    group_count: Count = Field(default=2, ge=2)
    dpc_threshold: Length = Field(default=1e-3, gt=0)
    measure: Literal["joint", "band"] = "joint"
    band_gauge: Length = Field(default=0.75, gt=0)
    band_threshold: Length = Field(default=0.0, ge=0)
    footing_threshold: Length = Field(default=1e-3, gt=0)
    count_footing_gap: bool = False

    @model_validator(mode="after")
    def _allowance_exists(self) -> Damage:
        if self.plasterboard and self.table != "as2870":
            raise ValueError(f"plasterboard = true: table '{self.table}' has no such allowance; use table = 'as2870'")
        return self
