"""How long one cycle of the explicit solver takes with deformable blocks: for each zone, facet and contact.

    python studies/benchmarks/zone_cycle.py

The wall is the paper's (6.0 x 2.4 m, 816 blocks) with a dpc and a roof load of 6 kN, its bricks cut into 51 200 zones:
elastic, with a strength that nothing reaches, and with one that some zones pass. Zones and facets are also timed on
their own. One core; of many short runs the median and the quickest, in time of the processor, as other work on the
machine slows them. Compiling, or loading what was compiled before, is timed apart.
"""

from __future__ import annotations

import os
import resource
import statistics
import time
from collections.abc import Callable

from damagepred.assembly import wall_model
from damagepred.enumerations import ZoneState
from damagepred.kernels.jit import rule
from damagepred.kernels.zone.forces import place_facets, scatter_facet_forces, zone_forces
from damagepred.scene import BlockMaterial, Dpc, Loads, Movement, Scene, Solver, Wall
from damagepred.solvers.time_stepping.scheme import DampedTimeStepping

CYCLES, REPEATS = 20, 41
DISHING = Movement(kind="dishing", central_deflection=1e-3)
STRONG = BlockMaterial(cohesion=20e6, friction=0.75, tensile_strength=5e6)
WEAK = BlockMaterial(cohesion=0.06e6, friction=0.75, tensile_strength=0.03e6)


@rule  # not kept: what a script leaves in the cache, a test that imports it could not load
def zones_alone(zones, displacement, force, cycles):
    for _ in range(cycles):
        zone_forces(zones, displacement, force)


@rule
def facets_alone(facets, displacement, force, cycles):
    for _ in range(cycles):
        place_facets(facets, displacement)
        scatter_facet_forces(facets, force)


def wall(block: BlockMaterial, blocks: str = "deformable", size: Wall | None = None) -> DampedTimeStepping:
    """Return the wall at rest under dead load, if it bears it elastically."""
    solver = Solver(method="explicit", blocks=blocks)  # type: ignore[arg-type]
    scene = Scene(
        wall=size or Wall(), block=block, dpc=Dpc(), loads=Loads(roof=6000.0), movement=DISHING, solver=solver
    )
    run = DampedTimeStepping(wall_model(scene), solver)
    run.start_from_elastic_solution()
    return run


def bent(block: BlockMaterial, size: Wall | None = None) -> DampedTimeStepping:
    """Return the wall still moving while it dishes by 1 mm."""
    run = wall(block, size=size)
    run.advance(1500, load_factor_to=1.0, load_to=1.0)
    return run


def nanoseconds(work: Callable[[int], object], cycles: int = CYCLES, repeats: int = REPEATS) -> tuple[float, float]:
    """Return median and shortest time of a cycle (ns of the processor)."""
    times = []
    for _ in range(repeats):
        start = time.process_time_ns()
        work(cycles)
        times.append((time.process_time_ns() - start) / cycles)
    return statistics.median(times), min(times)


def whole(run: DampedTimeStepping) -> Callable[[int], object]:
    """Return a function that runs cycles of the solver."""
    return lambda cycles: run._cycle(cycles, run.load_share, run.load_factor, 0.0)


def alone(run: DampedTimeStepping) -> tuple[Callable[[int], object], Callable[[int], object]]:
    """Return functions that run zones alone and facets alone, at constant displacement."""
    assert run.zones is not None
    facets, zones = run.zones.packed
    displacement, force = run.motion.displacement, run.motion.force.copy()
    return (
        lambda cycles: zones_alone(zones, displacement, force, cycles),
        lambda cycles: facets_alone(facets, displacement, force, cycles),
    )


def peak() -> float:
    """Return the peak memory of this process (MB)."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    """Print a table."""
    load = os.getloadavg()[0]
    tiny = Wall(length=0.96, height=0.3)
    start = time.perf_counter()
    for block in (BlockMaterial(), WEAK):
        run = wall(block, size=tiny)
        for work in (whole(run), *alone(run)):
            work(1)
    print(f"compile or load from cache: {time.perf_counter() - start:.2f} s")
    print(f"load of the machine: {load:.1f} on {os.cpu_count()} cores; times are median (quickest)")
    before = peak()
    rigid = wall(BlockMaterial(), blocks="rigid")
    contacts = nanoseconds(whole(rigid))
    print("| wall | zones | facets | contacts | us a cycle | ns a zone, in all | zones alone | yield now, so far |")
    print("|---|---|---|---|---|---|---|---|")
    print(f"| rigid | - | - | {rigid.model.n_contacts} | {_both(contacts, 1e3)} | - | - | - |")
    for name, build in (
        ("elastic", lambda: bent(BlockMaterial())),
        ("with strength, none yields", lambda: bent(STRONG)),
        ("with strength, some yield", lambda: bent(WEAK)),
    ):
        run = build()
        mesh = run.model.mesh
        assert mesh is not None
        assert run.zones is not None
        zones, facets = len(mesh.zones), len(mesh.facets)
        every = nanoseconds(whole(run))
        state = run.zones.results(run.motion.displacement).state
        now, so_far = int(((state > ZoneState.ELASTIC) & (state < ZoneState.YIELDED)).sum()), int((state > 0).sum())
        zones_work, facets_work = alone(run)
        own, rims = nanoseconds(zones_work), nanoseconds(facets_work)
        print(
            f"| {name} | {zones} | {facets} | {run.model.n_contacts} | {_both(every, 1e3)} | {_both(every, zones)} "
            f"| {_both(own, zones)} | {now}, {so_far} |"
        )
        if name == "elastic":
            on_facets = f"facets: {_both(rims, facets)} ns each and cycle"
            held = f"memory: {before:.0f} MB before, {peak():.0f} MB at most with 51 200 elastic zones"
    print(f"{on_facets}; rigid blocks: {_both(contacts, rigid.model.n_contacts)} ns a contact and cycle")
    print(held)


def _both(times: tuple[float, float], share: float) -> str:
    return f"{times[0] / share:.2f} ({times[1] / share:.2f})"


if __name__ == "__main__":
    main()
