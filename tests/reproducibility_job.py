"""A small job of every kind whose results are written bit by bit, as digests: a program that tests run several times.

    python tests/reproducibility_job.py OUT.json [--first numpy,scipy.linalg] [--beside] [--watch]

``--first`` imports modules before the package; ``--beside`` does the job in a second thread while the first one has
set four BLAS threads and multiplies matrices; ``--watch`` also notes every line of the package that multiplies or
factorises matrices, and whether BLAS had one thread there.
"""

import argparse
import ast
import hashlib
import importlib
import json
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

WALL = {
    "wall": {"length": 2.4, "height": 0.9},
    "dpc": {"course": 2},
    "joint": {"tensile_strength": "0.1 MPa", "cohesion": "0.1 MPa"},
    "movement": {"kind": "doming", "central_deflection": "6 mm", "increments": 4},
    "loads": {"roof": "3 kN"},
    "solver": {"symmetric_half": False},
}
FOOTING = {"footing": {"width": 0.3, "depth": 0.3, "elastic_modulus": "7 GPa"}}
SCENES = {
    "rigid": WALL,
    "deformable": WALL | {"solver": {"blocks": "deformable"}},
    "elastic": WALL | {"solver": {"blocks": "elastic"}},
    "jacks": WALL | FOOTING | {"movement": {"shape": "jacks", "central_deflection": "4 mm", "increments": 2}},
    "mound": WALL
    | FOOTING
    | {"movement": {"shape": "mound", "increments": 2}, "mound": {"surface_movement": "20 mm"}, "soil": {}},
    "explicit": WALL
    | FOOTING
    | {
        "wall": {"length": 1.44, "height": 0.45},
        "movement": {"shape": "jacks", "central_deflection": "1 mm", "increments": 1},
        "solver": {"method": "explicit"},
    },
    "dynamic": WALL
    | {"wall": {"length": 1.44, "height": 0.45}, "dynamics": {"duration": 0.02, "outputs": 2}, "dpc": {"course": 1}},
}


class Digests:
    def __init__(self) -> None:
        self.found: dict[str, str] = {}

    def note(self, name, ds) -> None:
        """Add each variable of a dataset but the time that it took, and where."""
        import numpy as np

        for variable, values in ds.variables.items():
            if variable not in ("run_time", "environment"):  # a commit may come in between
                array = np.ascontiguousarray(values.values)
                content = array.tobytes() if array.dtype != object else repr(array.tolist()).encode()
                self.found[f"{name}: {variable}"] = hashlib.sha256(content).hexdigest()[:16]


def job() -> dict[str, str]:
    """Return the digests of the job's results."""
    import numpy as np
    from scipy import stats

    import damagepred
    from damagepred.runtime.one_thread import one_blas_thread
    from damagepred.uq.correlation import cholesky, independent_normals, lower_factor

    found = Digests()
    for name, scene in SCENES.items():
        wall = damagepred.solve(damagepred.Scene.from_dict(scene))
        found.note(name, wall)
        if name == "deformable":
            found.note("cracks", damagepred.cracks(wall))
    with TemporaryDirectory() as folder:
        _study(Path(folder), found)
        _curves(Path(folder), found)
    with one_blas_thread():
        correlation = np.array([[1.0, 0.5, 1.0], [0.5, 1.0, 0.5], [1.0, 0.5, 1.0]])  # the third follows from the first
        factor = lower_factor(correlation)
        normal = independent_normals(np.array([[0.3, -0.2]]) @ factor[:, :2].T, factor)
        independent_normals(normal, factor[:2, :2])
        try:
            pairs = {frozenset("ab"): 0.9, frozenset("ac"): 0.9, frozenset("bc"): -0.9}
            cholesky("abc", dict.fromkeys("abc", stats.norm(1.0, 0.1)), pairs)
        except damagepred.InputError as error:
            found.found["contradiction"] = str(error)
    found.found["singular correlation"] = repr((factor.tolist(), normal.tolist()))
    found.found["subset"] = repr(damagepred.subset_simulation(lambda z, _: 3.0 - z.sum(axis=1), 400, samples=100))
    return found.found


def _study(folder: Path, found: Digests) -> None:
    """Sample, solve, archive, replay and look back, with fields by the distance of joints."""
    import tomllib

    import damagepred
    from damagepred.archive.files import read_dataset
    from damagepred.campaign.replay import replay
    from damagepred.campaign.settings import StudySettings
    from damagepred.uq.observations import CrackObservation, Observations
    from tests.conftest import SMALL_STUDY

    tables = tomllib.loads(SMALL_STUDY)
    for place in ("joint.tensile_strength", "joint.cohesion"):
        tables["variables"][place]["field"] = {"correlation_length": 0.5, "nugget": 0.1}
    tables["scene"]["wall"] = WALL["wall"]
    tables["study"]["samples"] = 4
    study, place = damagepred.Study(StudySettings.from_dict(tables)), folder / "study.dp"
    study.run(place, samples=2, workers=1)
    with ThreadPoolExecutor(2) as threads:
        study.run(place, samples=4, executor=threads)
    found.note("design", read_dataset(place / "design.nc"))
    found.note("study", damagepred.open_study(place))
    for sample in (0, 3):
        wall, comparison = replay(place, sample)
        found.note(f"sample {sample}", wall)
        assert comparison.startswith("bit for bit"), comparison
    seen = Observations(crack=(CrackObservation(x=1.2, y=0.2, within=0.5, width=1e-3),))
    found.note("back-analysis", damagepred.infer(place, seen))
    found.note("function", study.function()(study.function().from_unit([[0.3, 0.6]])))


