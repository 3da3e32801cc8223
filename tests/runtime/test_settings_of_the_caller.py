"""Settings of the caller's process neither end nor change a computation, and stay as they are."""

import copy
import os
import pickle
import random
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import special

import damagepred
from damagepred.archive import provenance
from damagepred.runtime import version
from tests.conftest import SMALL_STUDY
from tests.synthetic_studies import synthetic_study

WALL = {"wall": {"length": 0.96, "height": 0.3}, "movement": {"increments": 1}}


@pytest.fixture
def _strict() -> Iterator[None]:
    """NumPy and scipy.special raise on everything, numbers have two digits, xarray joins nothing."""
    with (
        np.errstate(all="raise"),
        np.printoptions(precision=2, legacy="1.13"),
        special.errstate(all="raise"),
        xr.set_options(arithmetic_join="exact", keep_attrs=False),
    ):
        before = (
            np.geterr(),
            np.get_printoptions(),
            special.geterr(),
            random.getstate(),
            np.random.get_state()[1].copy(),  # noqa: NPY002 - the caller's
        )
        yield
        assert np.geterr() == before[0]
        assert np.get_printoptions() == before[1]
        assert special.geterr() == before[2]
        assert random.getstate() == before[3]
        assert (np.random.get_state()[1] == before[4]).all()  # noqa: NPY002


@pytest.mark.worker_processes
@pytest.mark.thorough
@pytest.mark.usefixtures("_strict")
def test_a_study_and_its_curves(tmp_path: Path) -> None:
    summary = damagepred.Study.from_text(SMALL_STUDY).run(tmp_path / "a.dp", samples=2)
    assert (summary.done, summary.failed) == (2, 0)
    study = damagepred.open_study(synthetic_study(tmp_path / "s.dp", 60))
    assert np.isfinite(damagepred.fit_fragility(study, bootstrap=20)["median"].values[0])
    assert 0 < damagepred.exceedance(study, 1, 3e-3).estimate.value < 1
    assert damagepred.frame(study).shape[0] == 60


@pytest.mark.usefixtures("_strict")
def test_a_wall_in_another_thread() -> None:
    found: list[xr.Dataset] = []

    def work() -> None:
        with np.errstate(all="raise"):
            found.append(damagepred.solve(damagepred.Scene.from_dict(WALL)))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    here = damagepred.solve(damagepred.Scene.from_dict(WALL))
    assert (found[0].contact_opening.values == here.contact_opening.values).all()


def test_a_dataset_travels_after_the_accessor_was_used() -> None:
    ds = damagepred.solve(damagepred.Scene.from_dict(WALL))
    width = ds.damagepred.crack_width_max.values
    for other in (pickle.loads(pickle.dumps(ds)), copy.copy(ds), copy.deepcopy(ds), ds.copy(deep=True)):
        assert (other.damagepred.crack_width_max.values == width).all()
    accessor = pickle.loads(pickle.dumps(ds.damagepred))
    assert (accessor.crack_width_max.values == width).all()
    with pytest.raises(AttributeError, match="Did you mean 'crack_width_max'"):
        _ = ds.damagepred.crack_width_maxx


@pytest.mark.quick_cases
@pytest.mark.parametrize("backend", ["module://matplotlib_inline.no_such_backend", "nonsense", "svg"])
def test_pictures_need_no_backend(backend: str) -> None:
    """A notebook's MPLBACKEND, inherited by a command whose environment has no such backend."""
    program = (
        "from damagepred.plotting.sheet import new_figure; import io, matplotlib, os, sys\n"
        "new_figure().savefig(io.BytesIO()); print(os.environ['MPLBACKEND'])\n"
        "print(matplotlib.get_backend(auto_select=False), 'matplotlib.pyplot' in sys.modules)"
    )
    environment = {**os.environ, "MPLBACKEND": backend}
    found = subprocess.run(
        [sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, env=environment, check=False
    )
    assert found.stdout.split() == [backend, "None" if backend == "nonsense" else backend, "False"], found.stderr


def test_a_constant_of_the_solvers_changes_the_recorded_hash(tmp_path, monkeypatch) -> None:
    for folder in ("kernels", "solvers"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "newton.py").write_text("MINIMUM_STEP = 0.1\n", encoding="utf-8")
    monkeypatch.setattr(version, "PACKAGE", tmp_path)
    provenance.environment.cache_clear()
    recorded = provenance.environment()["kernel_hash"]
    (tmp_path / "solvers" / "newton.py").write_text("MINIMUM_STEP = 0.2\n", encoding="utf-8")
    provenance.environment.cache_clear()
    assert provenance.environment()["kernel_hash"] != recorded
    provenance.environment.cache_clear()
