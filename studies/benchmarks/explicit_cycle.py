"""Time of a cycle of the explicit solver, per contact.

    python studies/benchmarks/explicit_cycle.py

The wall is the paper's (6.0 x 2.4 m, 816 blocks, 7077 contacts) with a dpc and a roof load of 6 kN: intact under dead
load, and with a window, cracked by a dishing of 4 mm. One core. Compiling, or loading of compiled code, is timed
separately.
"""

from __future__ import annotations

import statistics
import time

from damagepred.assembly import wall_model
from damagepred.scene import Dpc, Loads, Movement, Opening, Scene, Solver
from damagepred.solvers.time_stepping.scheme import DampedTimeStepping

CYCLES, REPEATS = 1000, 11
EXPLICIT = Solver(method="explicit")


def intact() -> DampedTimeStepping:
    """Return the solid wall at rest under dead load."""
    scene = Scene(dpc=Dpc(), loads=Loads(roof=6000.0), solver=EXPLICIT)
    run = DampedTimeStepping(wall_model(scene), scene.solver)
    run.start_from_elastic_solution()
    return run


def cracked() -> DampedTimeStepping:
    """Return the wall with a window, still moving after a dishing of 4 mm."""
    scene = Scene(
        dpc=Dpc(),
        loads=Loads(roof=6000.0),
        opening=(Opening(x=2.55, y=0.9, width=0.9, height=1.5),),
        movement=Movement(kind="dishing", central_deflection=4e-3),
        solver=EXPLICIT,
    )
    run = DampedTimeStepping(wall_model(scene), scene.solver)
    run.advance(2000, load_factor_to=0.0, load_to=1.0)
    run.advance(4000, load_factor_to=1.0, load_to=1.0)
    return run


def nanoseconds(run: DampedTimeStepping, cycles: int = CYCLES, repeats: int = REPEATS) -> float:
    """Return the median time for each contact and cycle (ns)."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run._cycle(cycles, run.load_share, run.load_factor, 0.0)
        times.append(time.perf_counter() - start)
    return statistics.median(times) / cycles / run.model.n_contacts * 1e9


def main() -> None:
    """Print a table."""
    walls = {"solid, intact": intact(), "window, cracked": None}
    start = time.perf_counter()
    walls["solid, intact"]._cycle(1, 1.0, 0.0, 0.0)
    print(f"compile or load from cache: {time.perf_counter() - start:.2f} s")
    walls["window, cracked"] = cracked()
    print(f"{'wall':<18}{'blocks':>8}{'contacts':>10}{'us/cycle':>10}{'ns/contact':>12}")
    for name, run in walls.items():
        each = nanoseconds(run)
        contacts = run.model.n_contacts
        print(f"{name:<18}{run.model.n_blocks:>8}{contacts:>10}{each * contacts / 1e3:>10.1f}{each:>12.2f}")
        # the check of the option takes the time; no joint here has it
        for extra, run.special, run.softening in (
            ("dilation", True, None),
            ("softening", None, True),
            ("both", True, True),
        ):
            print(f"{'  with ' + extra:<18}{'':>28}{nanoseconds(run):>12.2f}")


if __name__ == "__main__":
    main()
