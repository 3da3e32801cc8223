"""Random scenes of all joint laws, movements and footings; scene i of a seed depends on (seed, i) alone.

Sizes, bond, openings and the materials of wide range are those of ``audited.wide_scenes``. Here the materials of most
scenes are drawn again from the range of masonry, and laws, grounds and settings are added.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from audited.wide_scenes import tables as wide_tables
from damagepred.assembly import wall_model
from damagepred.errors import InputError
from damagepred.scene import Scene

LARGEST = (8, 16, 30, 60, 120)
"""Numbers of bricks that bound a scene, about; each is drawn as often as ``SHARES`` says."""
SHARES = (0.2, 0.3, 0.25, 0.2, 0.05)
ATTEMPTS = 100
"""Largest number of draws until the package accepts a scene."""


class Drawn(NamedTuple):
    """An accepted scene.

    Attributes
    ----------
    scene : Scene
        The scene.
    refused : int
        Draws before it that were refused.
    features : tuple of str
        Laws, movements and grounds of the scene.
    """

    scene: Scene
    refused: int
    features: tuple[str, ...]


class Draw:
    """Random values of one generator.

    Parameters
    ----------
    rng : numpy.random.Generator
        The generator.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng

    def log(self, low: float, high: float) -> float:
        """Return a value whose logarithm is uniform."""
        return float(10.0 ** self.rng.uniform(np.log10(low), np.log10(high)))

    def uniform(self, low: float, high: float) -> float:
        """Return a uniform value."""
        return float(self.rng.uniform(low, high))

    def chance(self, share: float) -> bool:
        """Return True in a share of the draws."""
        return bool(self.rng.random() < share)

    def one(self, *values: Any) -> Any:
        """Return one of some values."""
        return values[int(self.rng.integers(len(values)))]


def scene_of(seed: int, number: int) -> Drawn:
    """Return scene ``number`` of a seed.

    Parameters
    ----------
    seed, number : int
        Non-negative.

    Raises
    ------
    RuntimeError
        If no draw makes a wall.
    """
    for attempt in range(ATTEMPTS):
        drawn = tables(np.random.default_rng([seed, number, attempt]))
        try:
            scene = Scene.from_dict(drawn)
            wall_model(scene)
        except InputError:
            continue
        return Drawn(scene, attempt, features(scene))
    raise RuntimeError(f"seed {seed}, scene {number}: no accepted scene in {ATTEMPTS} draws")


def tables(rng: np.random.Generator) -> dict[str, Any]:
    """Return the tables of a scene, which may be refused."""
    draw = Draw(rng)
    found = wide_tables(0, int(rng.choice(LARGEST, p=SHARES)), rng)
    found.pop("title")
    if draw.chance(0.8):
        _masonry(found, draw)
    found["movement"]["increments"] = int(rng.integers(5, 21))
    _law(found["joint"], draw)
    _parts(found, draw)
    _movement(found, draw)
    _settings(found, draw)
    _later_features(found, draw)
    return found


def _masonry(found: dict[str, Any], draw: Draw) -> None:
    """Replace sizes and materials of the wide range by those of masonry."""
    wall = found["wall"]
    units, courses = (round(wall[size] / wall[f"block_{size}"]) for size in ("length", "height"))
    length, height = round(draw.uniform(0.15, 0.5), 2), round(draw.uniform(0.06, 0.25), 2)
    factors = {"x": length / wall["block_length"], "y": height / wall["block_height"]}
    for hole in found.get("opening", []):
        for key, axis in (("x", "x"), ("width", "x"), ("y", "y"), ("height", "y")):
            hole[key] = round(hole[key] * factors[axis], 3)
    wall |= {
        "length": units * length,
        "height": courses * height,
        "block_length": length,
        "block_height": height,
        "thickness": draw.uniform(0.09, 0.25),
    }
    found["block"] = {"elastic_modulus": draw.log(1e9, 3e10), "density": draw.uniform(1000, 2400)}
    joint, k_n = found["joint"], draw.log(5e9, 5e11)
    joint |= {
        "normal_stiffness": k_n,
        "shear_stiffness": k_n * draw.uniform(0.2, 0.6),
        "friction": draw.uniform(0.3, 1.1),
    }
    strength = draw.one("none", "weak", "usual", "usual", "usual", "strong")
    f_t = {"none": 0.0, "weak": draw.log(10, 1e4), "usual": draw.log(2e4, 5e5), "strong": 1e6}[strength]
    joint |= {"tensile_strength": f_t, "cohesion": f_t * draw.log(0.5, 3.0)}
    for law in ("dilation", "residual_cohesion", "residual_friction"):
        joint.pop(law, None)
    found["movement"]["central_deflection"] = draw.log(2e-4, min(0.02, wall["length"] / 60))
    found["loads"]["roof"] = draw.one(0.0, draw.log(500, 2e4)) * wall["length"]


