"""Results of reference walls, before and after a change of the code; times: ``tests/regressions``.

Run: python tests/reference_walls/run.py record FOLDER
     python tests/reference_walls/run.py compare FOLDER [--only NAME ...] [--tolerance 1e-12]
     python tests/reference_walls/run.py digests [REVISION ...] [--only NAME ...]

Results are compared bit by bit. ``digests`` writes a digest of the fields of each wall for each revision as a row of
``digests.csv``: equal digests are equal bits, on the machine named in the row.

Small walls, one for each mechanism, a study, one of its samples replayed, and its fragility curves. Results
depend on the machine's BLAS, so they are recorded where they are compared and are not part of the repository.
"""

import argparse
import hashlib
import importlib.metadata
import json
import os
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import tomli_w
import xarray as xr

import damagepred
from damagepred.archive.files import read_dataset

HERE = Path(__file__).resolve().parent
VARYING = ("run_time", "machine")
"""Variables that differ from run to run."""


def walls() -> dict[str, str]:
    tables = tomllib.loads((HERE / "walls.toml").read_text(encoding="utf-8"))
    return {name: tomli_w.dumps(table) for name, table in tables.items()}


def scene_of(text: str) -> damagepred.Scene:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "wall.toml"
        file.write_text(text, encoding="utf-8")
        return damagepred.Scene.from_toml(file)


def solved(scene: str) -> xr.Dataset:
    return damagepred.solve(scene_of(scene), on_failure="return")


