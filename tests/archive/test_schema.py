"""The registry of variables: complete, with units that mean something, and in step with the rest of the package."""

import numpy as np
import pytest

from damagepred.archive.schema import (
    Variable,
    dataset,
    name_categories,
)
from damagepred.damage import load_table

# -- datasets --------------------------------------------------------------------------------------------------------


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