def _law(joint: dict[str, Any], draw: Draw) -> None:
    """Combine laws of the joint; incompatible ones are refused and drawn again."""
    friction, strength, cohesion = joint["friction"], joint["tensile_strength"], joint["cohesion"]
    softens = draw.chance(0.35)
    if softens:
        joint["fracture_energy"] = draw.log(1.0, 200.0)
    else:
        joint.pop("fracture_energy", None)
    if softens and draw.chance(0.4):
        joint["shear_fracture_energy"] = draw.log(1.0, 1000.0)
        joint.pop("brittle_shear", None)
        joint.pop("dilation", None)
    elif draw.chance(0.25):
        joint["brittle_shear"] = True
    if draw.chance(0.15):
        joint["cohesion"] = cohesion = draw.one(0.0, draw.log(100, 1e6))
    if draw.chance(0.15) and "shear_fracture_energy" not in joint:
        joint["dilation"] = friction * draw.uniform(0.0, 0.6)
    elif draw.chance(0.2):
        joint["compressive_strength"] = draw.log(3e5, 2e7)
        joint.pop("dilation", None)
        if draw.chance(0.5):
            joint["cap_shear"] = draw.uniform(2.0, 20.0)
    if draw.chance(0.25):
        joint["residual_cohesion"] = cohesion * draw.one(0.0, draw.uniform(0.0, 1.0), 1.0)
        joint["residual_friction"] = friction * draw.uniform(0.4, 1.0)
    if not softens and draw.chance(0.15):
        joint["residual_tensile_strength"] = strength * draw.uniform(0.0, 0.5)


def _parts(found: dict[str, Any], draw: Draw) -> None:
    """Add openings, dpc, control joints and loads."""
    wall = found["wall"]
    courses, length = round(wall["height"] / wall["block_height"]), wall["length"]
    if "dpc" in found:
        found["dpc"] |= {
            "course": int(draw.rng.integers(1, max(2, min(4, courses)))),
            "cohesion": draw.one(0.0, 0.0, draw.log(100, 1e5)),
        }
        if draw.chance(0.3):
            found["dpc"]["normal_stiffness"] = draw.log(5e8, 5e11)
            found["dpc"]["shear_stiffness"] = found["dpc"]["normal_stiffness"] * draw.uniform(0.1, 0.6)
    for hole in found.get("opening", []):
        if draw.chance(0.3):  # a door
            hole["kind"], hole["height"] = "door", round(hole.pop("y") + hole["height"], 3)
        hole["lintel_bearing"] = draw.uniform(0.05, 0.3)
    if draw.chance(0.15):
        places = sorted(draw.uniform(0.2, 0.8) * length for _ in range(draw.one(1, 1, 2)))
        found["control_joint"] = [
            {"x": x, "width": draw.one(0.0, draw.log(1e-5, 1e-2)), "through_dpc": draw.chance(0.5)} for x in places
        ]


