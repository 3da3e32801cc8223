"""Stress the solvers: what holds, what is refused, and with which words.

    python studies/stability/run.py [--no-write]

Stacks with one thing out of proportion, solved by every solver, and compared with a direct solution in longer numbers;
then time steps beyond the limit, forced on the solvers behind their own checks. Writes the tables into the README.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import dataclasses
import re
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple
from unittest import mock

import numpy as np
from scipy import linalg

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from cases import Case, cases, cracking_wall, reference, settings, stack  # noqa: E402

from damagepred.assembly import Model  # noqa: E402
from damagepred.errors import DamagepredError  # noqa: E402
from damagepred.scene import Dynamics, Scene, Solver  # noqa: E402
from damagepred.solvers import ContactState, explicit, solve_path  # noqa: E402
from damagepred.solvers.dynamic import DynamicRun  # noqa: E402
from damagepred.solvers.dynamic import run as dynamic_run  # noqa: E402
from damagepred.solvers.explicit import explicit_path  # noqa: E402
from damagepred.solvers.stiffness import elastic_stiffness, held_dofs  # noqa: E402
from damagepred.solvers.zoned import gridpoint_mass  # noqa: E402

RIGHT = 1e-2
"""Largest error, over the largest displacement, of a right answer."""
PERIODS = 30.0
"""Of the slowest vibration that a run in time is given to come to rest, with local damping."""
STEPS = 10_000_000
"""Time steps that a run in time may take, fewer with more degrees of freedom: some ten seconds."""


class Outcome(NamedTuple):
    """What came of a case: error over the largest displacement, seconds, and the message if it was refused."""

    error: float
    seconds: float
    message: str = ""

    @property
    def verdict(self) -> str:
        """Right, refused, or wrong without a word."""
        if self.message:
            return "not tried" if "not tried" in self.message else "refused"
        return "right" if self.error <= RIGHT else "WRONG"

    def __str__(self) -> str:
        if self.message:
            return f"refused after {self.seconds:.1f} s: {self.message}"
        return f"{'' if self.verdict == 'right' else '**WRONG** '}{self.error:.0e}, {self.seconds:.2g} s"


Way = Callable[[Case], Outcome]


def outcome(found: Callable[[], np.ndarray], exact: np.ndarray) -> Outcome:
    """Return what comes of a solution."""
    begun = time.perf_counter()
    try:
        displacement = found()
    except DamagepredError as error:
        return Outcome(np.nan, time.perf_counter() - begun, f"{type(error).__name__}: {error}")
    error = float(np.abs(displacement - exact)[:, :2].max() / np.abs(exact[:, :2]).max())
    return Outcome(error, time.perf_counter() - begun)


def by_steps(case: Case, method: str, deformable: bool) -> Outcome:
    """Solve under dead load; the explicit solver without its elastic start."""
    own = settings(method)
    try:
        model = case.build(deformable).build(own)
    except DamagepredError as error:
        return Outcome(np.nan, 0.0, f"{type(error).__name__}: {error}")

    def found() -> np.ndarray:
        path = explicit_path(model, own, 1, elastic_start=False) if method == "explicit" else solve_path(model, own, 1)
        last = next(iter(path))
        if last.collapsed:
            raise DamagepredError("the wall is said to fall")
        return last.displacement

    return outcome(found, reference(model))


def slowest(model: Model) -> float:
    """Return the longest period of vibration (s)."""
    free = np.setdiff1d(np.arange(model.size), held_dofs(model))
    inertia = np.zeros(model.size)
    whole = np.column_stack((model.mass, model.mass, model.mass * model.blocks.polar / model.blocks.area))
    inertia[: whole.size] = whole.ravel()
    if model.mesh is not None:
        inertia[model.mesh.dof_x] = inertia[model.mesh.dof_y] = gridpoint_mass(model)
    root = 1.0 / np.sqrt(inertia[free])
    dynamic = elastic_stiffness(model)[free][:, free].toarray() * root[:, None] * root
    # the lowest is lost in rounding: the inverse has it first
    return float(2 * np.pi * np.sqrt(linalg.eigvalsh(linalg.inv(0.5 * (dynamic + dynamic.T)))[-1]))


def in_time(case: Case, deformable: bool) -> Outcome:
    """Let blocks fall onto their unstressed joints and come to rest, in physical time."""
    own = settings("quasi_static")
    try:
        model = case.build(deformable).build(own)
    except DamagepredError as error:
        return Outcome(np.nan, 0.0, f"{type(error).__name__}: {error}")
    dynamics = Dynamics(duration=PERIODS * slowest(model), outputs=60, damping="local", start="unstressed")

    def found() -> np.ndarray:
        run = DynamicRun(model, own, dynamics)
        steps = run.steps_each * dynamics.outputs * (1 + model.size / 100)
        if steps > STEPS:
            raise DamagepredError(f"not tried: would take {run.steps_each * dynamics.outputs:.1g} steps")
        last = list(run)[-1]
        return last.displacement

    return outcome(found, reference(model))


WAYS: dict[str, Way] = {
    "quasi-static, rigid": lambda case: by_steps(case, "quasi_static", False),
    "quasi-static, deformable": lambda case: by_steps(case, "quasi_static", True),
    "explicit, rigid": lambda case: by_steps(case, "explicit", False),
    "explicit, deformable": lambda case: by_steps(case, "explicit", True),
    "in time, rigid": lambda case: in_time(case, False),
    "in time, deformable": lambda case: in_time(case, True),
}


def longer_steps(share: float) -> dict[str, Outcome]:
    """Solve with time steps of a share of the limit; beyond it, behind the back of what would refuse them."""
    forced = max(share, 1.0)
    found: dict[str, Outcome] = {}
    scaled, stepped = explicit.scaled_mass, dynamic_run.time_step
    for way, deformable in (("explicit, rigid", False), ("explicit, deformable", True)):
        own = Solver(method="explicit", lump_block_elasticity=False, time_step_safety=min(share, 1.0))
        model = stack(deformable).build(own)
        with mock.patch.object(explicit, "scaled_mass", lambda *a: scaled(*a) / forced**2), np.errstate(all="ignore"):
            found[way] = outcome(
                lambda m=model, o=own: next(iter(explicit_path(m, o, 1, elastic_start=False))).displacement,  # type: ignore[misc]
                reference(model),
            )
    own = settings("quasi_static")
    for way, deformable, new_contacts in (
        ("in time, no new contacts", False, False), ("in time, rigid", False, True), ("in time, deformable", True, True)
    ):  # fmt: skip
        model = stack(deformable).build(own)
        dynamics = Dynamics(
            duration=PERIODS * slowest(model), outputs=60, damping="local", start="unstressed",
            time_step_safety=min(share, 1.0), new_contacts=new_contacts,
        )  # fmt: skip
        with mock.patch.object(dynamic_run, "time_step", lambda *a: forced * stepped(*a)), np.errstate(all="ignore"):
            found[way] = outcome(
                lambda m=model, o=own, d=dynamics: list(DynamicRun(m, o, d))[-1].displacement, reference(model)
            )  # type: ignore[misc]
    return found


SHARES = (0.1, 0.5, 0.9, 1.0, 1.05, 1.2, 1.5, 2.0)


def refused_words() -> list[str]:
    """Return what is said when a time step beyond the limit is asked for."""
    said = []
    for part in ("solver", "dynamics"):
        asked = f"`[{part}] time_step_safety = 1.2`"
        try:
            Scene.from_dict({part: {"time_step_safety": 1.2}})
        except DamagepredError as error:
            said.append(f"{asked}: {' '.join(str(error).split())}")
        else:
            said.append(f"{asked}: **WRONG** taken without a word")
    return said


def cracked(model: Model, own: Solver) -> tuple[int, float, float]:
    """Return cracked contacts, largest opening (m) and seconds of the wall that sags."""
    begun = time.perf_counter()
    last = list(solve_path(model, own, 4))[-1]
    count = int((last.state == ContactState.CRACKED).sum())
    return count, float(last.opening.max()), time.perf_counter() - begun


def cracking() -> list[list[str]]:
    """Return rows on a wall that cracks, far from the origin and at other time steps."""
    rows = []
    for name, deformable in (("rigid", False), ("deformable", True)):
        for method in ("quasi_static", "explicit"):
            usual = Solver(method=method, tolerance=None if method == "quasi_static" else 1e-4, symmetric_half=False)  # type: ignore[arg-type]
            exact = cracked(cracking_wall(deformable, 0.0).build(usual), usual)
            tried: list[tuple[str, float, Solver]] = [(f"{far / 1e3:g} km", far, usual) for far in (1e3, 1e4, 1e6)]
            if method == "explicit":
                shares = (0.1, 0.5, 1.0)
                tried += [(f"{s:g} of the limit", 0.0, dataclasses.replace(usual, time_step_safety=s)) for s in shares]
            for stress, far, own in tried:
                way = f"{method.replace('_', '-')}, {name}"
                try:
                    count, gap, seconds = cracked(cracking_wall(deformable, far).build(own), own)
                except DamagepredError as error:
                    rows.append([way, stress, f"refused: {error}", "", "", ""])
                    continue
                off = abs(gap / exact[1] - 1)
                wrong = "" if off <= RIGHT else "**WRONG** "
                rows.append([way, stress, f"{exact[0]}", f"{count}", f"{wrong}{off:.0e}", f"{seconds:.2g}"])
                print(rows[-1], flush=True)
    return rows


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    """Return a table in Markdown."""
    return [
        "| " + " | ".join(head) + " |", "|" + "---|" * len(head),
        *("| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in row) + " |" for row in rows),
    ]  # fmt: skip


def report() -> list[str]:
    """Return the tables."""
    for way in WAYS.values():
        way(Case("none", "", stack))  # compiles
    rows, messages, count = [], [], {"right": 0, "refused": 0, "not tried": 0, "WRONG": 0}
    for case in cases():
        cells = [f"{case.stress}", case.size]
        for name, way in WAYS.items():
            done = way(case)
            count[done.verdict] += 1
            print(f"{case.stress}, {case.size}, {name}: {done}", flush=True)
            if done.message:
                messages.append(f"- {case.stress}, {case.size}, {name}: {done.message}")
                cells.append(done.verdict if done.verdict == "not tried" else f"refused, {done.seconds:.2g} s")
            else:
                cells.append(str(done))
        rows.append(cells)
    lines = [
        f"{count['right']} right, {count['refused']} refused, {count['not tried']} not tried, {count['WRONG']} wrong "
        "without a word.",
        "",
    ]
    lines += table(["stress", "size", *WAYS], rows)
    lines += ["", "What was refused, and how:", "", *(messages or ["- nothing"])]
    lines += ["", "### Time steps", ""]
    steps, said = [], []
    for share in SHARES:
        found = longer_steps(share)
        print(share, {k: str(v) for k, v in found.items()}, flush=True)
        steps.append([f"{share:g}", *("refused" if o.message else str(o) for o in found.values())])
        said += [f"- {share:g}, {name}: {o.message}" for name, o in found.items() if o.message]
    lines += [*table(["share of the limit", *found], steps), "", *said, "", "Asked for by the user:", ""]
    lines += [f"- {words}" for words in refused_words()]
    head = ["solver", "stress", "contacts cracked, unstressed", "stressed", "largest opening differs by", "s"]
    return [*lines, "", "### A wall that cracks", "", *table(head, cracking())]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--no-write", action="store_true", help="leave the README as it is")
    options = parser.parse_args()
    lines = report()
    page = HERE / "README.md"
    if options.no_write:
        print("\n".join(lines))
    else:
        text = page.read_text(encoding="utf-8")
        mark = "<!-- written by run.py -->"
        page.write_text(re.split(mark, text)[0] + mark + "\n\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return int(any("WRONG" in line for line in lines[2:]))


if __name__ == "__main__":
    sys.exit(main())
