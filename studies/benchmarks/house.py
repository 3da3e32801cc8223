"""Cost of a house over the cost of its walls, each alone on the same ground.

    python studies/benchmarks/house.py [--walls 2 4 8] [--blocks elastic] [--repeats 2]

solves a corner, a house of four walls and 4000 blocks, and two such houses in a row, and their walls one by one, in
turns, and prints CPU seconds.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import xarray as xr

from damagepred.one_wall.solve import solve
from damagepred.scene import House, Scene

PLAN = {
    "front": ([0, 0], [9, 0]),
    "left": ([0, 6], [0, 0]),
    "right": ([9, 0], [9, 6]),
    "back": ([9, 6], [0, 6]),
    "front_2": ([9, 0], [18, 0]),
    "end": ([18, 0], [18, 6]),
    "back_2": ([18, 6], [9, 6]),
    "cross": ([13, 6], [13, 0]),
}
HOLES = [{"kind": "door", "x": 1.92, "width": 0.96, "height": 2.1}, {"x": 5.04, "y": 0.9, "width": 1.2, "height": 1.2}]
WINDOW = [{"x": 2.4, "y": 0.9, "width": 1.2, "height": 1.2}]


def house(blocks: str, count: int) -> House:
    """Corner, house of 9 x 6 m, or two in a row, by the number of walls; one corner settles by a tree."""
    walls = [
        {"name": name, "start": start, "end": end, "height": 2.55, "opening": HOLES if name == "front" else WINDOW}
        for name, (start, end) in list(PLAN.items())[:count]
    ]
    mound = {"shape": "tree", "point": [-1.5, -1.5], "reach": 9, "surface_movement": "60 mm"}
    joint = {"tensile_strength": "0.2 MPa", "cohesion": "0.3 MPa"}
    movement = {"kind": "settle", "increments": 10}
    tables = {"wall": walls, "joint": joint, "mound": mound, "movement": movement, "solver": {"blocks": blocks}}
    made = Scene.from_dict(tables)
    assert isinstance(made, House)
    return made


def timed(run: Callable[[], xr.Dataset]) -> tuple[float, xr.Dataset]:
    """CPU seconds of a call, and its result."""
    begin = time.process_time()
    result = run()
    return time.process_time() - begin, result


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--walls", type=int, nargs="+", default=[2, 4, 8], choices=(2, 4, 8))
    parser.add_argument("--blocks", default="elastic", choices=("rigid", "elastic"))
    parser.add_argument("--repeats", type=int, default=2)
    given = parser.parse_args()
    solve(Scene.from_dict({"wall": {"length": 1.2, "height": 0.3}}))  # compiles
    for made in [house(given.blocks, count) for count in given.walls] * given.repeats:
        together, ds = timed(lambda made=made: solve(made))
        alone = [timed(lambda scene=scene: solve(scene)) for scene in made.scenes]
        counts = [
            f"{one.sizes['block']} blocks, {one['crack_count'][-1]:g} cracks" for one in (ds, *(w for _, w in alone))
        ]
        print(f"house: {together:.1f} s, {counts[0]}; categories {ds['wall_damage_category'].values[-1].tolist()}")
        for name, (seconds, _), count in zip(made.names, alone, counts[1:]):
            print(f"  {name} alone: {seconds:.1f} s, {count}")
        ratio = together / sum(seconds for seconds, _ in alone)
        print(f"  {len(alone)} walls, house over its walls: {ratio:.2f}", flush=True)


if __name__ == "__main__":
    main()
