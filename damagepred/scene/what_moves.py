"""Sentence on the movement of a scene, from the profile of its ground."""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.enumerations import LOCAL
from damagepred.scene.house import POINTS_ALONG, House
from damagepred.scene.scene import Scene

PROFILE_POINTS = 4001  # points along the wall at which the profile is evaluated
ZERO_MOVEMENT = 1e-8  # ratio to the largest movement below which the ground does not move
EQUAL_MOVEMENT = 1e-3  # difference of two movements, as a ratio to the largest, below which they are equal
STILL = "The ground does not move"


def load_factors(scene: Scene) -> list[float]:
    """Load factors of the largest movement to each side."""
    if scene.dynamics is not None and scene.dynamics.movement_time is None:
        return []
    history = scene.movement.increments_of_history()
    factors = np.array([1.0]) if history is None else history.load_factors
    return sorted({float(factors.max()), float(factors.min())} - {0.0}, key=lambda factor: -abs(factor))


def turning_points(rise: FloatArray) -> list[int]:
    """Points of the largest and of the least or opposite movement, and both ends if they move alike."""
    top = int(np.abs(rise).argmax())
    other, least = int((-rise * np.sign(rise[top])).argmax()), EQUAL_MOVEMENT * abs(float(rise[top]))
    ends = [0, len(rise) - 1] if (np.abs(rise[[0, -1]] - rise[top]) <= least).all() else []
    return sorted({i for i in (top, other, *ends) if abs(rise[i]) > least})


def what_moves(scene: Scene) -> str:
    """Place, direction and size of each movement of a scene, in a sentence."""
    if isinstance(scene, House):
        return _moves_in_plan(scene)
    movement, mound, rig, length = scene.movement, scene.mound, scene.rig, scene.wall.length
    timed, sides = scene.dynamics, load_factors(scene)
    if movement.shape == "jacks":
        jacks, supports = (", ".join(f"{x:.4g}" for x in at(length)) for at in (rig.jack_places, rig.support_places))
        way = "down" if movement.sign < 0 else "up"
        by = movement.central_deflection
        size = f"by {_mm(by)}" if rig.jack_load is None else f"under {rig.jack_load / 1e3:.4g} kN per jack"
        said = [f"The middle of the footing goes {way} {size}; jacks at {jacks} m, supports at {supports} m"]
    elif movement.shape == "loads" and scene.loading is not None:
        control, target = scene.loading.control, scene.loading.target
        size = f"{target / 1e3:.4g} kN in all" if control == "force" else f"{_mm(target)} of {control}"
        ways = (f"{load.direction} the {load.side}" for load in scene.load if not load.sized)
        where = " and ".join(dict.fromkeys(ways))
        said = [f"{STILL}; loads {where} grow to {size}"]
    else:
        grounds = sorted((_ground(scene, factor) for factor in sides), key=lambda ground: -ground[0])
        words = [text for _, text in grounds] or [STILL]
        said = ["; in its history also: ".join([words[0], *(text[0].lower() + text[1:] for text in words[1:])])]
    if movement.moves_along and said != [STILL]:
        shift = movement.horizontal_profile(np.linspace(0.0, length, PROFILE_POINTS), length)
        said.append(f"it also moves along the wall, by up to {_mm(float(np.abs(shift).max()))}")
    if movement.shape == "mound" and said != [STILL]:
        swelling = scene.soil.stiffness_key(movement.kind) == "swelling_stiffness"
        clay = mound.shape not in LOCAL or (mound.shape == "tree" and movement.local)
        soil = f"{'swelling' if swelling else 'drying'} clay" if clay else "soil"
        said.append(f"{soil}, {scene.soil.stiffness(movement.kind) / 1e3:.4g} kPa/m")
    if movement.stage:
        years = movement.stage[-1].time
        said.append(f"history of {len(movement.stage)} stages" + (f" to year {years:g}" if years else ""))
    for motion in timed.base if timed else ():
        start, end, _ = motion.shaking() or (0.0, 0.0, 0.0)
        way, form = {"x": "along the wall", "y": "up and down"}[motion.direction], motion.kind.replace("_", " ")
        said.append(f"the base shakes {way} from {start:.4g} to {end:.4g} s ({form})")
    return "; ".join(said)


