"""What a run will cost, told before it starts by timing one wall."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from damagepred.assembly import Model, wall_model
from damagepred.path import Step, solve
from damagepred.scene import Scene, Solver
from damagepred.scene.reading import read_toml
from damagepred.solvers.half import symmetric_half
from damagepred.solvers.quasi_static.equations import block_levels
from damagepred.solvers.stiffness import held_dofs
from damagepred.study.settings import StudySettings
from damagepred.study.study import Study, warm_up
from damagepred.study.words import duration


@dataclass(frozen=True)
class Estimate:
    """Size and price of a run.

    Attributes
    ----------
    title : str
        Of the scene or study.
    blocks, contacts, joints, increments : int
        Size of one wall and its path.
    samples, variables : int
        Size of the study; 1 and 0 for a scene.
    compile_seconds, wall_seconds : float
        Time to make the kernels ready, and to solve one wall after that.
    method : str
        Solver.
    matrix_bytes : int
        What the matrices of the quasi-static solver take while a wall is solved; 0 for the explicit one.
    status : str
        How that wall ended.
    """

    title: str
    blocks: int
    contacts: int
    joints: int
    increments: int
    samples: int
    variables: int
    compile_seconds: float
    wall_seconds: float
    method: str
    matrix_bytes: int
    status: str

    def lines(self) -> list[str]:
        """Return the estimate in words."""
        found = [
            f"{self.title}: valid",
            f"  {self.blocks} blocks, {self.contacts} contacts, {self.joints} joints, {self.increments} increments",
            f"  one wall: {duration(self.wall_seconds)} ({self.status}); kernels made ready in "
            f"{duration(self.compile_seconds)}",
            f"  solver: {self.method}"
            + (f", {self.matrix_bytes / 1e6:.2g} MB of matrices" if self.matrix_bytes else ""),
        ]
        if self.variables:
            total = self.samples * self.wall_seconds
            found.append(
                f"  {self.samples} walls with {self.variables} uncertain numbers: about {duration(total)} with -j 1, "
                f"{duration(total / 2)} with -j 2"
            )
        return found


def matrix_bytes(model: Model, solver: Solver) -> int:
    """Return what the matrices of the quasi-static solver take (bytes): two for each level of blocks, dense.

    Parameters
    ----------
    model : Model
        The wall.
    solver : Solver
        Its settings; the explicit solver has no matrices.
    """
    if solver.method != "quasi_static":
        return 0
    half = symmetric_half(model) if solver.symmetric_half else None
    solved = model if half is None else half.model
    levels = block_levels(solved, held_dofs(solved))[: solved.n_blocks]
    return int(2 * 8 * ((3 * np.bincount(levels)) ** 2).sum())


def price(path: str | Path, on_step: Callable[[Step], None] | None = None) -> Estimate:
    """Validate a scene or study file and time one wall of it.

    Parameters
    ----------
    path : str or Path
        The file; a study has variables, a ``[study]`` table or names a scene.
    on_step : callable, optional
        Called with each increment.

    Raises
    ------
    InputError
        If the file is not acceptable.
    """
    tables = read_toml(path)
    samples = variables = 0
    if any(key in tables for key in ("scene", "study", "variables", "correlation")):
        settings = StudySettings.from_toml(path)
        title, samples, variables = settings.title, settings.study.samples, len(settings.variables)
        scene, fields = Study(settings).sample(0)
    else:
        scene, fields = Scene.from_toml(path), {}
        title = scene.title
    began = time.perf_counter()
    warm_up(scene)
    ready = time.perf_counter()
    model = wall_model(scene, fields)
    ds = solve(scene, fields=fields, on_failure="return", on_step=on_step)
    return Estimate(
        title, model.n_blocks, model.n_contacts, len(model.joints.kind), scene.movement.increments,
        samples or 1, variables, ready - began, time.perf_counter() - ready,
        scene.solver.method, matrix_bytes(model, scene.solver), str(ds.attrs["status"]),
    )  # fmt: skip
