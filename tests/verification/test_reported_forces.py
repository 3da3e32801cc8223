"""Reported forces, openings, residuals and first breaks, computed independently from stresses and motion."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.enumerations import ContactState
from damagepred.one_wall.judged_path import dynamic_run
from damagepred.scene import Dynamics, Joint, Rig, Solver
from damagepred.solvers import Increment, solve_path
from damagepred.solvers.explicit.stepper import CHECK_INTERVAL, PASSED_CHECKS
from tests.properties.statics import unbalanced
from tests.verification.test_energy_accounts import DRY, brickwork, on_jacks, uneven

WEAK = replace(DRY, tensile_strength=20e3, cohesion=30e3)
QUASI_STATIC = Solver(blocks="rigid", symmetric_half=False)
EXPLICIT = Solver(blocks="rigid", method="explicit", tolerance=1e-6, symmetric_half=False)


def moved_wall(joint: Joint) -> Model:
    """A wall on uneven ground under dead and live loads, below a beam that is pushed, beside a held prop."""
    wall = brickwork(joint)
    beam = wall.add_block(rectangle(0.0, 0.4, 0.6, 0.45))
    prop = wall.add_block(rectangle(0.6, 0.0, 0.75, 0.1))
    wall.support(prop, x=True, y=False, rotation=True)
    wall.move(beam, x=0.06e-3, rotation=0.05e-3)
    wall.load(beam, x=5.0, y=-2500.0, moment=40.0)
    wall.push(8, x=20.0, y=-300.0, moment=-3.0)
    wall.rest_on_ground([0, 1, 2, 3, prop], lambda x: uneven(x, 1.0))
    return wall.build(QUASI_STATIC)


def on_supports(rig: Rig) -> Model:
    return on_jacks("deflection", rig=rig).model


MODELS: dict[str, Callable[[], Model]] = {
    "dry": lambda: moved_wall(DRY),
    "weak": lambda: moved_wall(WEAK),
    "jacks": lambda: on_supports(Rig(supports=(0.05, 1.12), jacks=(0.3, 0.75), stop_at_zero=False)),
    "half on jacks": lambda: on_supports(Rig(stop_at_zero=False)),
}


def path_of(model: Model, method: str, half: bool) -> list[Increment]:
    if method == "dynamic":  # so slowly that it stays near equilibrium
        settings = Dynamics(
            duration=0.2, outputs=2, movement_time=0.18, damping="local", local_damping=0.3, new_contacts=False
        )
        return list(dynamic_run(model, QUASI_STATIC, settings))
    solver = {"quasi_static": QUASI_STATIC, "explicit": EXPLICIT}[method]
    return list(solve_path(model, replace(solver, symmetric_half=half), 4))


def openings(model: Model, step: Increment) -> np.ndarray:
    """Return the openings that the motion of blocks and ground makes, (m, q)."""
    face, n = model.interfaces, model.n_blocks
    tangent = np.column_stack((face.normal_y, -face.normal_x))
    where = np.stack((face.x, face.y), axis=-1)[:, None] + face.contact_offset[..., None] * tangent[:, None]
    centre = np.column_stack((np.append(model.blocks.x, 0.0), np.append(model.blocks.y, 0.0)))
    motion = np.vstack((step.displacement, np.zeros(3)))

    def moved(block: np.ndarray) -> np.ndarray:
        arm, turn = where - centre[block][:, None], motion[block, 2][:, None]
        return motion[block, None, :2] + np.stack((-turn * arm[..., 1], turn * arm[..., 0]), axis=-1)

    jump = moved(face.block_b) - moved(face.block_a)
    opening = jump[..., 0] * face.normal_x[:, None] + jump[..., 1] * face.normal_y[:, None]
    if model.jacks is None:
        ground = face.block_a == n
        opening[ground] -= uneven(where[ground, :, 0], step.load_factor)
    return opening


def residual(model: Model, step: Increment) -> np.ndarray:
    """Return force and moment on each block (n, 3): all but those of supports (N, N m)."""
    loads = model.supports
    acting = loads.load + step.load_factor * loads.live_load
    if model.jacks is not None:
        acting = acting + step.footing.jack_load * model.jacks.push[: acting.size]
    loaded = replace(model, supports=loads._replace(load=acting))
    force = unbalanced(loaded, step) * loaded.mean_block_weight
    force[:, 2] *= np.sqrt(model.blocks.polar / model.blocks.area)
    return force


CASES = [
    *((name, method) for name in ("dry", "weak") for method in ("quasi_static", "explicit", "dynamic")),
    *((name, method) for name in ("jacks", "half on jacks") for method in ("quasi_static", "explicit")),
]


@pytest.mark.parametrize(("name", "method"), CASES)
def test_reported_forces_are_those_of_the_stresses(name: str, method: str) -> None:
    model = MODELS[name]()
    path = path_of(model, method, name.startswith("half"))
    law, face, n = model.properties, model.interfaces, model.n_blocks
    weight, gyration = model.mean_block_weight, np.sqrt(model.blocks.polar / model.blocks.area)
    free = np.ones((n, 3), dtype=np.bool_)
    free.ravel()[model.supports.prescribed] = False
    on_ground = (face.block_a == n)[:, None]
    assert path[-1].load_factor == 1.0
    for step in path:
        force = residual(model, step)
        ratio = np.abs(force) / weight
        ratio[:, 2] /= gyration
        largest = float(ratio[free].max())
        near = {"quasi_static": 1e-9, "explicit": 1e-6, "dynamic": 1e-3}[method]
        if method != "dynamic":
            assert largest < 2e-6
            if method == "quasi_static":
                assert step.residuals.unbalanced_force_ratio == pytest.approx(largest, rel=1e-3, abs=1e-9)
            else:  # blocks have moved once more, and fast oscillations turn by a radian per cycle: they share the bound
                assert 0 < step.residuals.unbalanced_force_ratio < EXPLICIT.tolerance_used
        held = np.where(free, 0.0, -force)
        size = np.abs(held).max() + weight
        np.testing.assert_allclose(step.support_force, held, atol=near * size)
        bearing = float((face.contact_area * -step.normal_stress * on_ground).sum())
        assert step.base_reaction == pytest.approx(bearing + held[:, 1].sum(), abs=near * size)
        opening = openings(model, step)
        np.testing.assert_allclose(step.opening, opening, atol={"dynamic": 1e-8}.get(method, 1e-14))
        touching = (step.normal_stress < 0) | (step.state != ContactState.CRACKED)
        touching &= np.broadcast_to((law.tensile_strength > 0)[:, None], touching.shape) | (opening < 0)
        stress = (law.normal_stiffness[:, None] * opening)[touching]
        np.testing.assert_allclose(
            step.normal_stress[touching], stress, atol=(1e-2 if method == "dynamic" else 1e-6) * np.abs(stress).max()
        )
        if model.jacks is not None:
            check_deflection(model, step)
    if method != "dynamic":
        check_breaks(model, path)


def check_deflection(model: Model, step: Increment) -> None:
    """The footing's middle between the outer supports against them, by the motion of the segments there."""
    listed = model.footing

    def rise(x: float) -> float:
        away = np.abs(model.blocks.x[listed] - x)
        here = listed[away < away.min() + 1e-9]
        return float((step.displacement[here, 1] + step.displacement[here, 2] * (x - model.blocks.x[here])).mean())

    left, right = model.jacks.ends
    found = rise(0.5 * (left + right)) - 0.5 * (rise(left) + rise(right))
    assert step.footing.deflection == pytest.approx(found, abs=1e-13)
    assert step.footing.deflection == pytest.approx(step.load_factor * model.jacks.deflection, abs=1.1e-7)


