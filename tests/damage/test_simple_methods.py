"""Limiting tensile strain and limits of movement: edge values, scenes, paths and studies."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.damage import beam_strain, load_movement_limits, load_strain_table
from damagepred.errors import InputError
from damagepred.results.simple_assessment import angular_distortion, simple_categories, simple_category, simple_methods
from damagepred.scene import Scene


def test_category_of_the_wall_of_the_test_by_hand():
    """6 m x 2.4 m, nu = 0.19, so E/G = 2.38: sagging by 8 mm, bending 1.3333e-3 / (2.5/6 + 0.595/2.5) = 2.0367e-3."""
    scene = Scene.from_dict({"wall": {"length": 6.0, "height": 2.4}, "movement": {"central_deflection": 8e-3}})
    found = simple_category(scene)
    assert float(found.bending_strain) == pytest.approx(2.0367e-3, rel=1e-4)
    assert int(found.category) == 3
    assert simple_category(scene, 0.0).category == 0
    softer = simple_category(scene, modulus_ratio=12.5)
    assert softer.bending_strain < found.bending_strain
    assert softer.diagonal_strain > found.diagonal_strain
    # with a ground strain of 1.1e-3 the bending strain passes 3e-3
    assert int(simple_category(scene, ground_strain=1.1e-3).category) == 4


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
