"""Kernels are compiled before the first sample: otherwise each worker would compile for minutes."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.thorough

SCRIPT = """
import gc, sys

from numba.core.dispatcher import Dispatcher

from damagepred.kernels.jit import Phase
from damagepred.one_wall.solve import solve
from damagepred.scene import Scene
from damagepred.campaign.warm_up import warm_up


def compiled():
    kernels = [kernel for kernel in gc.get_objects() if isinstance(kernel, (Dispatcher, Phase))]
    phases = {(f.function.__qualname__, id(f)) for f in kernels if isinstance(f, Phase) and f._compiled}
    functions = [function for function in kernels if isinstance(function, Dispatcher)]
    return phases | {(f.py_func.__qualname__, str(s)) for f in functions for s in f.signatures}


scene = Scene.from_toml(sys.argv[1])
warm_up(scene)
before = compiled()
assert len(before) > 20
solve(scene, increments=4)
print(sorted(compiled() - before))
"""


@pytest.mark.parametrize("name", ["bryant_window_dishing", "bryant_doming"])
def test_solving_a_wall_compiles_nothing_more(data_folder: Path, name: str) -> None:
    script = [sys.executable, "-c", SCRIPT, str(data_folder / f"{name}.toml")]
    found = subprocess.run(script, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


CRACKED_FOOTING_ON_A_MOUND = """
wall = { length = 2.4, height = 0.6 }
dpc = { course = 2 }
footing = { width = 0.2, depth = 0.15, concrete = {} }
movement = { kind = "doming", shape = "mound" }
mound = { surface_movement = 0.05 }
soil = { shrinking_stiffness = 2e7 }
"""


def test_a_footing_on_a_mound_compiles_nothing_more(tmp_path: Path) -> None:
    file = tmp_path / "mound.toml"
    file.write_text(CRACKED_FOOTING_ON_A_MOUND)
    found = subprocess.run([sys.executable, "-c", SCRIPT, str(file)], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
