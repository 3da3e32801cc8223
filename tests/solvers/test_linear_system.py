"""Multifrontal solution with Woodbury corrections, compared with a direct solution."""

from collections import deque
from collections.abc import Iterator

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Assembly, Model, wall_model
from damagepred.assembly.assembly import rectangle
from damagepred.kernels.jit import kernel
from damagepred.kernels.linear import dense
from damagepred.kernels.linear.condensation import recover, subtract_boundary_forces
from damagepred.scene import Dpc, Opening, Scene, Solver, Wall
from damagepred.solvers.quasi_static import elimination_tree
from damagepred.solvers.quasi_static.linear_system import REGULARISATION, MultifrontalSystem
from damagepred.solvers.symmetry import reduce_by_symmetry
from damagepred.solvers.system.discrete_system import DiscreteSystem

QUASI_STATIC = Solver(blocks="rigid")
WELL = 1e6
"""Condition number of the scaled matrix up to which the error must be below 1e-8."""


def kinematics(model: Model) -> FloatArray:
    """Return the kinematic matrices (m, 3, 6): opening and shear in the middle, and rotation, of each interface."""
    face = model.interfaces
    n_x, n_y, zero, one = face.normal_x, face.normal_y, np.zeros(len(face.x)), np.ones(len(face.x))
    rows = (
        (-n_x, -n_y, -face.arm_normal_a, n_x, n_y, face.arm_normal_b),
        (-n_y, n_x, -face.arm_shear_a, n_y, -n_x, face.arm_shear_b),
        (zero, zero, -one, zero, zero, one),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=1)


def assembled(model: Model, stiffness: FloatArray) -> sparse.csc_array:
    """Return the stiffness of all degrees of freedom, with the ground's, from a stiffness (m, 9) of the interfaces."""
    face, rows = model.interfaces, kinematics(model)
    blocks = np.einsum("mji,mjk,mkl->mil", rows, stiffness.reshape(-1, 3, 3), rows)
    dof = np.concatenate((3 * face.block_a[:, None] + np.arange(3), 3 * face.block_b[:, None] + np.arange(3)), axis=1)
    down, along = np.broadcast_to(dof[:, :, None], blocks.shape), np.broadcast_to(dof[:, None], blocks.shape)
    size = 3 * (model.n_blocks + 1)
    return sparse.coo_array((blocks.ravel(), (down.ravel(), along.ravel())), shape=(size, size)).tocsc()


def of_contacts(model: Model, slopes: FloatArray) -> FloatArray:
    """Return the stiffness (m, 9) of interfaces whose contacts have the slopes nn, ns, sn, ss: (m, q, 4)."""
    face = model.interfaces
    nn, ns, sn, ss = np.moveaxis(slopes * face.contact_area[..., None], -1, 0)
    at = face.contact_offset
    return np.stack([v.sum(axis=1) for v in (nn, ns, nn * at, sn, ss, sn * at, nn * at, ns * at, nn * at**2)], axis=-1)


def elastic_slopes(model: Model) -> FloatArray:
    slopes = np.zeros((*model.interfaces.contact_area.shape, 4))
    slopes[..., 0] = model.properties.normal_stiffness[:, None]
    slopes[..., 3] = model.properties.shear_stiffness[:, None]
    return slopes


