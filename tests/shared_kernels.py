"""Kernels that one process of the tests has compiled are loaded by the others, which otherwise compile them again."""

import os
from collections.abc import Iterator
from typing import Any

from damagepred import Scene, solve
from damagepred.kernels import jit, progress
from damagepred.kernels.process_cache import ProcessCache, _files, _identity, link


def number_compiled() -> int:
    """Number of kernels that this process has compiled or loaded, each for its arguments."""
    return sum(len(function.signatures) for _, function in progress._functions)


def take(cache: ProcessCache) -> None:
    """Take the kernels that other processes have published since; those compiled here stay."""
    with cache._locked():
        for index in _files(cache._shared, "*.nbi"):
            name = index.relative_to(cache._shared)
            known = cache._known.get(name)
            if _identity(index) == known or _identity(cache.folder / name) != known:
                continue
            for file in (*index.parent.glob(f"{index.stem}.*.nbc"), index):  # the index last
                link(file, cache.folder / file.relative_to(cache._shared))
            cache._known[name] = _identity(index)


def sharing(cache: ProcessCache | None = jit.CACHE) -> Iterator[None]:
    """At each step, publish the kernels that are new here, and take those that are new elsewhere."""
    taken, compiled = 0, 0
    while cache is not None:
        if number_compiled() != compiled:
            cache.publish()
            compiled = number_compiled()
        with os.scandir(cache._shared) as entries:
            rooms = [entry for entry in entries if entry.is_dir() and entry.name != "processes"]
        newest = max((room.stat().st_mtime_ns for room in rooms), default=0)
        if newest != taken:
            take(cache)
            taken = newest
        yield


YIELDS = {"cohesion": 12e3, "friction": 0.3, "tensile_strength": 2e3}
SOFTENS = {"fracture_energy": 10.0}
WALLS: tuple[dict[str, Any], ...] = (
    {"solver": {"method": "explicit"}},
    {"movement": {"shape": "mound"}, "footing": {"concrete": {}}},
    {"solver": {"method": "explicit", "blocks": "deformable"}, "block": YIELDS},
    {"dynamics": {"duration": 0.01, "outputs": 1}},
    {"joint": SOFTENS},
    {"solver": {"blocks": "deformable"}, "block": YIELDS},
    {"solver": {"method": "explicit"}, "movement": {"shape": "jacks"}, "footing": {"concrete": {}}},
    {"solver": {"method": "explicit", "blocks": "rigid"}, "joint": SOFTENS},
)
"""Small walls that need kernels of all kinds; every second one takes half of the time."""


def compile_share(number: int, processes: int) -> None:
    """Compile the share of one of several processes, which otherwise compile the same kernels at the same time."""
    small = {"wall": {"length": 0.48, "height": 0.15}, "movement": {"central_deflection": 1e-5, "increments": 1}}
    for wall in WALLS[number::processes]:
        tables = small | wall | {"movement": small["movement"] | wall.get("movement", {})}
        if jit.CACHE is not None:
            take(jit.CACHE)
        solve(Scene.from_dict(tables), on_failure="return")
        if jit.CACHE is not None:
            jit.CACHE.publish()
