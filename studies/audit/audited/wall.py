"""One archived wall as arrays: geometry, loads and laws, read from the dataset and from its scene alone.

This module does not call the package. The blocks on both sides of a contact follow from the polygons, the law of each
contact from the scene's tables.
"""

from __future__ import annotations

import itertools
import tomllib
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from damagepred.arrays import BoolArray, FloatArray, Int8Array, IntArray

BED, HEAD, DPC, FOOTING, SOIL, SUPPORT, SECTION, CONTROL = range(8)
"""Values of ``contact_kind``."""
INTACT, CRACKED, SLIPPING = range(3)
"""Values of ``contact_state``."""
GRAVITY = 9.81
"""Acceleration of gravity (m/s2)."""
UNLIMITED = 1e12
"""Strength (Pa) from which a joint counts as unbreakable: sections of a footing, bilateral supports."""

EXPONENT = 5.0
"""a in the integrity exp(-a xi) - xi exp(-a) of exponential softening."""


class Law(NamedTuple):
    """Law of each contact, arrays (c,): FACTS 1 and the tables of the scene, with stiffness lumped.

    Attributes
    ----------
    normal_stiffness, shear_stiffness : array
        k_n and k_s (Pa/m), the elasticity of rigid bricks in series.
    tensile_strength, cohesion, friction : array
        f_t (Pa), at most C / tan(phi); C (Pa) and tan(phi).
    residual_tensile_strength, residual_cohesion, residual_friction : array
        The same without bond.
    dilation : array
        tan(psi).
    critical_opening : array
        w_c (m) where the bond softens, else 0: 2 G_f / f_t if linearly.
    exponential : array of bool
        Whether the bond softens exponentially.
    fracture_energy : array
        G_f and shear G_f (J/m2) of bonds that soften, summed; else 0.
    compressive_strength, cap_shear : array
        f_c (Pa, infinite without cap) and C_ss.
    gap : array
        By which a control joint closes before it is pressed (m).
    """

    normal_stiffness: FloatArray
    shear_stiffness: FloatArray
    tensile_strength: FloatArray
    cohesion: FloatArray
    friction: FloatArray
    residual_tensile_strength: FloatArray
    residual_cohesion: FloatArray
    residual_friction: FloatArray
    dilation: FloatArray
    critical_opening: FloatArray
    exponential: BoolArray
    fracture_energy: FloatArray
    compressive_strength: FloatArray
    cap_shear: FloatArray
    gap: FloatArray


