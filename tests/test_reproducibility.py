"""Results are the same to the last bit, whatever threads BLAS has and whatever is imported first."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT
from tests.reproducibility_job import lines_with_matrices

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def run(out: Path, *options: str, **variables: str) -> dict[str, Any]:
    environment = {name: value for name, value in os.environ.items() if name not in THREADS} | variables
    subprocess.run([sys.executable, ROOT / "tests/reproducibility_job.py", out, *options], check=True, env=environment)
    return json.loads(out.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return run(tmp_path_factory.mktemp("plain") / "bits.json", "--watch")


@pytest.mark.slow
def test_every_product_and_factorisation_is_made_with_one_thread(plain: dict[str, Any]) -> None:
    assert plain["free"] == []
    # more than half of the lines with products and factorisations
    assert len(plain["held"]) > 0.5 * sum(len(lines) for lines in lines_with_matrices().values())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "variables"),
    [
        (("--first", "numpy,scipy.linalg,numba"), {"OPENBLAS_NUM_THREADS": "4", "OMP_NUM_THREADS": "4"}),
        (("--first", "xarray,matplotlib.pyplot", "--beside"), {}),
    ],
    ids=["four threads, numpy first", "beside other threads, xarray first"],
)
def test_threads_and_imports_change_no_bit(options, variables, plain, tmp_path) -> None:
    found = run(tmp_path / "bits.json", *options, **variables)["digests"]
    assert len(found) > 500
    different = sorted(name for name, digest in plain["digests"].items() if found.get(name) != digest)
    assert different == []
