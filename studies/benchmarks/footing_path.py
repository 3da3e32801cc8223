"""Time of a path with the footing on jacks or on a mound, relative to the same wall on a prescribed profile.

    python studies/benchmarks/footing_path.py [--repeats 5]

Walls are those of the full-scale test, solid and with a window, with and without a dpc; quasi-static, 20 increments.
"jacks" ends where jacks or supports carry no load; "jacks, on" continues to the full deflection; "concrete" is the same
with a footing of reinforced concrete that cracks. Runs alternate; processor time, the median of several. Compiling is
not counted.
"""

from __future__ import annotations

import argparse
import statistics
import time
from dataclasses import replace
from pathlib import Path

from damagepred.assembly import wall_model
from damagepred.pipeline import Step, follow
from damagepred.scene import Mound, ReinforcedConcrete, Rig, Scene

DATA = Path(__file__).resolve().parents[2] / "data"


def footings(wall: Scene) -> dict[str, Scene]:
    """Return the scenes of one wall, by kind of footing."""

    def on(shape: str, scene: Scene = wall, **tables: object) -> Scene:
        return replace(scene, movement=replace(scene.movement, shape=shape), **tables)

    concrete = replace(wall, footing=replace(wall.footing, concrete=ReinforcedConcrete()))
    going_on = Rig(stop_at_zero=False)
    return {
        "prescribed": wall,
        "jacks": on("jacks"),
        "jacks, on": on("jacks", rig=going_on),
        "concrete, on": on("jacks", concrete, rig=going_on),
        "walsh": on("mound", mound=Mound(surface_movement=0.1)),
        "mitchell": on("mound", mound=Mound(shape="mitchell", surface_movement=0.1)),
        "mitchell, concrete": on("mound", concrete, mound=Mound(shape="mitchell", surface_movement=0.1)),
    }


def path(scene: Scene) -> tuple[float, list[Step]]:
    """Return the processor time of a path (s), and the path."""
    model = wall_model(scene)
    start = time.process_time()
    steps = list(follow(model, scene.solver, scene.damage, scene.movement.increments))
    return time.process_time() - start, steps


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    print("wall                     footing              time in s  ratio  increments  deflection mm  Newton   bonds")
    for name in ("dishing", "doming", "window_dishing", "window_doming"):
        known = Scene.from_toml(DATA / f"bryant_{name}.toml")
        known = replace(known, movement=replace(known.movement, increments=20, central_deflection=8e-3))
        for wall, title in ((known, name), (replace(known, dpc=None), f"{name}, no dpc")):
            scenes = footings(wall)
            times: dict[str, list[float]] = {key: [] for key in scenes}
            steps = {key: path(scene)[1] for key, scene in scenes.items()}  # compiles
            for _ in range(repeats):
                for key, scene in scenes.items():
                    times[key].append(path(scene)[0])
            for key, found in steps.items():
                taken, last = statistics.median(times[key]), found[-1].increment
                deflection = last.load_factor * 8e-3 if key == "prescribed" else abs(last.deflection)
                spent = sum(s.increment.counters.newton_iterations for s in found)
                print(
                    f"{title:24} {key:20} {taken:9.3f}  {taken / statistics.median(times['prescribed']):5.2f}  "
                    f"{last.number:10d}  {1e3 * deflection:13.3f}  {spent:6d}  "
                    f"{sum(s.increment.counters.events for s in found):6d}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