def _movement(found: dict[str, Any], draw: Draw) -> None:
    """Choose the movement: a prescribed shape of the wall's underside, a footing on jacks, or soil."""
    movement, length = found["movement"], found["wall"]["length"]
    shape = draw.one("three_loads", "parabola", "arc", "table", "jacks", "jacks", "mound", "mound")
    movement["shape"] = shape
    if shape == "table":
        inner = np.sort(draw.rng.choice(np.arange(1, 100), size=4, replace=False)) / 100
        movement["table"] = [[0.0, 0.0], *([float(p), draw.uniform(-0.3, 1.5)] for p in inner), [1.0, 0.0]]
    if shape in ("jacks", "mound"):
        found["footing"] = _footing(found, draw)
    if shape == "jacks":
        found["rig"] = _rig(length, draw)
        if found["rig"].get("control") == "load":
            movement["central_deflection"] = 0.0
        else:
            movement["central_deflection"] = draw.log(1e-4, min(0.01, length / 100))
    elif shape == "mound":
        found["mound"] = _mound(length, draw)
        found["soil"] = {
            "swelling_stiffness": draw.log(3e5, 1e8),
            "shrinking_stiffness": draw.log(3e5, 1e8),
            "friction": draw.uniform(0.0, 1.0),
        }
        if draw.chance(0.3):
            found["soil"]["shear_stiffness"] = draw.log(1e5, 1e8)
    elif draw.chance(0.05):
        found["solver"] = {"footing": "deformable"}


def _footing(found: dict[str, Any], draw: Draw) -> dict[str, Any]:
    footing: dict[str, Any] = {
        "width": draw.uniform(0.2, 0.6),
        "depth": draw.uniform(0.15, 0.6),
        "elastic_modulus": draw.log(1e9, 3e10),
        "density": draw.uniform(1900, 2500),
    }
    if draw.chance(0.2):
        footing["segment_length"] = found["wall"]["block_length"] * draw.uniform(0.4, 1.5)
    if draw.chance(0.2):
        footing["joint"] = dict(found["joint"]) | {"friction": draw.uniform(0.3, 1.0)}
    if draw.chance(0.25):
        footing["concrete"] = {
            "grade": draw.one("N20", "N25", "N32"),
            "bottom": draw.one("3-L8TM", "3-L11TM", "4-L12TM"),
            "top": draw.one("none", "3-L8TM", "3-L11TM"),
            "law": draw.one("cracked", "branson"),
            "earlier_moment": draw.one(0.0, draw.log(1e2, 3e4)),
        }
    return footing


def _rig(length: float, draw: Draw) -> dict[str, Any]:
    rig: dict[str, Any] = {"support": draw.one("held", "lift_off"), "stop_at_zero": draw.chance(0.4)}
    if draw.chance(0.3):
        first, *jacks, last = (round(float(p) * length, 4) for p in np.sort(draw.rng.choice(21, 5, replace=False)) / 20)
        rig |= {"supports": [first, last], "jacks": jacks}
    if draw.chance(0.3):
        rig |= {"control": "load", "jack_load": draw.log(100, 1e5)}
    return rig


def _mound(length: float, draw: Draw) -> dict[str, Any]:
    shape = draw.one("walsh", "mitchell", "tree", "pipe", "tunnel", "table")
    mound: dict[str, Any] = {"shape": shape, "surface_movement": draw.log(1e-3, min(0.08, 0.08 * length))}
    if shape in ("walsh", "mitchell"):
        mound["suction_depth"] = draw.uniform(1.0, 5.0)
    if shape == "walsh" and draw.chance(0.3):
        mound["edge_distance"] = draw.uniform(0.05, 0.6) * length
    if shape == "mitchell" and draw.chance(0.3):
        mound["exponent"] = draw.uniform(1.0, 6.0)
    if shape in ("tree", "pipe", "tunnel") and draw.chance(0.6):
        mound["position"] = draw.uniform(-0.5, 1.5) * length
    if shape in ("tree", "pipe", "tunnel") and (shape == "tunnel" or draw.chance(0.5)):
        mound["reach"] = draw.uniform(0.3, 2.0) * length
    if shape == "tunnel" and draw.chance(0.5):
        mound["tunnel_depth"] = draw.uniform(2.0, 15.0)
    if shape == "table":
        inner = np.sort(draw.rng.choice(np.arange(1, 100), size=3, replace=False)) / 100
        places = [0.0, *(float(p) for p in inner), 1.0]
        mound["table"] = [[p, draw.uniform(-0.2, 1.0)] for p in places]
    return mound