def studied() -> Iterator[tuple[str, xr.Dataset]]:
    """Run the study; yield its results, one sample replayed by the command line, and the fragility curves."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        out = folder / "study.dp"
        damagepred.Study.from_toml(HERE / "study.toml").run(out, workers=1)
        results = damagepred.open_study(out)
        yield "study", results
        wall = folder / "wall.nc"
        subprocess.run(
            [sys.executable, "-m", "damagepred", "replay", out, "3", "-o", wall], check=True, capture_output=True
        )
        yield "replay", read_dataset(wall)
        yield "fragility", damagepred.fit_fragility(results, bootstrap=50)


def results(only: list[str], studies: bool = True) -> Iterator[tuple[str, xr.Dataset]]:
    for name, scene in walls().items():
        if not only or name in only:
            yield name, solved(scene)
    if studies and (not only or "study" in only):
        yield from studied()


def differences(before: xr.Dataset, after: xr.Dataset, tolerance: float) -> list[str]:
    """Return the differences between two datasets, in words."""
    found = []
    for name in sorted({*map(str, before.variables), *map(str, after.variables)} - set(VARYING)):
        if name not in before.variables or name not in after.variables:
            if name in before.variables and before[name].size == 0:  # before schema version 6
                continue
            found.append(f"{name}: only {'after' if name in after.variables else 'before'}")
            continue
        one, two = before[name].values, after[name].values
        if one.shape != two.shape or one.dtype != two.dtype:
            found.append(f"{name}: {one.dtype} {one.shape}, now {two.dtype} {two.shape}")
        elif one.tobytes() != two.tobytes() if one.dtype.kind in "biuf" else (one != two).any():
            change = np.nan
            if one.dtype.kind in "iuf":
                spread = np.nanmax(np.abs(one), initial=0.0) or 1.0
                change = float(np.nanmax(np.abs(two.astype(float) - one), initial=0.0) / spread)
                if change <= tolerance and (np.isnan(one.astype(float)) == np.isnan(two.astype(float))).all():
                    continue
            found.append(f"{name}: differs by {change:.2g} of its largest value")
    for key in ("status", "status_message"):
        one, two = before.attrs.get(key), after.attrs.get(key)
        found += [f"{key}: {one!r}, now {two!r}"] if one != two else []
    return found


FIELDS = (
    "block_displacement_x block_displacement_y block_rotation contact_opening contact_slip contact_normal_stress "
    "contact_shear_stress contact_state contact_broken_at base_reaction crack_width_max newton_iterations"
)


def digest(ds: xr.Dataset) -> str:
    """Digest of the fields of a wall, of those that all versions have."""
    content = hashlib.sha256()
    for name in FIELDS.split():
        if name in ds.variables:
            content.update(np.ascontiguousarray(ds[name].values).tobytes())
    return content.hexdigest()[:12]


def digests(only: list[str]) -> dict[str, str]:
    """Digests of the walls by this version, and its environment."""
    from damagepred.archive.provenance import blas, machine

    found = {name: digest(ds) for name, ds in results(only, studies=False)}
    return {
        "numba": importlib.metadata.version("numba"),
        "numpy": importlib.metadata.version("numpy"),
        "machine": f"{machine()}, {blas()}",
    } | found


def write_digests(revisions: list[str], only: list[str]) -> int:
    """Add the digests of revisions, by default the present commit, to the table; return 1 if they differ."""
    file, git = HERE / "digests.csv", ["git", "-C", str(HERE)]
    table = pd.read_csv(file, dtype=str, keep_default_na=False) if file.exists() else pd.DataFrame({"commit": []})
    rows = []
    for revision in revisions or ["HEAD"]:
        log = [*git, "log", "-1", "--format=%h;%cs;%s", revision]
        commit, date, subject = (
            subprocess.run(log, check=True, capture_output=True, text=True).stdout.strip().split(";", 2)
        )
        with tempfile.TemporaryDirectory() as name:
            checkout = Path(name) / "checkout"
            subprocess.run([*git, "worktree", "add", "--quiet", "--detach", str(checkout), commit], check=True)
            try:
                command = [sys.executable, __file__, "--only", *only, "--", "digests-here"]
                run = subprocess.run(
                    command, check=True, capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(checkout)}
                )
            finally:
                subprocess.run([*git, "worktree", "remove", "--force", str(checkout)], check=True)
        rows.append({"commit": commit, "date": date, "subject": subject} | json.loads(run.stdout))
        print(json.dumps(rows[-1]), flush=True)
        both = pd.concat([table, pd.DataFrame(rows)]).drop_duplicates(["commit", "numba"], keep="last")
        both.to_csv(file, index=False)
    return int(any(row.get(name) != rows[0].get(name) for row in rows for name in walls()))


def record(folder: Path, only: list[str]) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    for name, ds in results(only):
        ds.to_netcdf(folder / f"{name}.nc")
        print(f"{name}: {ds.attrs.get('status', 'recorded')}", flush=True)
    return 0


def compare(folder: Path, only: list[str], tolerance: float) -> int:
    """Compare all results with those recorded; return 1 if any differs."""
    worst = 0
    for name, ds in results(only):
        if not (folder / f"{name}.nc").exists():
            print(f"{name}: not recorded", flush=True)
            continue
        with tempfile.TemporaryDirectory() as other:
            ds.to_netcdf(Path(other) / "now.nc")
            with xr.open_dataset(folder / f"{name}.nc") as before, xr.open_dataset(Path(other) / "now.nc") as after:
                found = differences(before.load(), after.load(), tolerance)
        print(f"{name}: {'identical' if not found else '; '.join(found)}", flush=True)
        worst = max(worst, bool(found))
    return worst


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    choices = ("record", "compare", "digests", "digests-here")
    parser.add_argument("what", choices=choices, help="digests-here: of this version, as JSON")
    parser.add_argument("folder", nargs="*", help="of recorded results; revisions")
    parser.add_argument("--only", nargs="*", default=[], help="names of walls, or study")
    parser.add_argument("--tolerance", type=float, default=0.0, help="relative difference allowed (0: bit by bit)")
    given = parser.parse_args(arguments)
    if given.what == "digests-here":
        print(json.dumps(digests(given.only)))
        return 0
    if given.what == "digests":
        return write_digests(given.folder, given.only)
    if len(given.folder) != 1:
        parser.error(f"{given.what} needs a folder")
    folder = Path(given.folder[0])
    return record(folder, given.only) if given.what == "record" else compare(folder, given.only, given.tolerance)


if __name__ == "__main__":
    sys.exit(main())
