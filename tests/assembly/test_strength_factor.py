"""The factor on the strengths of a wall's joints: the batch, on top of what varies from joint to joint."""

import pytest

from damagepred import Scene
from damagepred.errors import InputError


def test_a_factor_of_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="strength_factor"):
        Scene.from_dict({"joint": {"strength_factor": 0.0}})