def _curves(folder: Path, found: Digests) -> None:
    import re

    import damagepred
    from damagepred.analyses.variance_shares import study_sensitivity
    from damagepred.archive.provenance import package_commit
    from damagepred.report.writing import write_report
    from damagepred.uq.exceedance import exceedance
    from damagepred.uq.fragility import fit_surface
    from tests.synthetic_studies import synthetic_study

    place = synthetic_study(folder / "many.dp", walls=2000)
    ds = damagepred.open_study(place)
    for model in ("separate", "common"):
        found.note(model, damagepred.fit_fragility(ds, model=model, bootstrap=100))
    found.note("surface", fit_surface(ds, 1, "joint.friction", bootstrap=20))
    found.note("sensitivity", study_sensitivity(ds, category=1, resamples=50))
    found.note("judged again", damagepred.judge_again(ds, table="bre251"))
    found.found["exceedance"] = repr(exceedance(ds, 1, 4e-3))
    page = write_report(place, folder / "page.html", replay=False, bootstrap=100).read_text(encoding="utf-8")
    text = re.sub(r"<svg.*?</svg>|<[^>]*>", " ", page, flags=re.S)
    text = text.replace(package_commit(), "").replace(str(folder), "")
    found.found["report"] = hashlib.sha256(re.sub(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d\S*", "", text).encode()).hexdigest()[
        :16
    ]


def lines_with_matrices() -> dict[str, set[int]]:
    """Return the lines of each file of the package that multiply or factorise matrices, but for the kernels' own."""
    found = {}
    for file in sorted((ROOT / "damagepred").rglob("*.py")):
        nodes = list(ast.walk(ast.parse(file.read_text("utf-8"))))
        named = {
            name.asname or name.name
            for node in nodes
            if isinstance(node, ast.ImportFrom) and "linalg" in (node.module or "").split(".")
            for name in node.names
        }
        lines = {node.lineno for node in nodes if _on_matrices(node, named)}
        if lines and "kernels" not in file.parts:
            found[str(file)] = lines
    return found


def _on_matrices(node: ast.AST, named: set[str]) -> bool:
    if isinstance(node, ast.BinOp | ast.AugAssign):
        return isinstance(node.op, ast.MatMult)
    if not isinstance(node, ast.Call):
        return False
    *modules, function = ast.unparse(node.func).split(".")
    products = ("dot", "einsum", "inner", "matmul", "tensordot", "vdot")
    return bool({"linalg", "lapack", "blas", *named} & {*modules, function}) or bool(modules and function in products)


class Watch:
    """Notes in which state BLAS is at each such line that is reached."""

    def __init__(self) -> None:
        self.lines, self.free, self.held = lines_with_matrices(), set(), set()

    def __call__(self, frame, event, argument):
        lines = self.lines.get(frame.f_code.co_filename)
        return self.line if lines and event == "call" else None

    def line(self, frame, event, argument):
        file = frame.f_code.co_filename
        if event == "line" and frame.f_lineno in self.lines[file]:
            from damagepred.runtime.one_thread import has_one_blas_thread

            place = f"{Path(file).relative_to(ROOT)}:{frame.f_lineno}"
            (self.held if has_one_blas_thread() else self.free).add(place)
        return self.line


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("--first", default="")
    parser.add_argument("--beside", action="store_true")
    parser.add_argument("--watch", action="store_true")
    options = parser.parse_args()
    for module in filter(None, options.first.split(",")):
        importlib.import_module(module)
    watch = Watch() if options.watch else None
    if watch is not None:
        threading.settrace(watch)
        sys.settrace(watch)
    found = beside_other_work() if options.beside else job()
    sys.settrace(None)
    lines = {} if watch is None else {"free": sorted(watch.free), "held": sorted(watch.held)}
    options.out.write_text(json.dumps({"digests": found, **lines}), encoding="utf-8")


def beside_other_work() -> dict[str, str]:
    """Do the job in another thread than the one that has set four threads and keeps them at work."""
    import numpy as np
    from threadpoolctl import threadpool_limits

    matrix = np.ones((300, 300))
    with threadpool_limits(4), ThreadPoolExecutor(1) as thread:
        answer = thread.submit(job)
        while not answer.done():
            matrix = matrix @ matrix * 1e-3 % 1.0
            threading.Event().wait(0.05)
        return answer.result()


if __name__ == "__main__":
    main()
