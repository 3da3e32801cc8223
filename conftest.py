"""Files that examples in docstrings name: a wall, two studies and their results, made once and small."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

WALL = """
[wall]
length = "2.4 m"
height = "0.9 m"
[[opening]]
kind = "window"
x = "0.72 m"
y = "0.3 m"
width = "0.96 m"
height = "0.3 m"
[joint]
tensile_strength = "0.1 MPa"
cohesion = "0.1 MPa"
[movement]
kind = "doming"
central_deflection = "8 mm"
increments = 16
[loads]
roof = "12 kN"
[solver]
blocks = "rigid"
"""

MORE = {
    "mound": {"dpc": {"course": 1}, "movement": {"shape": "mound", "increments": 2}},
    "jacks": {"dpc": {"course": 1}, "movement": {"shape": "jacks", "central_deflection": "0.5 mm", "increments": 2}},
    "zones": {"solver": {"blocks": "deformable"}, "movement": {"central_deflection": "0.5 mm", "increments": 1}},
}
"""Tables of other walls, of 1.44 m x 0.45 m."""

STUDY = """
scene = "wall.toml"
[study]
samples = 24
seed = 1
[variables."joint.tensile_strength"]
distribution = "lognormal"
mean = "0.1 MPa"
cov = 0.3
field = { course_correlation = 0.4 }
[variables."joint.friction"]
distribution = "lognormal"
mean = 0.75
cov = 0.2
[variables."joint.cohesion"]
distribution = "lognormal"
mean = "0.1 MPa"
cov = 0.4
"""


CHOICES = """
study = "house.toml"
target = { category = 2, probability = 0.99, at = "2 mm", first = 16, most = 64 }
[[choice]]
name = "mortar"
[[choice.option]]
name = "as it is"
[[choice.option]]
name = "lighter roof"
cost = 1000
scene.loads.roof = "6 kN"
"""


@contextlib.contextmanager
def shared_by_processes(place: Path) -> Iterator[Path]:
    """Folder that all processes of this run share, one at a time; the place itself where there is one process."""
    run = os.environ.get("PYTEST_XDIST_TESTRUNUID")
    if run is None or os.name != "posix":
        yield place
        return
    import fcntl

    common = place.parents[1] / f"examples-{run}"
    common.mkdir(exist_ok=True)
    with (common / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield common


class Files:
    """Files beside the examples; those that need a solution are made for the first example that names them."""

    def __init__(self, place: Path) -> None:
        self.place, self.made = place, set[str]()
        texts = {"wall": WALL, "house": STUDY, "choices": CHOICES}
        for name, text in (texts | {"strong": STUDY.replace('mean = "0.1 MPa"', 'mean = "0.3 MPa"')}).items():
            (place / f"{name}.toml").write_text(text, encoding="utf-8")
        (place / "houses.csv").write_text("name,loads.roof (kN)\n12 Elm Street,3\n14 Elm Street,\n", encoding="utf-8")

    def make(self, name: str) -> None:
        """Make a file, unless it is there."""
        from damagepred import Scene, Study, solve
        from damagepred.archive.files import write_dataset

        if name in self.made:
            return
        self.made.add(name)
        stem, _, kind = name.partition(".")
        if kind == "dp":
            with shared_by_processes(self.place) as common:
                if not (common / name).exists():
                    Study.from_toml(self.place / f"{stem}.toml").run(common / name)
            if common != self.place:
                shutil.copytree(common / name, self.place / name)
        elif kind == "nc":
            small = {"wall": {"length": 1.44, "height": 0.45}, **MORE.get(stem, {})}
            scene = Scene.from_toml(self.place / "wall.toml") if stem == "wall" else Scene.from_dict(small)
            write_dataset(solve(scene), self.place / name)


@pytest.fixture(scope="session")
def _files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    return Files(tmp_path_factory.mktemp("examples"))


NAMED = re.compile(rf"\"((?:wall|house|strong|choices|{'|'.join(MORE)})\.(?:toml|nc|dp))")


@pytest.fixture(autouse=True)
def _beside_the_files(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    source = "".join(example.source for example in getattr(getattr(request.node, "dtest", None), "examples", ()))
    if names := NAMED.findall(source):
        files = request.getfixturevalue("_files")
        for name in names:
            files.make(name)
        monkeypatch.chdir(files.place)
