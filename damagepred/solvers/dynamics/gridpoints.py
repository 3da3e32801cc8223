"""Gridpoints and zones of deformable blocks in a dynamic run: motion, strains and results."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.errors import InputError
from damagepred.kernels.dynamics.zones import FACET_BODY, ZONE, ZONE_TERMS
from damagepred.solvers.dynamics.body_motion import Motion
from damagepred.solvers.dynamics.facets import FacetBodies
from damagepred.solvers.state.increment import ZoneResults
from damagepred.solvers.state.zone_history import zone_results
from damagepred.solvers.system.deformable_blocks import (
    at_gridpoints,
    bending,
    block_moduli,
    can_yield,
    elastic_stress,
    gridpoint_mass,
    zone_slopes,
)
from damagepred.solvers.system.discrete_system import DiscreteSystem


class Grid(NamedTuple):
    """Gridpoints, g of them, z zones and s bodies on facets.

    Attributes
    ----------
    reference : array (g, 2)
        Initial places of the gridpoints, from the run's origin (m).
    displacement, velocity : array (g, 2)
        From there (m); half a step ago (m/s).
    force : array (g, 2)
        Of zones and contacts (N).
    load, live_load : array (g, 2)
        Load now, dead and live, and live load at full movement (N).
    inverse_mass : array (g, 2)
        1 / mass, 0 where prescribed (1/kg).
    held : array of int (h,)
        Prescribed degrees of freedom, 2 gridpoint + axis.
    held_start, held_displacement : array (h,)
        Their displacement at the start, and its change at full movement (m).
    boundary : array of int (b,)
        Gridpoints on the faces of blocks.
    searched_at : array (g, 2)
        Displacements at the last neighbour search (m).
    zones : array of record (z,)
        ``ZONE``.
    elasticity, strength : array (n, 7)
        Of the blocks; see ``damagepred.kernels.zone.law``.
    plastic, stress : array (y, 4)
        Of the zones that can yield: plastic strain e_xx, e_yy, g_xy, e_zz, and stress of the last step (Pa), in the
        frame that turns with the zone.
    state : array of int (y,)
        ``ZoneState`` of those zones.
    past : array (z, 9)
        Strain, stress and damping stress of the last step; nothing without stiffness-proportional damping.
    facets : array of record (s,)
        ``FACET_BODY``.
    terms : array (ZONE_TERMS,)
        Works so far (J).
    """

    reference: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    force: FloatArray
    load: FloatArray
    live_load: FloatArray
    inverse_mass: FloatArray
    held: IntArray
    held_start: FloatArray
    held_displacement: FloatArray
    boundary: IntArray
    searched_at: FloatArray
    zones: NDArray[Any]
    elasticity: FloatArray
    strength: FloatArray
    plastic: FloatArray
    stress: FloatArray
    state: IntArray
    past: FloatArray
    facets: NDArray[Any]
    terms: FloatArray


def gridpoint_arrays(model: Model, origin: FloatArray, facets: FacetBodies, damped: bool) -> Grid | None:
    """Return the gridpoints and zones of a model at rest in their initial places; None if all blocks are rigid."""
    mesh = model.mesh
    if mesh is None:
        return None
    count = mesh.x.size
    place = np.full(model.size, -1, dtype=np.int64)
    place[mesh.dof_x], place[mesh.dof_y] = 2 * np.arange(count), 2 * np.arange(count) + 1
    single = model.supports.prescribed >= 3 * (model.n_blocks + 1)
    held = place[model.supports.prescribed[single]]
    mass = np.repeat(gridpoint_mass(model)[:, None], 2, axis=1)
    inverse = np.divide(1.0, mass, out=np.zeros_like(mass), where=mass > 0)
    inverse.ravel()[held] = 0.0
    free = np.ones(2 * count, dtype=np.bool_)
    free[held] = False
    bare = np.flatnonzero(free & (mass.ravel() == 0))
    if bare.size:
        raise InputError(
            f"{model.describe_block(int(mesh.gridpoint_block[bare[0] // 2]))} has no mass, so it cannot move in "
            f"time: give its material a density greater than 0, or hold it."
        )
    nothing, system = np.zeros((count, 2)), DiscreteSystem.of(model)
    yields = int(can_yield(model)[mesh.zone_block].sum())
    return Grid(
        reference=np.column_stack((mesh.x, mesh.y)) - origin,
        displacement=nothing,
        velocity=nothing.copy(),
        force=nothing.copy(),
        load=at_gridpoints(model, system.dead_load),
        live_load=at_gridpoints(model, system.live_load),
        inverse_mass=inverse,
        held=held,
        held_start=np.zeros(len(held)),
        held_displacement=model.supports.prescribed_displacement[single],
        boundary=np.flatnonzero(mesh.on_boundary),
        searched_at=nothing.copy(),
        zones=_zones(model),
        elasticity=block_moduli(model)[0],
        strength=block_moduli(model)[1],
        plastic=np.zeros((yields, 4)),
        stress=np.zeros((yields, 4)),
        state=np.zeros(yields, dtype=np.int64),
        past=np.zeros((len(mesh.zones) if damped else 0, 9)),
        facets=_facet_records(facets),
        terms=np.zeros(ZONE_TERMS),
    )


def _zones(model: Model) -> NDArray[Any]:
    mesh = model.mesh
    assert mesh is not None
    zones = np.zeros(len(mesh.zones), dtype=ZONE)
    block = mesh.zone_block
    zones["a"], zones["b"], zones["c"] = mesh.zones.T
    zones["block"] = block
    yields = can_yield(model)[block]
    zones["history"] = np.where(yields, np.cumsum(yields) - 1, -1)
    slopes = zone_slopes(mesh)
    zones["b_x"], zones["b_y"], zones["c_x"], zones["c_y"] = slopes.reshape(-1, 4).T
    zones["gamma"], extra = bending(model)
    for name, values in zip(("xx_x", "xx_y", "yy_x", "yy_y", "xy_x", "xy_y"), extra.reshape(-1, 6).T):
        zones[name] = values
    zones["volume"] = mesh.zone_area * model.block_law.thickness[block]
    return zones


def _facet_records(facets: FacetBodies) -> NDArray[Any]:
    records = np.zeros(len(facets.start), dtype=FACET_BODY)
    records["start"], records["end"], records["share"] = facets.start, facets.end, facets.share
    way = facets.x_end - facets.x_start
    records["along_x"], records["along_y"] = way.T / np.hypot(*way.T)
    return records


def update_facet_poses(grid: Grid, motion: Motion) -> None:
    """Update position and direction of each facet (x, y, cosine, sine) from its two gridpoints."""
    at, facets = grid.reference + grid.displacement, grid.facets
    start, chord = at[facets["start"]], at[facets["end"]] - at[facets["start"]]
    first_facet = len(motion.displacement)
    length = np.hypot(*chord.T)
    motion.pose[first_facet:, :2] = start + facets["share"][:, None] * chord
    motion.pose[first_facet:, 2] = (facets["along_x"] * chord[:, 0] + facets["along_y"] * chord[:, 1]) / length
    motion.pose[first_facet:, 3] = (facets["along_x"] * chord[:, 1] - facets["along_y"] * chord[:, 0]) / length


def set_initial_velocity(grid: Grid, model: Model) -> None:
    """Set the gridpoints' velocity to the initial rigid-body velocity of their blocks, about the present centroids."""
    mesh = model.mesh
    if mesh is None or model.initial_velocity is None:
        return
    block = mesh.gridpoint_block
    moves = model.initial_velocity[block]
    at = grid.reference + grid.displacement
    weight = gridpoint_mass(model)
    centre = np.column_stack([np.bincount(block, weight * x, model.n_blocks) for x in at.T])
    arm = at - (centre / np.bincount(block, weight, model.n_blocks).clip(min=1e-300)[:, None])[block]
    free = grid.inverse_mass > 0
    velocity = moves[:, :2] + moves[:, 2:] * np.column_stack((-arm[:, 1], arm[:, 0]))
    grid.velocity[free] = velocity[free]