def changed(model: Model, stiffness: FloatArray, which: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return a stiffness in which joints have opened, slide, dilate or soften, contact by contact."""
    slopes = elastic_slopes(model)
    k_n, k_s = slopes[..., 0].copy(), slopes[..., 3].copy()
    kind = rng.integers(0, 5, size=k_n.shape)
    sign, friction, psi = rng.choice([-1.0, 1.0], k_n.shape), rng.uniform(0.3, 1.0), rng.uniform(0.0, 0.3)
    slopes[kind == 0] = 0.0  # open
    slides, dilates, softens = kind == 1, kind == 2, kind == 3
    slopes[slides, 2], slopes[slides, 3] = -(sign * friction * k_n)[slides], 0.0
    give = k_s + k_n * friction * psi
    slopes[dilates] = np.stack(
        (
            k_n * k_s / give,
            -sign * k_n * psi * k_s / give,
            -sign * k_n * k_s * friction / give,
            k_s * k_n * friction * psi / give,
        ),
        axis=-1,
    )[dilates]
    slopes[softens, 0] *= 0.05
    new = stiffness.copy()
    new[which] = of_contacts(model, slopes)[which]
    return new


class Reference:
    """Direct solution: free degrees of freedom, with the diagonal regularisation."""

    def __init__(self, equations: MultifrontalSystem, stiffness: FloatArray, regularised: bool = True) -> None:
        model = equations.model
        self.free = DiscreteSystem.of(model).free_dofs
        matrix = assembled(model, stiffness)
        if regularised:
            hold = REGULARISATION * assembled(model, equations.elastic).diagonal()
            matrix = matrix + sparse.diags_array(hold)
        self.matrix = matrix[self.free][:, self.free].tocsc()

    def condition(self) -> float:
        dense = self.matrix.toarray()
        scale = 1.0 / np.sqrt(np.abs(dense).max(axis=1))
        return float(np.linalg.cond(dense * scale[:, None] * scale))

    def solve(self, force: FloatArray) -> FloatArray:
        answer = np.zeros(len(force))
        answer[self.free] = splu(self.matrix).solve(force[self.free])
        return answer


def random_wall(rng: np.random.Generator) -> Model:
    opening = ()
    if rng.random() < 0.5:
        opening = (Opening(x=float(rng.choice([0.3, 0.48, 0.6])), y=0.2, width=0.48, height=0.2),)
    return wall_model(
        Scene(
            wall=Wall(
                length=float(rng.choice([1.44, 1.5, 1.8])),
                height=0.6,
                block_length=0.3,
                block_height=float(rng.choice([0.1, 0.2])),
                bond=str(rng.choice(["running", "stack"])),
            ),
            opening=opening,
            dpc=Dpc(course=1) if rng.random() < 0.5 else None,
            solver=QUASI_STATIC,
        )
    )


def grid(courses: int, bricks: int, shift: float = 0.0) -> Assembly:
    """Courses of whole bricks, every other one shifted."""
    wall = Assembly()
    for j in range(courses):
        for left in 0.2 * np.arange(bricks) + shift * (j % 2):
            wall.add_block(rectangle(left, 0.1 * j, left + 0.2, 0.1 * (j + 1)), course=j)
    return wall


def held_at_one_side() -> Model:
    """A cantilever of blocks, two high, whose first column has a prescribed settlement."""
    wall = Assembly()
    for i in range(6):
        for j in range(2):
            block = wall.add_block(rectangle(0.2 * i, 0.1 * j, 0.2 * (i + 1), 0.1 * (j + 1)), course=j)
            if i == 0:
                wall.support(block)
                wall.move(block, y=-1e-3)
    return wall.build(QUASI_STATIC)


def on_supports() -> Model:
    """A wall over two supports, one of which only guides it."""
    wall = grid(3, 4, 0.1)
    wall.support(0)
    wall.support(3, x=False)
    return wall.build(QUASI_STATIC)


def with_a_loose_block() -> Model:
    """A wall on the ground, and a block beside it without contacts."""
    wall = grid(3, 3)
    wall.add_block(rectangle(2.0, 0.0, 2.2, 0.1))
    wall.rest_on_ground([0, 1, 2])
    return wall.build(QUASI_STATIC)


WALLS = {
    "wall": lambda: random_wall(np.random.default_rng(3)),
    "another": lambda: random_wall(np.random.default_rng(8)),
    "held at one side": held_at_one_side,
    "on supports": on_supports,
    "half": lambda: reduce_by_symmetry(wall_model(Scene(wall=Wall(length=2.4, height=0.6), solver=QUASI_STATIC))),
}


def equations_of(model: Model, dissected_size: int = elimination_tree.DISSECTED_SIZE) -> MultifrontalSystem:
    elastic, system = of_contacts(model, elastic_slopes(model)), DiscreteSystem.of(model)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(elimination_tree, "DISSECTED_SIZE", dissected_size)
        patch.setattr(elimination_tree, "_recent", deque(maxlen=2))
        return MultifrontalSystem(system, elastic)


def random_force(model: Model, rng: np.random.Generator) -> FloatArray:
    return rng.normal(size=3 * (model.n_blocks + 1)) * 1e3


def assert_same(one: FloatArray, other: FloatArray, share: float = 1e-8) -> None:
    np.testing.assert_allclose(one, other, rtol=0, atol=share * float(np.abs(other).max()))


def assert_balanced(equations, stiffness, displacement, load) -> None:
    """Condensed fronts are in balance, without regularisation."""
    force = assembled(equations.model, stiffness) @ displacement - load
    condensed = np.setdiff1d(DiscreteSystem.of(equations.model).free_dofs, equations.active.dofs)
    largest = np.abs(assembled(equations.model, stiffness)).sum(axis=1).max() * np.abs(displacement).max()
    assert np.abs(force[condensed]).max(initial=0.0) < 1e-13 * largest


@pytest.mark.parametrize("name", WALLS)
def test_elastic(name: str) -> None:
    model = WALLS[name]()
    equations, force = equations_of(model), random_force(model, np.random.default_rng(1))
    found = equations.solve(force)
    assert_same(found, Reference(equations, equations.elastic).solve(force))
    assert (found[DiscreteSystem.of(model).constrained_dofs] == 0.0).all()
    # the regularisation of detached blocks has hardly any effect
    assert_same(found, Reference(equations, equations.elastic, regularised=False).solve(force), 1e-4)
    assert (equations.factorisations, equations.corrections) == (1, 0)


def test_a_block_without_contacts_does_not_affect_the_others() -> None:
    model = with_a_loose_block()
    equations, force = equations_of(model), random_force(model, np.random.default_rng(1))
    force[-6:-3] = 0.0
    found = equations.solve(force)
    assert (found[-6:] == 0.0).all()
    wall = np.arange(3 * (model.n_blocks - 1))
    expected = splu(assembled(model, equations.elastic)[wall][:, wall].tocsc()).solve(force[wall])
    assert_same(found[wall], expected, 1e-4)


def few(model: Model, rng: np.random.Generator, most: int = 6) -> IntArray:
    return rng.choice(len(model.interfaces.x), size=int(rng.integers(1, most + 1)), replace=False)


@pytest.mark.parametrize("name", WALLS)
def test_a_few_changed_joints_are_corrected_for_without_factorising(name: str) -> None:
    rng, model = np.random.default_rng(5), WALLS[name]()
    held = 0
    for _ in range(12):
        equations, force = equations_of(model), random_force(model, rng)
        equations.solve(force)
        equations.factorisation_cost[:] = np.inf  # cheaper in the smallest walls
        stiffness = changed(model, equations.elastic, few(model, rng), rng)
        reference = Reference(equations, stiffness)
        equations.update(stiffness)
        found = equations.solve(force)
        if reference.condition() > WELL:
            continue
        held += 1
        assert_same(found, reference.solve(force))
        assert (equations.factorisations, equations.corrections) == (1, 1)
    assert held > 5, "hardly anything was checked"


def updates(model: Model, elastic: FloatArray, rng: np.random.Generator, count: int) -> Iterator[FloatArray]:
    """Yield successive stiffnesses: few joints change, many do, some change back, or none."""
    stiffness = elastic
    for _ in range(count):
        what = rng.integers(0, 5)
        if what == 0:
            m = len(elastic)
            which = rng.choice(m, size=min(int(rng.integers(24, 48)), m), replace=False)
            stiffness = stiffness.copy()
            stiffness[which] = elastic[which] * rng.uniform(0.1, 1.0, size=(len(which), 1))
        elif what == 1:  # as before
            back = rng.random(len(elastic)) < 0.5
            stiffness = np.where(back[:, None], elastic, stiffness)
        elif what < 4:
            stiffness = changed(model, stiffness, few(model, rng), rng)
        yield stiffness


def follow_updates(model: Model, rng: np.random.Generator, count: int) -> tuple[MultifrontalSystem, int]:
    equations, held = equations_of(model), 0
    for stiffness in updates(model, equations.elastic, rng, count):
        force = random_force(model, rng)
        equations.update(stiffness)
        found = equations.solve(force)
        assert np.isfinite(found).all()
        reference = Reference(equations, stiffness)
        if reference.condition() < WELL:
            assert_same(found, reference.solve(force))
            held += 1
    return equations, held


@pytest.mark.parametrize("name", WALLS)
def test_one_change_after_the_other(name: str) -> None:
    equations, held = follow_updates(WALLS[name](), np.random.default_rng(11), 25)
    assert held > 5, "hardly anything was checked"
    assert equations.corrections > 3
    assert equations.factorisations < 20


def test_the_last_stiffness_counts_after_any_sequence() -> None:
    """``update`` without ``solve``, and the same stiffness twice."""
    rng, model = np.random.default_rng(12), WALLS["wall"]()
    equations, force = equations_of(model), random_force(model, rng)
    first = equations.solve(force)
    for _ in range(3):
        equations.update(changed(model, equations.elastic, few(model, rng, 40), rng))
    equations.update(equations.elastic)
    np.testing.assert_array_equal(equations.solve(force), first)
    assert equations.factorisations == 1


def test_a_near_mechanism_is_solved_accurately() -> None:
    """A correction that would lose precision is rejected, and the wall is factorised."""
    model = held_at_one_side()
    equations, rng = equations_of(model), np.random.default_rng(2)
    force = random_force(model, rng)
    equations.solve(force)
    face = model.interfaces
    column = np.round(model.blocks.x / 0.2 - 0.5).astype(int)
    cut = np.flatnonzero(np.minimum(column[face.block_a % 12], column[face.block_b % 12]) == 2)
    cut = cut[np.abs(face.normal_x[cut]) > 0.5]
    for share in (1e-3, 1e-6, 1e-9, 0.0):
        stiffness = equations.elastic.copy()
        stiffness[cut] *= share
        equations.update(stiffness)
        reference = Reference(equations, stiffness)
        found = equations.solve(force)
        # the error is at least rounding times the condition number
        assert_same(found, reference.solve(force), max(1e-8, 1e-14 * reference.condition()))


def load_of(model: Model) -> FloatArray:
    return np.append(model.supports.load, np.zeros(3))


def few_fronts(equations: MultifrontalSystem, rng: np.random.Generator) -> BoolArray:
    """Return some fronts, not all of which are the root's ancestors."""
    fronts = rng.random(equations.tree.count) < rng.choice([0.0, 0.1, 0.4])
    fronts[0] = True
    fronts[-1] = False
    return fronts


@pytest.mark.quick_cases
@pytest.mark.parametrize("name", ["wall", "another", "held at one side", "half"])
def test_condensed_fronts_are_equivalent_to_active_ones(name: str) -> None:
    rng, model = np.random.default_rng(21), WALLS[name]()
    equations, load = equations_of(model, dissected_size=12), load_of(model)
    corrections = 0
    for _ in range(8):
        superelement = equations.condense(few_fronts(equations, rng), load, 0.0 * load)
        inside = equations.active.interfaces
        for turn in range(4):
            which = rng.choice(inside, size=min(3, len(inside)), replace=False) if turn else inside[:0]
            stiffness = changed(model, equations.elastic, which, rng)
            reference = Reference(equations, stiffness)
            equations.update(stiffness)
            # under a share of the dead load; that of the condensed fronts acts on the boundary
            share, force = 0.7, np.zeros(len(load))
            force[equations.active.dofs] = share * load[equations.active.dofs]
            force[superelement.boundary_dofs] += superelement.load(share, 0.0)
            found = equations.solve(force)
            out = np.setdiff1d(np.arange(len(load)), equations.active.dofs)
            assert (found[out] == 0.0).all()
            if reference.condition() > WELL:
                continue
            active = equations.active.dofs
            assert_same(found[active], reference.solve(force)[active])
            recover(superelement.structure, found, share, 0.0)
            assert_balanced(equations, stiffness, found, share * load)
        corrections += equations.corrections
    assert corrections > 0


@pytest.mark.parametrize("name", ["wall", "half"])
def test_the_force_at_the_boundary_is_that_of_the_condensed_fronts(name: str) -> None:
    rng, model = np.random.default_rng(22), WALLS[name]()
    equations, load = equations_of(model, dissected_size=12), load_of(model)
    for _ in range(4):
        superelement = equations.condense(few_fronts(equations, rng), load, 0.0 * load)
        moved = np.zeros(len(load))
        moved[equations.active.dofs] = rng.normal(size=len(equations.active.dofs)) * 1e-5
        share = 0.4
        force = np.zeros(len(load))
        force[superelement.boundary_dofs] = superelement.load(share, 0.0)
        subtract_boundary_forces(superelement.structure, moved, force)
        recover(superelement.structure, moved, share, 0.0)
        # the condensed fronts are in balance, and act on the boundary through inactive joints
        beyond = equations.elastic.copy()
        beyond[equations.active.interfaces] = 0.0
        pull = share * load - assembled(model, beyond) @ moved
        free = DiscreteSystem.of(model).free_dofs
        out = np.setdiff1d(free, equations.active.dofs)
        scale, boundary = float(np.abs(force).max()), superelement.boundary_dofs
        assert np.abs(pull[out]).max() < 1e-8 * scale
        assert_same(force[boundary], pull[boundary] - share * load[boundary])
        assert np.count_nonzero(force) <= len(boundary)
        energy = 0.5 * float(moved @ assembled(model, beyond) @ moved)
        assert superelement.elastic_energy(moved, share, 0.0) == pytest.approx(energy, rel=1e-9)


def test_uncondensing_and_condensing_again() -> None:
    rng, model = np.random.default_rng(23), WALLS["wall"]()
    equations, load = equations_of(model, dissected_size=12), load_of(model)
    stiffness = equations.elastic.copy()
    for turn in range(12):
        fronts = few_fronts(equations, rng) | (turn % 6 == 5)
        if turn % 3:
            fronts |= equations.active.fronts
        held = equations.condense(fronts, load, 0.0 * load)
        assert (held is not None) is not bool(fronts.all())
        for _ in range(3):
            some = rng.choice(equations.active.interfaces, size=min(8, len(equations.active.interfaces)), replace=False)
            stiffness[some] = changed(model, equations.elastic, some, rng)[some]
            wanted = equations.elastic.copy()
            wanted[equations.active.interfaces] = stiffness[equations.active.interfaces]
            equations.update(wanted)
            reference = Reference(equations, wanted)
            force = np.zeros(len(load))
            force[equations.active.dofs] = rng.normal(size=len(equations.active.dofs))
            found = equations.solve(force)
            if reference.condition() < WELL:
                active = equations.active.dofs
                assert_same(found[active], reference.solve(force)[active])
                if held is not None:
                    recover(held.structure, found, 0.0, 0.0)
                assert_balanced(equations, wanted, found, force)


def test_fronts_without_support_from_active_ones_are_not_condensed() -> None:
    model = with_a_loose_block()
    equations = equations_of(model, dissected_size=3)
    root = np.zeros(equations.tree.count, dtype=np.bool_)
    root[0] = True
    assert not equations.condense(root, load_of(model), 0.0 * load_of(model))
    assert equations.active.fronts.all()


INVERT = kernel(dense.invert.function)


def invert(matrix: np.ndarray, symmetric: bool, inverse: np.ndarray) -> float:
    """Invert as the solver does: column by column in flat arrays, a corner of the front."""
    size = len(matrix)
    front, flat = np.pad(matrix, (0, 3), constant_values=np.nan), np.empty(matrix.size)
    workspace = dense.dense_workspace(size)
    ratio = INVERT(workspace, size, len(front), front.T.ravel(), symmetric, flat)
    inverse[:] = flat.reshape(size, size).T
    return float(ratio)


def made(size: int, kind: str) -> np.ndarray:
    random = np.random.default_rng(size)
    matrix = random.normal(size=(size, size))
    if kind == "skew":
        return matrix + size * np.eye(size)
    values = random.uniform(1.0, 100.0, size)
    if kind == "not positive":
        values[::3] *= -1.0
    turned, _ = np.linalg.qr(matrix)
    whole = (turned * values) @ turned.T
    return 0.5 * (whole + whole.T)


@pytest.mark.quick_cases
@pytest.mark.parametrize("kind", ["positive", "not positive", "skew"])
@pytest.mark.parametrize("size", [1, 3, 31, 33, 64, 97, 200])
def test_inverse(size: int, kind: str) -> None:
    matrix = made(size, kind)
    inverse = np.empty_like(matrix)
    smallest = invert(matrix.copy(), kind != "skew", inverse)
    np.testing.assert_allclose(matrix @ inverse, np.eye(size), atol=1e-9)
    assert 0.0 < smallest <= 1.0
    if kind == "positive":
        assert np.array_equal(inverse, inverse.T)


@pytest.mark.parametrize("corner", [0.0, 1e-14])
def test_blocks_without_inverse_of_a_matrix_that_has_one(corner: float) -> None:
    size = dense.INVERSION_PANEL
    unit = np.eye(size)
    matrix = np.block([[corner * unit, unit], [2.0 * unit, made(size, "skew")]])
    inverse = np.empty_like(matrix)
    assert 0.01 < invert(matrix, False, inverse) < 1.0
    np.testing.assert_allclose(matrix @ inverse, np.eye(2 * size), atol=1e-13)


def test_rounding_in_the_other_half_does_not_count() -> None:
    matrix = made(50, "positive")
    inverse, rounded = np.empty_like(matrix), matrix.copy()
    rounded[np.triu_indices(50, 1)] *= 1.0 + 1e-14
    invert(rounded, True, inverse)
    np.testing.assert_allclose(matrix @ inverse, np.eye(50), atol=1e-11)


@pytest.mark.parametrize("symmetric", [True, False])
def test_a_singular_matrix_is_reported(symmetric: bool) -> None:
    inverse = np.empty((3, 3))
    assert invert(np.diag([1.0, 0.0, 2.0]), symmetric, inverse) == 0.0
    assert np.isnan(inverse).all()
