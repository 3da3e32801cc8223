"""The deep beam of Burland and Wroth: hand figures, a Timoshenko beam by quadrature, and plates of plane elasticity."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.damage import beam_strain, deflection_over_strain, load_movement_limits, load_strain_table
from damagepred.errors import InputError
from damagepred.results.simple_assessment import angular_distortion, simple_categories, simple_category, simple_methods
from damagepred.scene import Scene

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
    """Deflection by integration of curvature and of the shear strain at the neutral axis, strains at edge and axis."""
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


def test_ground_strain_makes_a_circle_of_mohr():
    """The largest principal strain of a wall that is stretched, contracts across, and shears."""
    nu, ground = 0.2, np.array([-4e-4, 0.0, 5e-4])
    alone = beam_strain(8e-4, 6.0, 2.4, "doming", 2.4)
    found = beam_strain(8e-4, 6.0, 2.4, "doming", 2.4, ground_strain=ground, poisson_ratio=nu)
    tensor = np.array([[[g, alone.diagonal], [alone.diagonal, -nu * g]] for g in ground])
    np.testing.assert_allclose(found.diagonal, np.linalg.eigvalsh(tensor)[:, -1], rtol=1e-12)
    np.testing.assert_allclose(found.bending, alone.bending + ground, rtol=1e-12)


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


def test_category_of_the_wall_of_the_test_by_hand():
    """6 m x 2.4 m, nu = 0.19, so E/G = 2.38: sagging by 8 mm, bending 1.3333e-3 / (2.5/6 + 0.595/2.5) = 2.0367e-3."""
    scene = Scene.from_dict({"wall": {"length": 6.0, "height": 2.4}, "movement": {"central_deflection": 8e-3}})
    found = simple_category(scene)
    assert float(found.bending_strain) == pytest.approx(2.0367e-3, rel=1e-4)
    assert int(found.category) == 3
    assert simple_category(scene, 0.0).category == 0
    softer = beam_strain(8e-3 / 6.0, 6.0, 2.4, "dishing", 12.5)
    assert softer.bending < found.bending_strain
    assert softer.diagonal > found.diagonal_strain


def test_a_study_is_judged_wall_by_wall():
    ratio = np.array([[0.0, 5e-4, 1e-3], [0.0, 2e-3, np.nan]])
    ds = xr.Dataset(coords={"deflection_ratio": (("sample", "increment"), ratio)}, attrs={"scene": Scene().to_toml()})
    judged = simple_categories(ds)
    assert judged["simple_category"].dims == ("sample", "increment")
    expected = load_strain_table().by_strain(beam_strain(ratio, 6.0, 2.4, "dishing", 2.38).largest)
    np.testing.assert_array_equal(judged["simple_category"], expected)
    assert judged["simple_category"].values[1, 2] == -1
    assert judged["deflection_ratio"].identical(ds["deflection_ratio"])
    with pytest.raises(InputError, match=r"'wall\.height' differs from wall to wall"):
        simple_categories(ds.assign({"wall.height": ("sample", [2.4, 3.0])}))
    with pytest.raises(InputError, match="no scene"):
        simple_categories(ds.assign_attrs(scene="").drop_attrs())


def test_table_of_a_scene():
    scene = Scene.from_dict({"movement": {"central_deflection": 3e-3, "kind": "doming"}})
    table = damagepred.simple_methods(scene)
    assert (table["exceeded"] == (table["value"] > table["limit"])).all()
    assert not table["about"].str.endswith("sagging").any()
    assert table["about"].str.endswith("hogging").sum() == 1
    found = table.set_index(["method", "about"])["exceeded"]
    assert not found["AS 2870-2011 Table 4.1", "full masonry"]  # 6 m / 2000 = 3 mm: at the limit, not beyond
    assert simple_methods(scene, 5.01e-4).set_index(["method", "about"])["exceeded"][
        "AS 2870-2011 Table 4.1", "full masonry"
    ]
    by = {(limit.author, limit.about): limit for limit in load_movement_limits()}
    values = {"deflection_ratio": 5e-4, "angular_distortion": angular_distortion(scene)}
    for row in table[table["measure"] != "tensile_strain"].itertuples():
        assert row.limit == by[row.method, row.about].value(6.0, 2.4)
        assert row.value == values[row.measure]
    strain = simple_category(scene)
    categories = table[table["measure"] == "tensile_strain"]
    assert (categories["value"] == max(strain.bending_strain, strain.diagonal_strain)).all()
    assert categories["limit"].tolist() == list(load_strain_table().limits)
    assert categories["exceeded"].sum() == int(simple_category(scene).category)


def test_where_the_footing_finds_its_own_form_the_deflection_must_be_given():
    scene = Scene.from_dict({"movement": {"shape": "jacks"}})
    with pytest.raises(InputError, match=r"movement\.shape = 'jacks'.*give deflection_ratio"):
        simple_category(scene)
    assert simple_category(scene, 1e-3).category > 0
    assert angular_distortion(scene, 1e-3) == pytest.approx(4e-3)
    level = Scene.from_dict({})
    assert angular_distortion(replace(level, movement=replace(level.movement, central_deflection=0.0))) == 0.0
