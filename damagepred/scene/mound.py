"""Free-field movement of the ground's surface: swelling soil, trees, leaks and tunnels."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from damagepred.arrays import FloatArray
from damagepred.enumerations import LOCAL
from damagepred.scene.described import described
from damagepred.scene.footing_profile import bell, gaussian, require_positions, through_points
from damagepred.scene.movement import Movement
from damagepred.scene.movement_stage import UP, Kind
from damagepred.scene.quantity import Length, Pure

REACTIVE = ("walsh", "mitchell")  # mounds of reactive clay, with a fixed middle


@described
class Mound:
    """Free-field movement of the ground (``[mound]``), read with ``[movement] shape = "mound"``.

    ``walsh`` and ``mitchell`` are the mounds of reactive clay, with a fixed middle. In doming the edges shrink and go
    down by y_m, in dishing they swell and go up by y_m. With the other shapes the ground settles locally
    (``movement.kind = "settle"``) or heaves (``"heave"``); older files have "dishing" for settle and "doming" for
    heave.

    The movement runs through the mounds of increasing ``surface_movement``: each state is the mound of its own
    movement, with the history of the joints. The edge distance of walsh follows the present movement; all other
    forms, ``table`` included, keep their fractions.

    Examples
    --------
    >>> from damagepred import Mound, Movement, Scene
    >>> scene = Scene(movement=Movement(shape="mound"), mound=Mound(surface_movement="60 mm", suction_depth="2.3 m"))
    >>> scene.mound.surface_movement
    0.06
    """

    shape: Literal["walsh", "mitchell", "tree", "pipe", "tunnel", "table"] = "walsh"
    """``walsh``: flat, with a parabola over the edge distance. ``mitchell``: a power of the distance from the middle.
    ``tree``: largest at the tree, 0 at its reach. ``pipe``: a bell over a wet patch. ``tunnel``: Gaussian trough across
    a tunnel. ``table``: as given."""
    surface_movement: Length = Field(default=0.04, ge=0)
    """For walsh and mitchell the characteristic surface movement y_s of the site (m), otherwise the largest
    movement."""
    movement_ratio: Pure | None = Field(default=None, ge=0)
    """y_m / y_s (1), for walsh and mitchell. None: 0.7 in doming and 0.5 in dishing (AS 2870-2011)."""
    suction_depth: Length = Field(default=4.0, gt=0)
    """H_s (m), depth of changes in moisture: 1.5 m in wet climates to 4 m and more in dry ones
    (``data/ground/site_classes.toml``)."""
    embedment: Length = Field(default=0.0, ge=0)
    """D_e (m), depth of the footing's edge below the ground, for mitchell."""
    edge_distance: Length | None = Field(default=None, gt=0)
    """e (m) of walsh, at most half the wall's length. None: by the formulas below."""
    doming_suction_divisor: Pure = Field(default=8.0, gt=0)
    """The 8 in e = H_s / 8 + y_m / 36 in doming, with e and H_s in m and y_m in mm."""
    doming_movement_divisor: Pure = Field(default=36.0, gt=0)
    """The 36 in e = H_s / 8 + y_m / 36."""
    dishing_length_share: Pure = Field(default=0.2, gt=0)
    """The 0.2 in e = 0.2 L in dishing, at most 0.6 m + y_m / 25, with y_m in mm."""
    dishing_edge_base: Length = Field(default=0.6, gt=0)
    """The 0.6 m in 0.6 m + y_m / 25."""
    dishing_movement_divisor: Pure = Field(default=25.0, gt=0)
    """The 25 in 0.6 m + y_m / 25."""
    exponent: Pure | None = Field(default=None, ge=1)
    """Exponent of mitchell (None: 1.5 L / (H_s - D_e)) and of tree (None: 2)."""
    exponent_factor: Pure = Field(default=1.5, gt=0)
    """Factor 1.5 of this exponent."""
    position: Length | None = None
    """Tree, middle of the wet patch, or axis of the tunnel, along the wall from its left end (m), also outside the
    wall. None: the left end for the tree, otherwise the middle."""
    reach: Length | None = Field(default=None, gt=0)
    """Distance (m) from a tree to its last movement; None: the wall's length. Half width of the wet patch; None: half
    the wall's length. Distance i of the trough's inflection point from the tunnel's axis; None: trough_width times the
    tunnel's depth."""
    tunnel_depth: Length | None = Field(default=None, gt=0)
    """z_0 of the tunnel's axis below the footing (m); with it the ground also moves along the wall."""
    trough_width: Pure = Field(default=0.5, gt=0)
    """K = i / z_0 of a tunnel (1): 0.5 in clay (O'Reilly and New 1982)."""
    table: tuple[tuple[Pure, Pure], ...] = ()
    """For ``shape = "table"``: position along the wall from 0 to 1, and the movement there as a fraction of
    ``surface_movement``; a monotone cubic (PCHIP) between. In a scene file it may be the name of a file, as in
    ``movement.table``; movements with a unit (up positive) have sign and size."""
    table_ends: Literal["refuse", "cut", "level", "extend"] = "refuse"
    """See ``[movement] table_ends``."""

    @model_validator(mode="after")
    def _complete(self) -> Mound:
        if self.shape == "mitchell" and self.exponent is None and self.embedment >= self.suction_depth:
            raise ValueError(
                f"embedment = {self.embedment:g} m: must be less than suction_depth = {self.suction_depth:g} m, below "
                "which nothing moves; or give the exponent"
            )
        if self.shape == "tunnel" and self.reach is None and self.tunnel_depth is None:
            raise ValueError(
                "reach: is missing; shape = 'tunnel' needs the distance of the trough's inflection point from the axis "
                "(m), or tunnel_depth, from which it follows"
            )
        if self.shape != "table":
            if self.table:
                raise ValueError(f"table: only read with shape = 'table'; here shape = '{self.shape}'")
            return self
        require_positions("table", self.table, 2)
        return self

    def largest(self, kind: Kind) -> float:
        """Largest movement of the free surface (m): y_m for walsh and mitchell."""
        if self.shape in LOCAL:
            return self.surface_movement
        default = 0.7 if kind == "doming" else 0.5
        return (default if self.movement_ratio is None else self.movement_ratio) * self.surface_movement

    def read_keys(self, movement: Movement) -> set[str]:
        """Keys that the shape reads."""
        keys = {"shape", "surface_movement"}
        if self.shape == "walsh":
            doming = {"suction_depth", "doming_suction_divisor", "doming_movement_divisor"}
            dishing = {"dishing_length_share", "dishing_edge_base", "dishing_movement_divisor"}
            more = doming | dishing if movement.reverses else doming if movement.kind == "doming" else dishing
            return keys | {"movement_ratio", "edge_distance"} | (more if self.edge_distance is None else set())
        if self.shape == "mitchell":
            of_depth = {"suction_depth", "embedment", "exponent_factor"} if self.exponent is None else set()
            return keys | {"movement_ratio", "exponent"} | of_depth
        if self.shape == "table":
            return keys | {"table"}
        of_tunnel = {"tunnel_depth"} if self.reach else {"tunnel_depth", "trough_width"}
        more = {"tree": {"exponent"}, "tunnel": of_tunnel}.get(self.shape, set())
        return keys | {"position", "reach"} | more

    def at(self, load_factor: float) -> Mound:
        """Mound at a part of the surface movement: a growing movement passes through these."""
        return replace(self, surface_movement=load_factor * self.surface_movement)

    def proportional(self, length: float, kind: Kind) -> bool:
        """Whether the mounds of smaller surface movements have the same form under a wall.

        The edge distance of a Walsh mound grows with the movement up to a limit.

        Parameters
        ----------
        length, kind
            Same as for ``profile``.
        """
        return self.shape != "walsh" or self.at(0.0).edge(length, kind) == self.edge(length, kind)

    def profile(self, x: FloatArray, length: float, kind: Kind) -> FloatArray:
        """Vertical displacement (m, upwards) of the free surface at full movement.

        Parameters
        ----------
        x : array of float
            Distance from the left end of the wall (m), any shape.
        length : float
            Length of the wall (m).
        kind : {"dishing", "doming", "settle", "heave"}
            Kind of movement.
        """
        x = np.asarray(x, dtype=np.float64)
        size = self.largest(kind) if kind in UP else -self.largest(kind)
        if size == 0.0:  # the edge of a Walsh mound may be 0
            return np.zeros_like(x)
        if self.shape in REACTIVE:
            return -size * clay_form(self, x, length, kind)
        if self.shape == "table":
            return size * through_points(self.table, x / length)
        return size * local_form(self, x - self.axis(length), length)

    def horizontal(self, x: FloatArray, length: float, kind: Kind) -> FloatArray:
        """Horizontal displacement (m, to the right) of the free surface at full movement.

        Parameters
        ----------
        x, length, kind
            Same as for ``profile``.

        Notes
        -----
        0 except for a tunnel of known depth: u = v (x - x_axis) / z_0, with v the vertical displacement, upwards. Every
        point moves towards the tunnel's axis (O'Reilly and New 1982; Attewell and Woodman 1982).
        """
        x = np.asarray(x, dtype=np.float64)
        if self.shape != "tunnel" or self.tunnel_depth is None:
            return np.zeros_like(x)
        return self.profile(x, length, kind) * (x - self.axis(length)) / self.tunnel_depth

    def edge(self, length: float, kind: Kind) -> float:
        """Edge distance e (m) of the Walsh mound under a wall.

        Parameters
        ----------
        length, kind
            Same as for ``profile``.

        Notes
        -----
        AS 2870-2011, Appendix F. By the manual of a design program (CORD of FMG Engineering), e depends on y_m and H_s
        in doming, and on y_m in dishing; it has the units (secondary). The numbers in the formulas are assumed.
        """
        if self.edge_distance is not None:
            return min(self.edge_distance, length / 2.0)
        millimetres = 1e3 * self.largest(kind)
        if kind == "doming":
            edge = self.suction_depth / self.doming_suction_divisor + millimetres / self.doming_movement_divisor
        else:
            most = self.dishing_edge_base + millimetres / self.dishing_movement_divisor
            edge = min(self.dishing_length_share * length, most)
        return min(edge, length / 2.0)

    def mound_exponent(self, length: float) -> float:
        """Exponent m of the Mitchell mound under a wall of some length (m): 1.5 L / (H_s - D_e), AS 2870 (assumed)."""
        if self.exponent is not None:  # below 1, for short walls on deep clay, the mound has a cusp in the middle
            return self.exponent
        return self.exponent_factor * length / (self.suction_depth - self.embedment)

    def axis(self, length: float) -> float:
        """Position of tree, wet patch or tunnel along a wall of ``length`` (m from the left end)."""
        if self.position is not None:
            return self.position
        return 0.0 if self.shape == "tree" else length / 2.0

    def extent(self, length: float) -> float:
        """Reach of tree or wet patch, or inflection distance of the trough (m)."""
        if self.reach is not None:
            return self.reach
        if self.shape == "tunnel" and self.tunnel_depth is not None:
            return self.trough_width * self.tunnel_depth
        return length if self.shape == "tree" else length / 2.0


