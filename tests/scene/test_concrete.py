"""Reinforced concrete of the footing: from names to values, and what is said about a wrong name."""

import pytest

from damagepred.errors import InputError
from damagepred.scene import ReinforcedConcrete
from damagepred.scene.reading import build


def test_names_to_values():
    concrete = ReinforcedConcrete(grade="N32", bottom="4-L12TM", top="2-L8TM")
    assert concrete.compressive_strength == 32e6
    assert concrete.concrete_modulus == 30.1e9  # AS 3600
    assert concrete.flexural_strength == pytest.approx(0.6 * 32**0.5 * 1e6)
    assert concrete.bottom_wires == (pytest.approx(4 * 111.2e-6), 11.9e-3)
    assert concrete.top_wires == (pytest.approx(2 * 45.4e-6), 7.6e-3)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"grade": "N26"}, ["grade = 'N26'", "N20, N25, N32, N40, N50", "Did you mean 'N"]),
        ({"bottom": "3-L10TM"}, ["bottom = '3-L10TM'", "L8TM, L11TM, L12TM", "Did you mean '3-L12TM'?"]),
        ({"bottom": "L8TM"}, ["bottom = 'L8TM'", "number of wires", "Did you mean '3-L8TM'?"]),
        ({"top": "0-L8TM"}, ["top = '0-L8TM'", "'none'"]),
        ({"law": "bransen"}, ["law = 'bransen'", "Did you mean 'branson'?"]),
        ({"elastic_modulus": "300 GPa"}, ["steel_modulus", "must exceed"]),
    ],
)
def test_what_is_wrong_is_said(values, words):
    with pytest.raises(InputError) as caught:
        build(ReinforcedConcrete, values, "file")
    for word in words:
        assert word in str(caught.value)