def _settings(found: dict[str, Any], draw: Draw) -> None:
    """Draw settings of the solver and of the damage."""
    solver = found.setdefault("solver", {})
    solver["blocks"] = str(draw.rng.choice(["rigid", "deformable", "elastic"], p=[0.94, 0.03, 0.03]))
    if draw.chance(0.2):
        solver["contacts_per_interface"] = draw.one(2, 4, 5, 9)
    if draw.chance(0.1):
        solver["quadrature"] = "midpoint"
    if draw.chance(0.1):
        solver["lump_block_elasticity"] = False
    if draw.chance(0.2):
        solver["condense"] = False
    if draw.chance(0.3):
        solver["symmetric_half"] = False
    table = draw.one("as2870", "as2870", "bre251")
    found["damage"] = {
        "table": table,
        "plasterboard": table == "as2870" and draw.chance(0.2),
        "count_rule": draw.chance(0.8),
        "group_distance": draw.uniform(0.3, 2.0),
        "group_count": draw.one(2, 2, 3),
        "dpc_threshold": draw.log(1e-4, 2e-3),
        "measure": draw.one("joint", "joint", "band"),
        "band_gauge": draw.uniform(0.2, 1.5),
        "band_threshold": draw.one(0.0, 0.0, draw.log(1e-5, 1e-3)),
        "footing_threshold": draw.log(1e-4, 2e-3),
        "count_footing_gap": draw.chance(0.5),
    }
    if found["movement"]["shape"] not in ("jacks", "mound") and draw.chance(0.2):
        found["footing"] = {"joint": dict(found["joint"]) | {"friction": draw.uniform(0.3, 1.0)}}


def _later_features(found: dict[str, Any], draw: Draw) -> None:
    """Draw exponential softening, head joints of their own, and elastic blocks; all other draws stay as they were."""
    if found["joint"].get("fracture_energy") and draw.chance(0.4):
        found["joint"]["softening"] = "exponential"
    if draw.chance(0.25):
        found["head_joint"] = {
            "factor": {"tensile_strength": draw.uniform(0.2, 1.0), "friction": draw.uniform(0.5, 1.0)}
        }
        if found["joint"].get("fracture_energy"):
            found["head_joint"]["factor"]["fracture_energy"] = draw.uniform(0.3, 1.5)
    if found["solver"]["blocks"] == "rigid" and draw.chance(0.25):
        found["solver"]["blocks"] = "elastic"


def features(scene: Scene) -> tuple[str, ...]:
    """Return the laws, movements and grounds of a scene."""
    joint, movement = scene.joint, scene.movement
    bare = joint.tensile_strength == 0.0
    names = {
        "no strength": bare and joint.cohesion == 0.0,
        "cohesion without tension": bare and joint.cohesion > 0.0,
        "brittle": not bare and joint.fracture_energy is None,
        "softening": joint.fracture_energy is not None,
        "exponential softening": joint.softening == "exponential",
        "head joints of their own": scene.head_joint is not None,
        "softening by slip": joint.shear_fracture_energy is not None,
        "brittle shear": joint.brittle_shear,
        "dilation": joint.dilation > 0.0,
        "cap": joint.compressive_strength is not None,
        "residual values": joint.residual_cohesion > 0.0 or joint.residual_tensile_strength > 0.0,
        "residual friction": joint.residual_friction is not None,
        "dpc": scene.dpc is not None,
        "opening": bool(scene.opening),
        "control joint": bool(scene.control_joint),
        "stack bond": scene.wall.bond == "stack",
        "roof": scene.loads.roof > 0.0,
        "prescribed shape": movement.prescribed,
        f"jacks by {scene.rig.control}": movement.shape == "jacks",
        f"mound, {scene.mound.shape}": movement.shape == "mound",
        "footing of reinforced concrete": not movement.prescribed and scene.footing.concrete is not None,
        "joint of the footing": scene.footing.joint is not None,
        "category by band": scene.damage.measure == "band",
        f"{scene.solver.blocks} blocks": True,
    }
    return tuple(name for name, there in names.items() if there)