def biot_strains(grid: Grid) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return corotational strain e_xx, e_yy, g_xy, e_zz of the zones (z, 4), cosine and sine of their rotation (z,).

    See ``damagepred.kernels.dynamics.zones``.
    """
    zones, u = grid.zones, grid.displacement
    b, c = u[zones["b"]] - u[zones["a"]], u[zones["c"]] - u[zones["a"]]
    h_xx, h_yx = (zones["b_x"][:, None] * b + zones["c_x"][:, None] * c).T
    h_xy, h_yy = (zones["b_y"][:, None] * b + zones["c_y"][:, None] * c).T
    trace, twist = 2.0 + h_xx + h_yy, h_yx - h_xy
    length = np.hypot(trace, twist)
    cosine, sine = trace / length, twist / length
    strain = np.column_stack(
        (
            cosine * h_xx + sine * h_yx + (cosine - 1.0),
            cosine * h_yy - sine * h_xy + (cosine - 1.0),
            2.0 * (cosine * h_xy + sine * (1.0 + h_yy)),
            np.zeros(len(zones)),
        )
    )
    hourglass = np.repeat((zones["gamma"][:, None] * u[zones["a"]]).reshape(-1, 4, 2).sum(axis=1), 4, axis=0)
    p_x, p_y = cosine * hourglass[:, 0] + sine * hourglass[:, 1], cosine * hourglass[:, 1] - sine * hourglass[:, 0]
    for i, name in enumerate(("xx", "yy", "xy")):
        strain[:, i] += zones[f"{name}_x"] * p_x + zones[f"{name}_y"] * p_y
    return strain, cosine, sine


def plastic_strains(grid: Grid) -> FloatArray:
    """Return the plastic strain of all zones, array (z, 4)."""
    plastic = np.zeros((len(grid.zones), 4))
    history = grid.zones["history"]
    plastic[history >= 0] = grid.plastic[history[history >= 0]]
    return plastic


def zone_energy(grid: Grid) -> float:
    """Return the elastic energy of the zones (J)."""
    elastic = biot_strains(grid)[0] - plastic_strains(grid)
    return 0.5 * float(
        (
            grid.zones["volume"] * (elastic * elastic_stress(grid.elasticity[grid.zones["block"]], elastic)).sum(axis=1)
        ).sum()
    )


def results_of_zones(grid: Grid, base: FloatArray) -> ZoneResults:
    """Return the zones' stresses and states, and the gridpoints' displacements.

    Stresses are rotated from the corotated frame to x and y.
    """
    strain, c, s = biot_strains(grid)
    plastic = plastic_strains(grid)
    s_xx, s_yy, s_xy, s_zz = elastic_stress(grid.elasticity[grid.zones["block"]], strain - plastic).T
    mean, half = 0.5 * (s_xx + s_yy), 0.5 * (s_xx - s_yy)
    double_c, double_s = c * c - s * s, 2.0 * c * s
    turned = half * double_c - s_xy * double_s
    stress = np.column_stack((mean + turned, mean - turned, half * double_s + s_xy * double_c, s_zz))
    state = np.zeros(len(strain), dtype=np.int8)
    history = grid.zones["history"]
    state[history >= 0] = grid.state[history[history >= 0]]
    return zone_results(grid.displacement - base, stress, plastic, state)


class MeanMotion:
    """Motion of deformable blocks as a whole: mean displacement by mass, and best-fit rotation.

    Parameters
    ----------
    model : Model
        With a mesh.
    grid : Grid
        Its gridpoints at the start.
    """

    def __init__(self, model: Model, grid: Grid) -> None:
        assert model.mesh is not None
        self._grid, self.block = grid, model.mesh.block
        self._owner = np.repeat(np.arange(len(self.block)), np.diff(model.mesh.first_gridpoint))
        weight = gridpoint_mass(model)
        if not weight.all():
            weight = np.ones_like(weight)
        self._share = weight / self._sum(weight)[self._owner]
        self._arm = self._about(grid.reference)
        self._inertia = self._sum(self._share * (self._arm**2).sum(axis=1))
        self._turn, self._spin, self._time = self._angle(), self._spinning(), 0.0

    def _sum(self, values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(self._owner, values, len(self.block)), dtype=np.float64)

    def _mean(self, values: FloatArray) -> FloatArray:
        return np.column_stack([self._sum(self._share * column) for column in values.T])

    def _about(self, values: FloatArray) -> FloatArray:
        return values - self._mean(values)[self._owner]

    def _angle(self) -> FloatArray:
        now = self._about(self._grid.reference + self._grid.displacement)
        across = self._sum(self._share * (self._arm[:, 0] * now[:, 1] - self._arm[:, 1] * now[:, 0]))
        return np.arctan2(across, self._sum(self._share * (self._arm * now).sum(axis=1)))

    def _spinning(self) -> FloatArray:
        now, v = self._about(self._grid.reference + self._grid.displacement), self._about(self._grid.velocity)
        return self._sum(self._share * (now[:, 0] * v[:, 1] - now[:, 1] * v[:, 0])) / self._inertia

    def motion(self, time: float) -> FloatArray:
        """Return displacement x, y (m) and rotation (rad) of the deformable blocks (d, 3) at a time (s).

        Full turns since the last call follow from the mean angular velocity.
        """
        spin, angle = self._spinning(), self._angle()
        expected = self._turn + 0.5 * (self._spin + spin) * (time - self._time)
        self._turn = angle + 2.0 * np.pi * np.round((expected - angle) / (2.0 * np.pi))
        self._spin, self._time = spin, time
        return np.column_stack((self._mean(self._grid.displacement), self._turn))
