"""The registry of variables: complete, with units that mean something, and in step with the rest of the package."""

import re

import numpy as np
import pint
import pytest

from damagepred.archive.schema import CATEGORIES, FLAG_FILL, VARIABLES, Variable, dataset, name_categories
from damagepred.damage import load_table

UNITS = pint.UnitRegistry()


@pytest.mark.parametrize("name", VARIABLES)
def test_every_variable_says_what_it_is(name: str):
    variable = VARIABLES[name]
    assert re.fullmatch(r"[a-z][a-z0-9_]*", name)
    assert len(variable.long_name) > 5
    assert variable.long_name == variable.long_name.strip()
    attributes = variable.attributes()
    if attributes.get("cf_role") == "mesh_topology":
        return  # has no values of its own
    assert bool(variable.flags) != (variable.units is not None), "either a unit or flags"
    assert attributes["long_name"] == variable.long_name
    if variable.flags:
        assert "units" not in attributes
        assert attributes["flag_values"].dtype == np.int8
        assert attributes["flag_values"].tolist() == list(range(len(variable.flags)))
        assert attributes["flag_meanings"].split() == list(variable.flags)
        assert len(set(variable.flags)) == len(variable.flags)
        assert all(re.fullmatch(r"[A-Za-z0-9_\-.+@]+", flag) for flag in variable.flags)  # CF: blank-separated words
        assert int(FLAG_FILL) not in range(len(variable.flags))
    else:
        # UDUNITS writes a power as a number behind the unit
        UNITS.parse_units(
            re.sub(r"(?<=[a-z])-(?=\d)", "**-", attributes["units"]) if attributes["units"] != "1" else ""
        )


def test_flags_mean_what_the_code_means():
    kinds = "bed_joint head_joint dpc footing_interface soil support footing_section control_joint brick_joint"
    for name, words in {
        "contact_kind": kinds,
        "contact_state": "intact cracked slipping",
        "zone_state": "elastic shear tension shear_and_tension yielded",
        "status": "complete collapsed failed missing",
    }.items():
        assert VARIABLES[name].attributes()["flag_meanings"] == words
    for table in ("as2870", "bre251"):
        names = tuple(n.replace(" ", "_") for n in load_table(table).category_names)
        assert names == CATEGORIES[: len(names)]


def test_unregistered_names_are_refused_unless_described():
    with pytest.raises(KeyError, match="joint_colour"):
        dataset({"joint_colour": [1.0]}, {})
    extra = {"joint.cohesion": Variable(("sample",), "Pa", "sampled cohesion")}
    ds = dataset({"sample": [0], "joint.cohesion": [1e5]}, {}, extra=extra)
    assert ds["joint.cohesion"].attrs == {"units": "Pa", "long_name": "sampled cohesion"}


@pytest.mark.parametrize("table", ["as2870", "bre251"])
def test_categories_bear_the_names_of_their_table(table: str):
    ds = dataset({"increment": [0], "damage_category": np.zeros(1, np.int8)}, {})
    content = load_table(table)
    name_categories(ds, content.category_names, content.source)
    attrs = ds["damage_category"].attrs
    assert len(attrs["flag_meanings"].split()) == len(content.category_names) == len(attrs["flag_values"])
    assert attrs["comment"] == content.source
