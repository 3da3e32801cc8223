"""Head joints of their own (``[head_joint]``)."""

from __future__ import annotations

from typing import Any

import pytest

from damagepred import InputError, Scene


def scene(**tables: Any) -> Scene:
    wall = {"length": 1.2, "height": 0.45}
    return Scene.from_dict({"wall": wall, "movement": {"central_deflection": 1e-3}, **tables})


def test_what_makes_no_joint_is_refused() -> None:
    with pytest.raises(InputError, match="dilation"):
        scene(head_joint={"friction": 0.1, "dilation": 0.2})
