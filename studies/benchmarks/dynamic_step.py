"""Time of a step of a run in time, per boundary point and per zone.

    python studies/benchmarks/dynamic_step.py

The wall is the paper's (6.0 x 2.4 m, 816 blocks): at rest, and dry and shaken by a pulse so that bricks slide and fall;
and of deformable bricks, 51 200 zones, with their joints. One core; processor time, the fastest of many intervals.
Compiling is not counted.
"""

from __future__ import annotations

import time

from damagepred.assembly import wall_model
from damagepred.pipeline import dynamic_run
from damagepred.scene import BaseMotion, BlockMaterial, Dynamics, Joint, Scene, Solver

OUTPUTS, INTERVAL = 100, 2e-3
"""Number of intervals, and their length (s)."""


def at_rest() -> Scene:
    """Return the wall with its mortar on ground at rest."""
    return Scene(dynamics=Dynamics(duration=OUTPUTS * INTERVAL, outputs=OUTPUTS))


def falling() -> Scene:
    """Return the wall without mortar on ground that shakes with 20 m/s2."""
    pulse = BaseMotion(kind="full_sine", acceleration=20.0, duration=0.3)
    joint = Joint(tensile_strength=0.0, cohesion=0.0, friction=0.6)
    return Scene(joint=joint, dynamics=Dynamics(duration=OUTPUTS * INTERVAL, outputs=OUTPUTS, base=(pulse,)))


def of_zones(material: BlockMaterial, outputs: int) -> Scene:
    """Return the wall of deformable bricks, shaken."""
    pulse = BaseMotion(kind="full_sine", acceleration=5.0, duration=0.3)
    solver = Solver(blocks="deformable", zone_size=0.0375)
    time = Dynamics(duration=1e-3 * outputs, outputs=outputs, base=(pulse,), start="unstressed")
    return Scene(block=material, solver=solver, dynamics=time)


def zones() -> None:
    """Print a table of walls of zones."""
    print("zones       zones  points  prepared in s  steps  us a step  ns a zone and step (fastest, all)")
    strong = BlockMaterial(cohesion=10e6, tensile_strength=5e6)
    for name, material in (("elastic", BlockMaterial()), ("with strength", strong)):
        scene, outputs = of_zones(material, 6), 6
        assert scene.dynamics is not None
        model = wall_model(scene)
        dynamic_run(model, scene.solver, scene.dynamics).advance()  # compiles
        start = time.process_time()
        run = dynamic_run(model, scene.solver, scene.dynamics)
        prepared = time.process_time() - start
        assert run.grid is not None
        times = []
        for _ in range(outputs):
            start = time.process_time()
            run.advance()
            times.append((time.process_time() - start) / run.steps_each)
        count, mean = len(run.grid.zones), sum(times) / len(times)
        print(
            f"{name:14s} {count:5d} {len(run.bodies.points):6d} {prepared:10.1f} {run.steps:10d} {1e6 * mean:9.0f} "
            f"{1e9 * min(times) / count:8.1f} {1e9 * mean / count:6.1f}"
        )


def main() -> None:
    """Print a table."""
    print("wall        points  steps  searches  us a step  ns a point and step (fastest, all)")
    for name, scene in (("at rest", at_rest()), ("shaken", falling())):
        assert scene.dynamics is not None
        run = dynamic_run(wall_model(scene), scene.solver, scene.dynamics)
        run.advance()
        times = []
        for _ in range(OUTPUTS - 1):
            start = time.process_time()
            run.advance()
            times.append((time.process_time() - start) / run.steps_each)
        points, mean = len(run.bodies.points), sum(times) / len(times)
        print(
            f"{name:10s} {points:7d} {run.steps:6d} {run.search.count:9d} {1e6 * mean:10.0f} "
            f"{1e9 * min(times) / points:8.1f} {1e9 * mean / points:6.1f}"
        )


if __name__ == "__main__":
    main()
    zones()
