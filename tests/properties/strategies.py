"""Random scenes that a user could write."""

from typing import Any

from hypothesis import strategies as st

GRID = 0.02


def number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False, allow_infinity=False)


def strength(high: float) -> st.SearchStrategy[float]:
    """Any strength that a joint or a brick can have (Pa)."""
    return st.just(0.0) | number(10.0, high)


TITLES = st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=30)


@st.composite
def openings(draw: st.DrawFn, length: float, height: float, most: int = 3) -> list[dict[str, Any]]:
    """Openings side by side that do not touch, on a grid of 2 cm: windows, windows to the top, doors."""
    count = draw(st.integers(0, most))
    end, top = round(length / GRID), round(height / GRID)
    edges = draw(st.lists(st.integers(0, end), min_size=2 * count, max_size=2 * count, unique=True).map(sorted))
    holes = []
    for left, right in zip(edges[::2], edges[1::2]):
        kind = draw(st.sampled_from(["window", "window to the top", "door", "door to the top"]))
        levels = sorted(draw(st.lists(st.integers(1, top - 1), min_size=2, max_size=2, unique=True)))
        sill = 0 if kind.startswith("door") else levels[0]
        head = top if kind.endswith("top") else levels[1]
        hole = {
            "kind": kind.split()[0],
            "x": left * GRID,
            "width": (right - left) * GRID,
            "height": (head - sill) * GRID,
            "lintel_bearing": draw(st.sampled_from([0.06, 0.12, 0.15, 0.24, 0.3])),
        }
        if sill:
            hole["y"] = sill * GRID
        holes.append(hole)
    if count == 1 and edges == [0, end]:
        return []
    return holes


def _ground(draw: st.DrawFn, length: float) -> dict[str, Any]:
    """Rig, soil, mound and footing, whether or not the movement reads them."""
    places = st.lists(st.integers(1, 99), min_size=4, max_size=4, unique=True)
    first, *jacks, last = (share * 0.01 * length for share in draw(places.map(sorted)))
    control = draw(st.sampled_from([{"control": "deflection"}, {"control": "load", "jack_load": draw(number(0, 1e6))}]))
    return {
        "rig": {"supports": [last, first], "jacks": jacks, "support": draw(st.sampled_from(["held", "lift_off"]))}
        | control,
        "soil": {"swelling_stiffness": draw(number(1e5, 1e9)), "friction": draw(number(0, 2))},
        "mound": {
            "shape": draw(st.sampled_from(["walsh", "mitchell", "tree", "pipe"])),
            "surface_movement": draw(number(0, 0.1)),
            "position": draw(number(-50, 50)),
            "exponent": draw(number(1, 9)),
        },
        "footing": {
            "depth": draw(number(0.2, 2.0)),
            "segment_length": draw(number(0.01, 1.0)),
            "joint": {"cohesion": draw(strength(1e6)), "brittle_shear": draw(st.booleans())},
            "concrete": {
                "grade": draw(st.sampled_from(["N20", "N25", "N32"])),
                "bottom": draw(st.sampled_from(["3-L8TM", "4-L12TM"])),
                "top": draw(st.sampled_from(["none", "3-L11TM"])),
                "cover": draw(number(0, 0.05)),
            },
        },
    }


@st.composite
def scenes(draw: st.DrawFn) -> dict[str, Any]:
    length, height = draw(number(1.0, 20.0)), draw(number(0.5, 6.0))
    wall = (
        {"length": length, "height": height, "thickness": draw(number(0.05, 0.5))}
        | {"block_length": draw(number(0.05, 0.6)), "block_height": draw(number(0.03, 0.3))}
        | {"bond": draw(st.sampled_from(["running", "stack"]))}
    )
    block_friction = draw(number(0, 2))
    friction, cohesion, tension = draw(number(0, 2)), draw(strength(1e6)), draw(strength(1e6))
    tables: dict[str, Any] = {
        "title": draw(TITLES),
        "wall": wall,
        "block": (
            {"elastic_modulus": draw(number(1e6, 1e11)), "density": draw(st.just(0.0) | number(50, 1e4))}
            | {"cohesion": draw(st.none() | strength(1e8)), "friction": block_friction}
            | {"dilation": draw(number(0, block_friction)), "tensile_strength": draw(st.none() | strength(1e8))}
        ),
        "joint": (
            {"normal_stiffness": draw(number(1e6, 1e13)), "friction": friction, "cohesion": cohesion}
            | {"tensile_strength": tension, "dilation": draw(number(0, friction))}
            | {"residual_cohesion": draw(st.just(0.0) | number(min(10.0, cohesion), cohesion))}
            | {"residual_friction": draw(st.none() | number(0, 2)), "brittle_shear": draw(st.booleans())}
            | {"fracture_energy": draw(st.none() | number(1e-3, 1e4))}
        ),
        "movement": {
            "kind": draw(st.sampled_from(["dishing", "doming"])),
            "central_deflection": draw(number(0, 0.1)),
            "increments": draw(st.integers(1, 10**6)),
            "shape": draw(st.sampled_from(["three_loads", "parabola", "arc", "jacks", "mound"])),
        },
        "loads": {"roof": draw(number(0, 1e6))},
        "damage": {"table": draw(st.sampled_from(["as2870", "bre251"])), "count_rule": draw(st.booleans())},
    }
    if draw(st.booleans()):
        middle = draw(st.lists(number(0.01, 0.99), min_size=1, max_size=5, unique=True).map(sorted))
        table = [[0.0, 0.0], *([p, draw(number(0.25, 2.0))] for p in middle), [1.0, 0.0]]
        tables["movement"] |= {"shape": "table", "table": table}
    if draw(st.booleans()):
        tables["opening"] = draw(openings(1.0, 0.5))
    dpc_level = wall["block_height"]
    in_a_window = any(
        o["y"] < dpc_level < o["y"] + o["height"] for o in tables.get("opening", []) if o.get("kind") != "door"
    )
    if draw(st.booleans()) and not in_a_window:
        tables["dpc"] = {
            "course": 1,
            "friction": draw(number(0, 2)),
            "normal_stiffness": draw(st.none() | number(1e4, 1e12)),
        }
    if draw(st.booleans()):
        width, through = draw(number(0, 0.05)), draw(st.booleans())
        tables["control_joint"] = [{"x": draw(number(0.35, 0.65)) * length, "width": width, "through_dpc": through}]
    if draw(st.booleans()):
        tables |= _ground(draw, length)
    if draw(st.booleans()):
        tables["solver"] = {
            "tolerance": draw(number(1e-9, 1.0)),
            "contacts_per_interface": draw(st.integers(2, 9)),
            "symmetric_half": draw(st.booleans()),
        }
    return {
        name: {k: v for k, v in table.items() if v is not None} if isinstance(table, dict) else table
        for name, table in tables.items()
    }