def check_breaks(model: Model, path: list[Increment]) -> None:
    """What is cracked for the first time has broken since the increment before; what has no bond never does."""
    law = model.properties
    bonded = ((law.tensile_strength > 0) | (law.cohesion != law.residual_cohesion))[:, None]
    for before, now in pairwise([None, *path]):
        was = np.zeros_like(bonded) if before is None else before.state == ContactState.CRACKED
        new = (now.state == ContactState.CRACKED) & ~was & bonded
        since = 0.0 if before is None else before.load_factor
        assert ((now.broken_at[new] >= since) & (now.broken_at[new] <= now.load_factor)).all()
        still = (now.state != ContactState.CRACKED) | ~bonded
        assert np.isnan(now.broken_at[still]).all()
        if before is not None and before.broken_at is not None:
            known = np.isfinite(before.broken_at)
            np.testing.assert_array_equal(now.broken_at[known], before.broken_at[known])


@pytest.mark.parametrize(("up", "moment"), [(-3.0, 0.0), (500.0, 2.0), (-20.0, 40.0)])
def test_residual_of_a_run_in_time_counts_turning_by_the_radius_of_gyration(up: float, moment: float) -> None:
    """Unstressed at first, so that nothing but the loads acts."""
    wall = Assembly(thickness=0.11)
    block = wall.add_block(rectangle(0.0, 0.0, 0.3, 0.1))
    wall.load(block, y=up, moment=moment)
    wall.support(wall.add_block(rectangle(1.0, 0.0, 2.0, 0.1)))
    model = wall.build(QUASI_STATIC)
    first = next(iter(dynamic_run(model, QUASI_STATIC, Dynamics(duration=0.01, outputs=1, start="unstressed"))))
    force = up - 2000.0 * 9.81 * 0.3 * 0.1 * 0.11
    gyration = np.sqrt((0.3**2 + 0.1**2) / 12)
    assert first.residuals.unbalanced_force_ratio == pytest.approx(max(abs(force), moment / gyration) / abs(force))


def test_cycles_are_counted_increment_by_increment() -> None:
    """With next to no tolerance each takes its ramp and the least number of looks at the residual."""
    settings = replace(EXPLICIT, tolerance=1e3)
    path = list(solve_path(moved_wall(DRY), settings, 3))
    assert [step.counters.cycles for step in path[1:]] == [settings.ramp_cycles + CHECK_INTERVAL * PASSED_CHECKS] * 3
