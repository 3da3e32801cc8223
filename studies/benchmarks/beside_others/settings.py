"""Settings of each solver; the fastest of them counts at each residual."""

from __future__ import annotations

from typing import Any

from damagepred.scene import Solver

Settings = dict[str, Any]

OURS: dict[str, list[Settings]] = {
    "quasi_static": [{}, {"symmetric_half": False}],
    "explicit": [{}, {"tolerance": 1e-4}],
}
"""Our solvers with their defaults; without the symmetry reduction; and with a smaller tolerance."""

WIDTH = 0.005
"""Bracket of the collapse load, in shares of the weight."""

PYMUNK: list[Settings] = [{"dt": dt, "iterations": n} for dt in (0.01, 0.003, 0.001) for n in (10, 30, 100)]
LMGC90: list[Settings] = [{"dt": dt} for dt in (0.01, 0.003, 0.001)]

OPENSEES: list[Settings] = [
    {"scheme": "implicit", "dt": 1e-3},
    {"scheme": "explicit", "dt": 1e-5, "every": 200},
]
"""Of runs in time; under its own weight, and pushed, OpenSees solves the wall statically."""
EXUDYN: list[Settings] = [{"scheme": "explicit", "dt": 2e-5, "slab": 0.005}]


def settings_of(solver: str, case: str, size: str) -> list[Settings]:
    """Return the settings a solver is tried with."""
    if solver in OURS:
        fewer = [{"increments": 2}, {"increments": 1}] if case == "gap" and solver == "quasi_static" else []
        return OURS[solver][:1] if case == "tilt" else [*OURS[solver], *fewer]
    if solver == "limit analysis":
        return [{}] if case == "tilt" else []
    if case == "tilt":
        return {
            "pymunk": [{"dt": 0.003, "iterations": 100}, {"dt": 0.001, "iterations": 100}],
            "lmgc90": [{"dt": 0.01}],
            "openseespy": [{"scheme": "static"}],
            "exudyn": EXUDYN,
        }.get(solver, [])
    if solver == "openseespy" and case == "settling":
        return [{"scheme": "static"}]
    return {"pymunk": PYMUNK, "lmgc90": LMGC90, "openseespy": OPENSEES, "exudyn": EXUDYN}.get(solver, [])


def our_solver(name: str, settings: Settings) -> Solver:
    """Return the settings of one of our solvers."""
    return Solver(method=name, **settings)  # type: ignore[arg-type]


def described(settings: Settings) -> str:
    """Return settings in one line."""
    return (
        ", ".join(
            f"{name} {value:g}" if isinstance(value, float) else f"{name} {value}" for name, value in settings.items()
        )
        or "default"
    )
