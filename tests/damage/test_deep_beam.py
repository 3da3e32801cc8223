"""The deep beam of Burland and Wroth: hand figures, a Timoshenko beam by quadrature, and plates of plane elasticity."""

import numpy as np
import pytest

from damagepred import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.damage import beam_strain, deflection_over_strain
from damagepred.errors import InputError
from damagepred.scene import BlockMaterial, Solver
from tests.verification.zoned_blocks import solved, zones_of

KINDS = ("dishing", "doming")


@pytest.mark.parametrize(
    ("kind", "slenderness", "bending", "diagonal"),
    [  # by hand, E/G = 2.6: sagging x/6 + 0.65/x and 1 + x^2/3.9, hogging x/12 + 1.3/x and 1 + x^2/15.6
        ("dishing", 1.0, 0.816667, 1.256410),
        ("dishing", 4.0, 0.829167, 5.102564),
        ("doming", 1.0, 1.383333, 1.064103),
        ("doming", 4.0, 0.658333, 2.025641),
    ],
)
def test_hand_figures(kind: str, slenderness: float, bending: float, diagonal: float):
    found = deflection_over_strain(slenderness * 2.4, 2.4, kind, 2.6)
    np.testing.assert_allclose(found, (bending, diagonal), rtol=1e-6)


@pytest.mark.parametrize("ratio", [0.5, 2.6, 12.5])
@pytest.mark.parametrize(("kind", "crossover"), [("dishing", 1 / 4), ("doming", 1 / 2)])
def test_bending_takes_over_where_the_closed_form_says(kind: str, crossover: float, ratio: float):
    """The ratio of the strains is 4 (L/H)/(E/G) in sagging, 2 (L/H)/(E/G) in hogging."""
    length = ratio * crossover * 3.0 * np.array([0.5, 1.0, 2.0])
    strain = beam_strain(1e-3, length, 3.0, kind, ratio)
    np.testing.assert_allclose(strain.bending / strain.diagonal, [0.5, 1.0, 2.0], rtol=1e-12)
    np.testing.assert_array_equal(strain.largest, np.maximum(strain.bending, strain.diagonal))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("slenderness", [0.7, 2.5, 8.0])
def test_a_timoshenko_beam_by_quadrature(kind: str, slenderness: float):
    """Deflection by integration of curvature and of the shear strain at the neutral axis, strains at edge and axis.

    With the energy of the parabolic shear stress instead, the strains come out larger, by a quarter at most.
    """
    modulus, shear, height = 9e9, 3.7e9, 2.4
    length, load = slenderness * height, 1e5
    low, high = (-height / 2, height / 2) if kind == "dishing" else (-height, height)  # the half of twice the height
    y = np.linspace(low, high, 20001)
    second = np.trapezoid(y**2, y)
    first = (high**2 - y**2) / 2  # of the part of the section beyond y
    share = load if kind == "dishing" else 2 * load
    x = np.linspace(0.0, length / 2, 20001)
    moment, force = share * x / 2, share / 2
    bent = 2 * np.trapezoid(moment * (x / 2), x) / (modulus * second)
    edge, axis = moment[-1] * high / (modulus * second), force * first.max() / second / shear
    strain = beam_strain((bent + axis * length / 2) / length, length, height, kind, modulus / shear)
    assert strain.bending == pytest.approx(edge, rel=1e-6)
    assert strain.diagonal == pytest.approx(axis / 2, rel=1e-6)
    energy = force * 0.5 * length * np.trapezoid((first / second) ** 2, y) / shear
    stiffer = beam_strain((bent + energy) / length, length, height, kind, modulus / shear)
    assert 0.8 * edge < stiffer.bending < edge