def clay_form(mound: Mound, x: FloatArray, length: float, kind: Kind) -> FloatArray:
    """Mound of reactive clay under a wall: 0 in the middle, 1 at both ends."""
    if mound.shape == "walsh":
        return walsh(x, length, mound.edge(length, kind))
    return mitchell(x, length, mound.mound_exponent(length))


def local_form(mound: Mound, away: FloatArray, length: float) -> FloatArray:
    """Movement at distances (m) from a tree, a wet patch or a tunnel's axis, 1 at the largest."""
    reach = mound.extent(length)
    if mound.shape == "tree":
        return tree(away, reach, mound.exponent or 2.0)
    return gaussian(away, reach) if mound.shape == "tunnel" else bell(away, reach)


def walsh(x: FloatArray, length: float, edge: float) -> FloatArray:
    """Walsh mound: 0 in the middle, a parabola over the edge distance, 1 at both ends.

    Method of Walsh (1978), Walsh and Walsh (1986) and AS 2870; for its history see Payne and Cameron (2014), Australian
    Journal of Structural Engineering 15(2). The form (d / e)^2, with d the distance into the edge strip, is assumed.
    """
    into = np.maximum(np.abs(x - length / 2.0) - (length / 2.0 - edge), 0.0)
    return (into / edge) ** 2


def mitchell(x: FloatArray, length: float, exponent: float) -> FloatArray:
    """Mitchell mound: |2 x' / L|^m with x' measured from the middle; 0 in the middle, 1 at both ends.

    Mitchell (1980), The structural analysis of footings on expansive soil; Mitchell (1984), A simple method of design
    of shallow footings on expansive soil, Fifth International Conference on Expansive Soils. The form is assumed.
    """
    return np.abs(2.0 * x / length - 1.0) ** exponent


def tree(away: FloatArray, reach: float, exponent: float = 2.0) -> FloatArray:
    """Drying by a tree: 1 at the tree, (1 - d / reach)^2 at a distance d, 0 beyond its reach.

    The form is this project's choice. The reach is about the tree's height, more for rows and groups of trees (AS
    2870-2011, Appendix H; Cameron and Beal 2011, Australian Geomechanics 46(3); the figure is assumed).
    """
    return np.maximum(1.0 - np.abs(away) / reach, 0.0) ** exponent