def _moves_in_plan(house: House) -> str:
    """Lowest and highest ground under the walls at full movement."""
    share = np.linspace(0.0, 1.0, POINTS_ALONG)
    moved = {w.name: 1e3 * house.surface(w.points(share * w.length)) for w in house.wall}
    low, high = min(moved, key=lambda name: moved[name].min()), max(moved, key=lambda name: moved[name].max())
    down, up = (round(value, 2) + 0.0 for value in (moved[low].min(), moved[high].max()))  # no -0
    shapes = " and ".join(mound.shape for mound in (house.mound, *house.source))
    return (
        f"The ground ({shapes}) ends lowest under '{low}', at {down:.3g} mm, and highest under '{high}', "
        f"at {up:.3g} mm (up is positive)"
    )


def _ground(scene: Scene, factor: float) -> tuple[float, str]:
    """Largest movement of the ground at a load factor (m), and its place, direction and reach in words."""
    length = scene.wall.length
    x = np.linspace(0.0, length, PROFILE_POINTS)
    rise = scene.ground_rise(x, factor)
    top = int(np.abs(rise).argmax())
    largest = abs(float(rise[top]))
    if largest < 1e-9:
        return 0.0, STILL
    moved = f"{'up' if rise[top] > 0 else 'down'} by {_mm(largest)}"
    if np.ptp(rise) <= EQUAL_MOVEMENT * largest:
        return largest, f"The whole ground goes {moved}"
    jumps = np.flatnonzero(np.abs(np.diff(rise)) > 0.5 * np.ptp(rise)) if scene.movement.shape == "step" else x[:0]
    if len(jumps):
        side = "left" if abs(rise[0]) > abs(rise[-1]) else "right"
        where = f"{side} of {_metres(x[int(jumps[0])])} m"
        return largest, f"The ground {where} goes {moved} in one step, the other part stays"
    still = np.flatnonzero(rise * np.sign(rise[top]) <= ZERO_MOVEMENT * largest)
    before, after = still[still < top][-1:], still[still > top][:1]
    ends = [
        f"nothing {_reach(x[zero[0]], x[top], length)}" if len(zero) else f"{_mm(rise[end])} {_place(x[end], length)}"
        for zero, end, beyond in ((before, 0, top > 0), (after, -1, top < PROFILE_POINTS - 1))
        if beyond
    ]
    if len(ends) == 2 and [end.partition(" at the ")[2] for end in ends] == ["left end", "right end"]:
        sizes = {end.partition(" at ")[0] for end in ends}
        ends = [f"{sizes.pop()} at both ends"] if len(sizes) == 1 else ends
    _, named, part = (place := _place(x[top], length)).partition("the ")
    subject = f"The {part} of the ground" if named else f"The ground {place}"
    words = f"{subject} goes {moved}, to {' and '.join(ends)}"
    if (np.abs(rise[[0, -1]] - rise[top]) <= EQUAL_MOVEMENT * largest).all() and len(still):
        inner = x[still[0]], x[still[-1]]
        near = inner[1] - inner[0] < 0.04 * length
        reach = "in the middle" if near else f"at {_metres(inner[0])} and {_metres(inner[1])} m"
        words = f"Both ends of the ground go {moved}, to nothing {reach}"
    other = int((rise * -np.sign(rise[top])).argmax())
    if rise[other] * rise[top] < 0 and abs(rise[other]) > EQUAL_MOVEMENT * largest:
        way = "up" if rise[other] > 0 else "down"
        words += f"; it goes {way} by {_mm(rise[other])} {_place(x[other], length)}"
    return largest, words


def _place(x: float, length: float) -> str:
    """Position along the wall in words."""
    for name, place in (("at the left end", 0.0), ("at the right end", length), ("in the middle", length / 2.0)):
        if abs(x - place) <= 2.0 * length / (PROFILE_POINTS - 1):
            return name
    return f"at {_metres(x)} m"


def _reach(x: float, top: float, length: float) -> str:
    """Place where the movement ends in words: its distance from the end of the wall that moves most."""
    place = _place(x, length)
    of_an_end = place.endswith(" m") and _place(top, length).endswith(" end")
    return f"{_metres(abs(x - top))} m from that end" if of_an_end else place


def _metres(x: float) -> str:
    """Position to three digits and the centimetre."""
    return f"{round(float(f'{x:.3g}'), 2):g}"


def _mm(size: float) -> str:
    return f"{abs(1e3 * size):.3g} mm"
