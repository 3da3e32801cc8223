"""Reinforced concrete of the footing: from names to values, and what is said about a wrong name."""

import pytest

from damagepred.errors import InputError
from damagepred.scene.concrete import ReinforcedConcrete
from damagepred.scene.reading import build


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