@pytest.mark.quick_cases
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("slenderness", "cells"), [(1.0, 32), (4.0, 16)])
def test_a_plate_of_plane_elasticity(kind: str, slenderness: float, cells: int):
    """Half of a plate with a load in the middle, in zones; in hogging the underside is fixed along x.

    It is loaded as a beam is: by shear at its end, shear and bending in its middle, where at the neutral axis the
    section does not turn.
    """
    height, material = 1.0, BlockMaterial(elastic_modulus=9e9, poisson_ratio=0.3)
    half, force = slenderness * height / 2, 1e5
    bottom, c = (-height / 2, height / 2) if kind == "dishing" else (0.0, height)
    second = height**3 / (12 if kind == "dishing" else 3)
    near = 1e-9

    def shear(x, y):  # parabolic, down in the middle of the plate and up at its end
        return np.where(x < half / 2, -1.0, 1.0) * force * (c**2 - y**2) / (2 * second)

    plate = Assembly(thickness=1.0, gravity=(0.0, 0.0), block=material)
    block = plate.add_block(rectangle(0.0, bottom, half, bottom + height), zone_size=height / cells)
    plate.traction(block, lambda x, y: (x < near) | (x > half - near), y=shear)
    plate.traction(block, lambda x, y: x < near, x=lambda x, y: force * half * y / second)
    plate.hold_points(block, lambda x, y: np.hypot(x, y) < near, x=0.0, y=0.0)
    plate.hold_points(block, lambda x, y: (x < near) & (np.abs(y - height / cells) < near), x=0.0)
    if kind == "doming":
        plate.hold_points(block, lambda x, y: (y < near) & (x > near), x=0.0)
    model, path = solved(plate, Solver())
    mesh, moved = model.mesh, zones_of(path[-1]).displacement
    assert mesh is not None

    end = int(np.hypot(mesh.x - half, mesh.y).argmin())
    deflection_ratio = abs(moved[end, 1]) / (2 * half)
    # the tensile edge: the underside, or its image in hogging, where bending has the same size
    edge = np.flatnonzero((np.abs(mesh.y - (bottom + height)) < near) & (mesh.x > near))
    edge = edge[mesh.x[edge] < half / 2]
    near_half = np.polyfit(mesh.x[edge], np.abs(moved[edge, 0]), 2)  # strain falls linearly from the middle
    bending = abs(near_half[1])
    stress = zones_of(path[-1]).stress
    centre = mesh.y[mesh.zones].mean(axis=1)
    along = mesh.x[mesh.zones].mean(axis=1)
    middle = (np.abs(centre) < 0.6 * height / cells) & (np.abs(along - half / 2) < half / 4)
    diagonal = np.abs(stress[middle, 2]).mean() / material.shear_modulus / 2
    strain = beam_strain(deflection_ratio, 2 * half, height, kind, 2.6)
    assert strain.bending == pytest.approx(bending, rel=0.01)
    assert strain.diagonal == pytest.approx(diagonal, rel=0.01)


def test_ground_strain_makes_a_circle_of_mohr():
    """The largest principal strain of a wall that is stretched, contracts across, and shears."""
    nu, ground = 0.2, np.array([-4e-4, 0.0, 5e-4])
    alone = beam_strain(8e-4, 6.0, 2.4, "doming", 2.4)
    found = beam_strain(8e-4, 6.0, 2.4, "doming", 2.4, ground_strain=ground, poisson_ratio=nu)
    tensor = np.array([[[g, alone.diagonal], [alone.diagonal, -nu * g]] for g in ground])
    np.testing.assert_allclose(found.diagonal, np.linalg.eigvalsh(tensor)[:, -1], rtol=1e-12)
    np.testing.assert_allclose(found.bending, alone.bending + ground, rtol=1e-12)


def test_arrays_broadcast_and_the_sign_of_the_movement_does_not_count():
    strain = beam_strain(np.array([[1e-3], [-1e-3]]), np.array([4.0, 6.0, 10.0]), 2.4, "dishing")
    assert strain.bending.shape == strain.diagonal.shape == (2, 3)
    np.testing.assert_array_equal(strain.largest[0], strain.largest[1])
    assert np.isnan(beam_strain(np.nan, 6.0, 2.4, "dishing").largest)
    plain = beam_strain(1e-3, 6.0, 2.4, "dishing", ground_strain=2e-4)  # E/G = 2.6, so nu = 0.3
    assert plain == beam_strain(1e-3, 6.0, 2.4, "dishing", 2.6, ground_strain=2e-4, poisson_ratio=0.3)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"length": 0.0}, r"length = 0: must be .* greater than 0 m\."),
        ({"height": [2.4, -1.0]}, r"height = -1"),
        ({"modulus_ratio": np.nan}, r"modulus_ratio = nan: must be a finite number greater than 0\."),
        ({"kind": "settle"}, r"kind = 'settle': must be 'dishing' \(sagging\)"),
    ],
)
def test_what_is_not_a_wall_is_refused(wrong: dict, message: str):
    with pytest.raises(InputError, match=message):
        deflection_over_strain(**({"length": 6.0, "height": 2.4, "kind": "dishing", "modulus_ratio": 2.6} | wrong))