class ArchivedWall:
    """A dataset of one wall as arrays; n blocks, c contacts, s increments.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``damagepred.solve`` returns it for a scene.
    """

    def __init__(self, ds: xr.Dataset) -> None:
        self.ds = ds
        self.scene: dict[str, Any] = tomllib.loads(ds.attrs["scene"])
        self.steps = ds.sizes["increment"]
        self.collapsed = ds.attrs["status"] == "collapsed"
        self.standing = self.steps - 1 if self.collapsed else self.steps
        self.n = ds.sizes["block"]

    def __getitem__(self, name: str) -> NDArray[Any]:
        return np.asarray(self.ds[name].values)

    @property
    def explicit(self) -> bool:
        """Whether the explicit solver made it."""
        return bool(self.ds.attrs["solver_method"] == "explicit")

    @property
    def tolerance(self) -> float:
        """Tolerance of the solver, in mean block weights."""
        return float(self.scene["solver"].get("tolerance", 1e-3 if self.explicit else 1e-6))

    @property
    def shape(self) -> str:
        """Shape of the movement."""
        return str(self.scene["movement"]["shape"])

    @cached_property
    def polygons(self) -> list[FloatArray]:
        """Corners of each block (m), counter-clockwise."""
        owner, place = self["vertex_block"], np.column_stack((self["vertex_x"], self["vertex_y"]))
        return [place[owner == block] for block in range(self.n)]

    @cached_property
    def area(self) -> FloatArray:
        """Area of each block's elevation (m2)."""
        return np.array([0.5 * np.sum(_cross(p, np.roll(p, -1, axis=0))) for p in self.polygons])

    @cached_property
    def centroid(self) -> FloatArray:
        """Centroid of each block (m), array (n, 2)."""
        found = []
        for p, area in zip(self.polygons, self.area, strict=True):
            origin = p.mean(axis=0)
            q = p - origin
            after = np.roll(q, -1, axis=0)
            found.append(origin + (_cross(q, after)[:, None] * (q + after)).sum(axis=0) / (6.0 * area))
        return np.array(found)

    @cached_property
    def gyration(self) -> FloatArray:
        """Radius of gyration of each block about its centroid (m)."""
        polar = []
        for p, centre in zip(self.polygons, self.centroid, strict=True):
            q = p - centre
            after = np.roll(q, -1, axis=0)
            square = (q * q).sum(axis=1) + (q * after).sum(axis=1) + (after * after).sum(axis=1)
            polar.append((_cross(q, after) * square).sum() / 12.0)
        return np.sqrt(np.array(polar) / self.area)

    @cached_property
    def in_footing(self) -> BoolArray:
        """Blocks of the footing."""
        return self["block_course"] < 0

    @cached_property
    def deformable(self) -> BoolArray:
        """Blocks of zones."""
        zoned = np.zeros(self.n, dtype=bool)
        if "zone_block" in self.ds:
            zoned[np.unique(self["zone_block"])] = True
        return zoned

    @cached_property
    def elastic(self) -> BoolArray:
        """Blocks with a strain and a curvature: upright rectangles of the wall, where the scene asks for them."""
        if self.scene["solver"]["blocks"] != "elastic":
            return np.zeros(self.n, dtype=bool)
        return ~self.in_footing & np.array([len(p) == 4 for p in self.polygons])

    @cached_property
    def size(self) -> FloatArray:
        """Length and height of each block (m), array (n, 2)."""
        return np.array([np.ptp(p, axis=0) for p in self.polygons])

    def side_motion(self, side: IntArray) -> FloatArray:
        """Return how a unit strain and a unit curvature of the blocks on one side move contacts: array (c, 2, 2).

        The last axis is x and y. The field of a block is replaced along an interface by its mean (Simpson's rule, exact
        for the quadratic) and its slope at the middle.
        """
        number = np.minimum(side, self.n - 1)
        here = (side < self.n) & self.elastic[number]
        nu = self.scene["block"]["poisson_ratio"]
        length, height = self.size[number].T

        def field(place: FloatArray) -> FloatArray:
            x, y = (place - self.centroid[number]).T
            bow = 0.5 * x**2 - length**2 / 24 + nu * (0.5 * y**2 - height**2 / 24)
            return np.stack((np.column_stack((x, -nu * y)), np.column_stack((-x * y, bow))), axis=1)

        first, middle, last = self.ends[self.interface, 0], self.middle[self.interface], self.ends[self.interface, 1]
        mean = (field(first) + 4.0 * field(middle) + field(last)) / 6.0
        reach = (last - first)[:, None, :]
        along = (self.place - middle)[:, None, :]
        share = (along * reach).sum(axis=2, keepdims=True) / (reach**2).sum(axis=2, keepdims=True)
        across = self.normal[:, None, :]
        # the chord of a quadratic has its slope at the middle; only its part across turns the side
        chord = ((field(last) - field(first)) * across).sum(axis=2, keepdims=True) * across
        return np.where(here[:, None, None], mean + share * chord, 0.0)

    @cached_property
    def strain_rows(self) -> tuple[FloatArray, FloatArray]:
        """Motion of contacts by strain and curvature of the blocks before and behind them, (c, 2, 2) each."""
        before, behind = (self.side_motion(side) for side in self.sides)
        return before, behind

    @cached_property
    def strain_stiffness(self) -> FloatArray:
        """E A (N m) of each block's strain and E I b (N m3) of its curvature, array (n, 2)."""
        length, height = self.size.T
        wide = self.scene["block"]["elastic_modulus"] * self.scene["wall"]["thickness"] * length * height
        return np.column_stack((wide, wide * height**2 / 12.0))

    def strains(self, step: int) -> FloatArray:
        """Return strain (1) and curvature (1/m) of each block, 0 of rigid ones: array (n + 1, 2), the ground last."""
        found = np.zeros((self.n + 1, 2))
        if self.elastic.any():
            found[: self.n] = np.column_stack([self[f"block_{name}"][step] for name in ("strain", "curvature")])
            found[: self.n][~self.elastic] = 0.0
        return found

    @cached_property
    def weight(self) -> FloatArray:
        """Weight of each block (N)."""
        wall, footing = self.scene["wall"], self.scene["footing"]
        density = np.where(self.in_footing, footing["density"], self.scene["block"]["density"])
        thickness = np.where(self.in_footing, footing["width"], wall["thickness"])
        return GRAVITY * density * thickness * self.area

    @cached_property
    def roof(self) -> FloatArray:
        """Roof load on each block (N), by its length at the top of the wall."""
        height = self.scene["wall"]["height"]
        at_top = np.array([p[:, 1].max() > height * (1 - 1e-9) for p in self.polygons])
        share = np.where(at_top, [np.ptp(p[:, 0]) for p in self.polygons], 0.0)
        return self.scene["loads"]["roof"] * share / max(share.sum(), 1e-300)

    @property
    def increments(self) -> int:
        """Number of increments of the scene."""
        return int(self.scene["movement"]["increments"])

    @property
    def yardstick(self) -> float:
        """Mean dead load of a block (N), which scales unbalanced forces."""
        return float(self.ds.attrs["mean_block_weight"])

    def largest_motion(self, step: int) -> float:
        """Return the largest displacement of any corner in an increment, about (m)."""
        moved = (np.abs(self[f"block_displacement_{axis}"][step]).max() for axis in "xy")
        turn = np.abs(self["block_rotation"][step]).max()
        reach = max(float(np.abs(p - c).max()) for p, c in zip(self.polygons, self.centroid, strict=True))
        return float(max(*moved, turn * reach))

    @cached_property
    def stiffness(self) -> tuple[FloatArray, FloatArray]:
        """Stiffness of each contact (Pa/m), that of a Timoshenko beam where it is a section of the footing."""
        k_n, k_s = self.law.normal_stiffness.copy(), self.law.shear_stiffness.copy()
        here = self["contact_kind"] == SECTION
        if here.any():
            footing = self.scene["footing"]
            first, second = (self.centroid[np.minimum(side[here], self.n - 1), 0] for side in self.sides)
            h, modulus = np.abs(second - first), footing["elastic_modulus"]
            area, inertia = footing["width"] * footing["depth"], footing["width"] * footing["depth"] ** 3 / 12.0
            shear_modulus = modulus / (2.0 * (1.0 + footing["poisson_ratio"]))
            across = h / (5.0 / 6.0 * shear_modulus * area) + h**3 / (12.0 * modulus * inertia)
            k_n[here], k_s[here] = modulus / h, 1.0 / (area * across)
        return k_n, k_s

    @property
    def stiffest(self) -> float:
        """Largest stiffness of a contact (N/m)."""
        return float((np.maximum(*self.stiffness) * self.contact_area).max(initial=0.0))

    @cached_property
    def contact_area(self) -> FloatArray:
        """Tributary area of each contact (m2)."""
        return self["contact_length"] * self["contact_thickness"]

    @cached_property
    def place(self) -> FloatArray:
        """Place of each contact (m), array (c, 2)."""
        return np.column_stack((self["contact_x"], self["contact_y"]))

    @cached_property
    def normal(self) -> FloatArray:
        """Unit normal of each contact, array (c, 2)."""
        return np.column_stack((self["contact_normal_x"], self["contact_normal_y"]))

    @cached_property
    def tangent(self) -> FloatArray:
        """Unit tangent of each contact, array (c, 2)."""
        return np.column_stack((self.normal[:, 1], -self.normal[:, 0]))

    @cached_property
    def interface(self) -> IntArray:
        """Interface of each contact."""
        return self["contact_interface"].astype(np.int64)

    @cached_property
    def middle(self) -> FloatArray:
        """Middle of each interface (m), array (m, 2)."""
        weight = self.contact_area
        whole = np.bincount(self.interface, weight)
        return np.column_stack([np.bincount(self.interface, weight * self.place[:, k]) / whole for k in (0, 1)])

    @cached_property
    def ends(self) -> FloatArray:
        """Ends of each interface (m), array (m, 2, 2)."""
        first = np.unique(self.interface, return_index=True)[1]
        reach = 0.5 * np.bincount(self.interface, self["contact_length"])[:, None] * self.tangent[first]
        return np.stack((self.middle - reach, self.middle + reach), axis=1)

    @cached_property
    def sides(self) -> tuple[IntArray, IntArray]:
        """Blocks before and behind each contact along its normal, (c,) each; n is the ground."""
        first = np.unique(self.interface, return_index=True)[1]
        kind, normal = self["contact_kind"][first], self.normal[first]
        eps = 1e-3 * float(np.sqrt(self.area.min()))
        a, b = (np.full(len(first), self.n, dtype=np.int64) for _ in range(2))
        for side, sign in ((a, -1.0), (b, 1.0)):
            for block, polygon in enumerate(self.polygons):
                edge = np.roll(polygon, -1, axis=0) - polygon
                to = (self.middle + sign * eps * normal)[:, None] - polygon[None]
                # a bearing may lie on a corner, that of two segments or of the footing's end
                slack = np.where(kind == SUPPORT, 1e-9, 0.0)[:, None] - 1e-12
                inside = ((edge[:, 0] * to[..., 1] - edge[:, 1] * to[..., 0]) > -slack * np.abs(edge).max()).all(axis=1)
                side[inside & (side == self.n)] = block
        self._part_bearings(kind, a, b)
        return a[self.interface], b[self.interface]

    def _part_bearings(self, kind: Int8Array, a: IntArray, b: IntArray) -> None:
        """Assign the second of two bearings at one place, where two segments meet, to the right segment."""
        at = np.flatnonzero(kind == SUPPORT)
        for before, after in itertools.pairwise(at):
            if abs(self.middle[after, 0] - self.middle[before, 0]) > 1e-9:
                continue
            for side in (a, b):
                if side[after] < self.n:
                    x = self.middle[after, 0]
                    meet = [i for i in np.flatnonzero(self.in_footing) if abs(self.polygons[i][:, 0].min() - x) < 1e-6]
                    side[after] = meet[0]

    @cached_property
    def law(self) -> Law:
        """Law of each contact."""
        scene, kind = self.scene, self["contact_kind"]
        joint = scene["joint"]
        dpc = (
            joint
            | {
                "tensile_strength": 0.0,
                "dilation": 0.0,
                "residual_tensile_strength": 0.0,
                "residual_cohesion": 0.0,
                "residual_friction": None,
                "fracture_energy": 0.0,
                "shear_fracture_energy": 0.0,
            }
            | scene.get("dpc", {})
        )
        bare = {"tensile_strength": 0.0, "cohesion": 0.0, "friction": 0.0}
        held = bare | {"tensile_strength": np.inf, "cohesion": np.inf}
        table = {
            BED: joint,
            HEAD: self._head(joint),
            DPC: dpc,
            FOOTING: scene["footing"].get("joint", joint),
            SOIL: bare | self._soil(),
            SUPPORT: self._support(bare, held),
            SECTION: held,
            CONTROL: bare | {name: joint[name] for name in ("normal_stiffness", "shear_stiffness")},
        }

        def each(name: str, missing: float) -> FloatArray:
            values = [table[k].get(name, missing) for k in range(len(table))]
            return np.array([missing if v is None else v for v in values], dtype=np.float64)[kind]

        k_n, k_s = self._lumped(each("normal_stiffness", np.nan), each("shear_stiffness", np.nan))
        friction, cohesion = each("friction", 0.0), each("cohesion", 0.0)
        residual_friction = np.where(
            np.isnan(each("residual_friction", np.nan)), friction, each("residual_friction", 0.0)
        )
        residual_cohesion = each("residual_cohesion", 0.0)
        f_t = np.minimum(each("tensile_strength", 0.0), _apex(cohesion, friction))
        residual = np.minimum(each("residual_tensile_strength", 0.0), _apex(residual_cohesion, residual_friction))
        energy, strongest = each("fracture_energy", 0.0), each("compressive_strength", np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            opening = np.where((energy > 0) & (f_t > 0), 2.0 * energy / f_t, 0.0)
        softens = opening > f_t / k_n
        exponential = np.array([table[k].get("softening") == "exponential" for k in range(len(table))])[kind] & softens
        opening = np.where(exponential, _exponential_end(energy, f_t, f_t / k_n), opening)
        return Law(
            k_n,
            k_s,
            f_t,
            cohesion,
            friction,
            residual,
            residual_cohesion,
            residual_friction,
            np.where(np.isfinite(strongest), 0.0, each("dilation", 0.0)),
            np.where(softens, opening, 0.0),
            exponential,
            np.where(softens, energy + each("shear_fracture_energy", 0.0), 0.0),
            strongest,
            each("cap_shear", 9.0),
            self._gaps(),
        )

    def _head(self, joint: dict[str, Any]) -> dict[str, Any]:
        """Return the law of head joints: that of the beds times factors, but for the keys given."""
        own = dict(self.scene.get("head_joint", {}))
        factors = own.pop("factor", {})
        return joint | {k: f * joint[k] for k, f in factors.items() if joint.get(k) is not None} | own

    def _soil(self) -> dict[str, float]:
        soil = self.scene["soil"]
        swells = self.scene["movement"]["kind"] == "dishing"
        k_n = soil["swelling_stiffness" if swells else "shrinking_stiffness"]
        return {
            "normal_stiffness": k_n,
            "shear_stiffness": soil.get("shear_stiffness", k_n),
            "friction": soil["friction"],
        }

    def _support(self, bare: dict[str, float], held: dict[str, float]) -> dict[str, float]:
        """Return the law of supports with the stiffness of the rig for a bearing of 0.1 mm."""
        rig, movement = self.scene["rig"], self.scene["movement"]
        # a path that ends where a support carries no load has bilateral supports until then
        ends = rig["stop_at_zero"] and (rig["control"] == "load" or movement["kind"] == "doming")
        holds = rig["support"] == "held" or ends
        stiffness = rig["support_stiffness"] / (1e-4 * self.scene["footing"]["width"])
        law = {"normal_stiffness": stiffness, "shear_stiffness": 1e-6 * stiffness}
        return (held if holds else bare | {"friction": 1.0}) | law

    def _lumped(self, k_n: FloatArray, k_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the stiffness of joints in series with that of the rigid bricks on both sides."""
        if not self.scene["solver"]["lump_block_elasticity"]:
            return k_n, k_s
        block, middle = self.scene["block"], self.middle[self.interface]
        modulus, shear = block["elastic_modulus"], block["elastic_modulus"] / (2.0 * (1.0 + block["poisson_ratio"]))
        soft_n, soft_s = 1.0 / k_n, 1.0 / k_s
        for side in self.sides:
            number = np.minimum(side, self.n - 1)
            brick = (side < self.n) & ~self.in_footing[number] & ~self.deformable[number]
            depth = np.abs((self.normal * (middle - self.centroid[number])).sum(axis=1))
            # an elastic brick stretches along its bed by itself, and contracts across
            bends = self.elastic[number]
            brick &= ~(bends & (np.abs(self.normal[:, 0]) > 0.5))
            contracts = np.where(bends, 1.0 - block["poisson_ratio"] ** 2, 1.0)
            soft_n = soft_n + np.where(brick, contracts * depth / modulus, 0.0)
            soft_s = soft_s + np.where(brick, depth / shear, 0.0)
        return 1.0 / soft_n, 1.0 / soft_s

    def _gaps(self) -> FloatArray:
        """Return the width of the control joint that each contact belongs to, 0 where it belongs to none (m)."""
        joints = self.scene.get("control_joint", [])
        gap = np.zeros(len(self.place))
        if joints:
            # courses end at a control joint within half a brick of its given position
            nearest = np.abs(self.place[:, :1] - np.array([j["x"] for j in joints])).argmin(axis=1)
            gap = np.where(self["contact_kind"] == CONTROL, np.array([j["width"] for j in joints])[nearest], 0.0)
        return gap

    def load(self, step: int) -> FloatArray:
        """Return the loads on each block in an increment, jacks included: array (n, 3), N and N m."""
        force = np.zeros((self.n, 3))
        force[:, 1] = -(self.weight + self.roof)
        support = np.column_stack([self[f"block_support_force_{axis}"][step] for axis in "xy"])
        force[:, :2] += np.nan_to_num(support)
        force[:, 2] += np.nan_to_num(self["block_support_moment"][step])
        if "jack_load" in self.ds:
            force += self.jack_force(float(self["jack_load"][step]))
        return force

    def jack_force(self, load: float) -> FloatArray:
        """Return the force on each block of jacks that push upwards with a load (N) each: array (n, 3)."""
        force = np.zeros((self.n, 3))
        for x in self["jack_x"]:
            under = [i for i in np.flatnonzero(self.in_footing) if self._spans(i, x)]
            for block in under:
                share = load / len(under)
                force[block] += np.array([0.0, share, share * (x - self.centroid[block, 0])])
        return force

    def _spans(self, block: int, x: float) -> bool:
        near = 1e-6 * float(self.scene["wall"]["length"])
        polygon = self.polygons[block]
        return bool(polygon[:, 0].min() - near <= x <= polygon[:, 0].max() + near)

    def joint_forces(self, step: int) -> tuple[FloatArray, FloatArray]:
        """Return force and moment of the contacts on blocks and ground (n + 1, 3), and the sum of their sizes."""
        sigma, tau = self["contact_normal_stress"][step], self["contact_shear_stress"][step]
        pull = self.contact_area[:, None] * (sigma[:, None] * self.normal + tau[:, None] * self.tangent)
        centre = np.vstack((self.centroid, np.zeros(2)))
        total, size = np.zeros((self.n + 1, 3)), np.zeros((self.n + 1, 3))
        for side, sign in zip(self.sides, (1.0, -1.0), strict=True):
            arm = self.place - centre[side]
            parts = np.column_stack((pull, arm[:, 0] * pull[:, 1] - arm[:, 1] * pull[:, 0]))
            np.add.at(total, side, sign * parts)
            np.add.at(size, side, np.abs(parts))
        return total, size

    def motion(self, step: int) -> tuple[FloatArray, FloatArray]:
        """Return relative displacement normal to and along each contact (m), from the motion of its rigid blocks.

        The ground's own displacement is added; NaN beside deformable blocks.
        """
        shift = np.zeros((self.n + 1, 3))
        for k, name in enumerate(("displacement_x", "displacement_y", "rotation")):
            shift[: self.n, k] = self[f"block_{name}"][step]
        shift[: self.n][self.deformable] = np.nan
        centre = np.vstack((self.centroid, np.zeros(2)))
        ground = self.ground(step)
        relative = np.zeros_like(self.place)
        for side, sign in zip(self.sides, (-1.0, 1.0), strict=True):
            arm, turn = self.place - centre[side], shift[side, 2]
            moved = shift[side, :2] + turn[:, None] * np.column_stack((-arm[:, 1], arm[:, 0]))
            relative += sign * np.where((side == self.n)[:, None], ground, moved)
        if self.elastic.any():
            strains = self.strains(step)
            for side, sign, rows in zip(self.sides, (-1.0, 1.0), self.strain_rows, strict=True):
                relative += sign * np.einsum("cd,cdk->ck", strains[side], rows)
        return (relative * self.normal).sum(axis=1), (relative * self.tangent).sum(axis=1)

    def ground(self, step: int) -> FloatArray:
        """Return the displacement of the ground under each contact in an increment (m), array (c, 2)."""
        from audited.grounds import movement_of

        progress = float(self["progress"][step])
        if self.shape == "jacks" or (self.scene["solver"].get("footing") == "deformable" and self.shape != "mound"):
            return np.zeros_like(self.place)
        return movement_of(self.scene, self.place[:, 0], progress)


def _cross(p: FloatArray, q: FloatArray) -> FloatArray:
    return p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]


def _exponential_end(energy: FloatArray, f_t: FloatArray, first: FloatArray) -> FloatArray:
    """Return w_c (m) of exponential softening from the opening at cracking: the area below its curve is G_f."""
    xi = (np.arange(20000) + 0.5) / 20000
    mean = float((np.exp(-EXPONENT * xi) - xi * np.exp(-EXPONENT)).mean())
    with np.errstate(divide="ignore", invalid="ignore"):
        return first + (energy / f_t - 0.5 * first) / mean


def _apex(cohesion: FloatArray, friction: FloatArray) -> FloatArray:
    """Return the tension at which Coulomb's cone ends (Pa)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(friction > 0, cohesion / friction, np.inf)
