"""Damaged study folders and files: every command refuses them, names omitted files, or gives the right answer.

The seed and the number of a damage determine it: single bits flipped anywhere, files cut, emptied, removed, renamed,
exchanged with those of another study, attributes changed, pipes and folders in their place. Each command runs in a fork
with a time limit. At the end ``repair`` and ``study`` must restore all samples, bit by bit.
"""

from __future__ import annotations

import contextlib
import csv
import os
import random
import re
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple
from unittest import mock

import netCDF4
import numpy as np
import xarray as xr

from damagepred.archive.files import write_dataset
from damagepred.archive.folder import StudyFolder, open_study
from damagepred.campaign import campaign as study_module
from damagepred.campaign.dispatch import GivenExecutor
from damagepred.campaign.replay import replay
from damagepred.campaign.settings import StudySettings
from damagepred.cli import main as command_line
from damagepred.errors import ArchiveWarning, InputError
from damagepred.study import Study

STUDY = """
[study]
title = "walls to damage"
samples = 6
seed = {seed}
[scene.wall]
length = 0.96
height = 0.45
[scene.joint]
tensile_strength = "0.1 MPa"
cohesion = "0.1 MPa"
[scene.movement]
kind = "doming"
central_deflection = "6 mm"
increments = 3
[variables."joint.friction"]
distribution = "lognormal"
mean = 0.75
cov = 0.15
[variables."joint.cohesion"]
distribution = "lognormal"
mean = 0.1e6
cov = 0.35
field = {{ course_correlation = 0.4 }}
"""
COMMANDS = {
    "status": "status study.dp",
    "fragility": "fragility study.dp --bootstrap 0 --goodness 0",
    "judge": "judge study.dp --table bre251",
    "verify": "verify study.dp",
    "replay": "replay study.dp 1",
    "report": "report study.dp -o report.html --no-replay --bootstrap 0",
    "wall": "judge wall.nc --table bre251",
    "study": "study study.toml -o study.dp",
}
PATIENCE = 60.0
"""Time (s) after which a command counts as hung."""
RARELY = {"report": 5}
"""Slow commands, and the number of folders of which one is tried."""
_TIMES = re.compile(r"\d+(\.\d+)? (s|ms|min)\b|\s+")


class Said(NamedTuple):
    """Exit code of a command, and what it printed."""

    code: int
    out: str
    err: str

    def plain(self) -> str:
        """Output without times and spaces."""
        return _TIMES.sub(" ", self.out)


def files(folder: Path) -> list[Path]:
    """Return the files of a folder, sorted."""
    return sorted(f for f in folder.rglob("*") if f.is_file() and not f.name.startswith("."))


# -- damage -----------------------------------------------------------------------------------------------------------


def flip(file: Path, luck: random.Random, other: Path) -> None:
    content = bytearray(file.read_bytes())
    if content:
        content[luck.randrange(len(content))] ^= 1 << luck.randrange(8)
    file.write_bytes(content)


def cut(file: Path, luck: random.Random, other: Path) -> None:
    os.truncate(file, luck.randrange(file.stat().st_size + 1))


def empty(file: Path, luck: random.Random, other: Path) -> None:
    file.write_bytes(b"")


def remove(file: Path, luck: random.Random, other: Path) -> None:
    file.unlink()


def noise(file: Path, luck: random.Random, other: Path) -> None:
    content = bytearray(file.read_bytes())
    at = luck.randrange(len(content) + 1)
    content[at : at + 64] = luck.randbytes(64)
    file.write_bytes(content)


def exchange(file: Path, luck: random.Random, other: Path) -> None:
    """Replace a file by one of another study of equal size, of the same kind if there is one."""
    alike = [f for f in files(other) if f.name == file.name] or [f for f in files(other) if f.suffix == file.suffix]
    shutil.copy(luck.choice(alike or files(other)), file)


def rename(file: Path, luck: random.Random, other: Path) -> None:
    new = luck.choice(
        ("sample-00000004.nc", "samples-00000000-00000099.nc", "results.nc", "design.nc", "stray.nc", "x")
    )
    file.rename(file.with_name(new))


def pipe(file: Path, luck: random.Random, other: Path) -> None:
    file.unlink()
    os.mkfifo(file)


def folder_instead(file: Path, luck: random.Random, other: Path) -> None:
    file.unlink()
    file.mkdir()


def attribute(file: Path, luck: random.Random, other: Path) -> None:
    """Change or remove an attribute with another program."""
    if file.suffix != ".nc":
        return flip(file, luck, other)
    with netCDF4.Dataset(file, "a") as ds:
        place = luck.choice([ds, *ds.variables.values()])
        names = [name for name in place.ncattrs() if name != "_FillValue"]
        if names and luck.random() < 0.3:
            place.delncattr(luck.choice(names))
        elif names:
            place.setncattr(luck.choice(names), luck.choice((0, -1, 99, "", "[", np.float32(0.5), "1e400")))
    return None


DAMAGE: dict[Callable[[Path, random.Random, Path], None], int] = {
    flip: 40,
    cut: 8,
    empty: 6,
    remove: 8,
    noise: 8,
    exchange: 12,
    rename: 6,
    pipe: 3,
    folder_instead: 3,
    attribute: 6,
}


# -- running ----------------------------------------------------------------------------------------------------------


def run(arguments: str, place: Path) -> Said:
    """Run a command in a fork of this process; exit code -1 if it took too long."""
    out, err = place / ".out", place / ".err"
    child = os.fork()
    if child == 0:
        code = 99
        try:
            os.chdir(place)
            for stream, file in ((1, out), (2, err)):
                os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644), stream)
            sys.stdout, sys.stderr = (os.fdopen(stream, "w", encoding="utf-8", closefd=False) for stream in (1, 2))
            sys.argv = ["damagepred", *arguments.split()]
            command_line()
            code = 0
        except SystemExit as ending:
            code = int(ending.code or 0)
        except BaseException:
            traceback.print_exc()
        finally:
            for stream in (sys.stdout, sys.stderr):
                with contextlib.suppress(Exception):
                    stream.flush()
            os._exit(code)
    deadline = time.monotonic() + PATIENCE
    while (ended := os.waitpid(child, os.WNOHANG))[0] == 0:
        if time.monotonic() > deadline:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return Said(-1, "", "")
        time.sleep(0.002)
    texts = (file.read_text(encoding="utf-8", errors="replace") for file in (out, err))
    return Said(os.waitstatus_to_exitcode(ended[1]), *texts)


def defect(command: str, said: Said, honest: Said, gone: bool) -> str:
    """Return the defects of a command's answer; a study without a missing file is unfinished."""
    if said.code == -1:
        return f"{command}: hang"
    if said.code not in (0, 2, 3) or "Traceback" in said.err:
        return f"{command}: exit code {said.code}: {said.err.strip()[-300:]}"
    if said.code and not (said.err.strip() or said.out.strip()):
        return f"{command}: exit code {said.code} without a message"
    named = gone or said.err.strip() or "damaged" in said.out or "nothing to compare with" in said.out
    if said.code == honest.code and not named and said.plain() != honest.plain():
        return f"{command}: silently different"
    return ""


def values_differ(folder: Path, honest: xr.Dataset, gone: bool) -> str:
    """Return whether the archive has changed values, or missing ones without a message."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", ArchiveWarning)
        try:
            ds = open_study(folder)
        except InputError:
            return ""
    return different(ds, honest) or (
        "open_study: samples are missing without a message"
        if (ds["status"].values == 3).any() and not (said or gone)
        else ""
    )


def different(ds: xr.Dataset, honest: xr.Dataset) -> str:
    """Return the differences of an archive's samples from those of an undamaged one; only the last may have failed."""
    status = ds["status"].values
    if len(status) != honest.sizes["sample"] or (status[:-1] == 2).any():
        return "open_study: samples are gone, or failed"
    for name, variable in honest.variables.items():
        if variable.dims[:1] == ("sample",) and name not in ("run_time", "environment"):
            one, wanted = ds[name].values[status < 2], variable.values[status < 2]
            if not np.array_equal(one, wanted, equal_nan=one.dtype.kind == "f"):
                return f"open_study: {name} is silently different"
    return ""


def mended(place: Path, honest: xr.Dataset) -> str:
    """Repair a folder, run missing samples, and return whether all are restored."""
    steps = [run(command, place) for command in ("repair study.dp", COMMANDS["study"], COMMANDS["verify"])]
    if wrong := [said for said in steps if said.code not in (0, 3)]:
        text = wrong[0].err.strip()
        return "" if "restore a backup" in text else f"repair: {wrong[0].code}: {text[-300:]}"
    ds = open_study(place / "study.dp")
    return different(ds, honest) or ("repair: samples are missing" if (ds["status"].values == 3).any() else "")


# -- the campaign -----------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def studies() -> Iterator[tuple[Path, Path]]:
    """Make a study with its file and a solved wall, and another of equal size; yield both places."""

    def in_this_process(where: str, *_: object, **__: object) -> GivenExecutor:
        return GivenExecutor(where, ThreadPoolExecutor(1))

    with mock.patch.object(study_module, "LocalPool", in_this_process), tempfile.TemporaryDirectory() as name:
        places = Path(name) / "one", Path(name) / "other"
        for seed, place in enumerate(places):
            place.mkdir()
            (place / "study.toml").write_text(STUDY.format(seed=seed + 1), encoding="utf-8")
            study = Study(StudySettings.from_toml(place / "study.toml"))
            study.run(place / "whole.dp")
            study.run(place / "study.dp", samples=5)
            StudyFolder(place / "study.dp").record_failure(5, "timeout", "made up", {})
            study.run(place / "study.dp")
            write_dataset(replay(place / "study.dp", 0)[0], place / "wall.nc")
        yield places


def one(
    number: int, seed: int, place: Path, source: Path, other: Path, honest: dict[str, Said], ds: xr.Dataset
) -> list:
    """Damage a copy of the folder, try all commands on it, and return a line of the log."""
    luck = random.Random(f"{seed} {number}")
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(source, place)
    done = []
    for _ in range(1 if luck.random() < 0.8 else 2):
        file = luck.choice(files(place / "study.dp") if luck.random() < 0.9 else [place / "wall.nc"])
        damage = luck.choices(list(DAMAGE), list(DAMAGE.values()))[0]
        with contextlib.suppress(OSError):  # the second damage of a file that is no longer netCDF
            damage(file, luck, other / "study.dp")
        done.append(f"{damage.__name__} {file.relative_to(place)}")
    gone = any(what.startswith(("remove", "rename", "exchange wall")) for what in done)
    wrong, codes = [values_differ(place / "study.dp", ds, gone)], []
    for name, command in COMMANDS.items():
        if number % RARELY.get(name, 1) == 0:
            said = run(command, place)
            codes.append(f"{name} {said.code}{' said' if said.err.strip() else ''}")
            wrong.append(defect(name, said, honest[name], gone))
    wrong.append(values_differ(place / "study.dp", ds, gone))
    wrong.append(mended(place, ds))
    return [number, "; ".join(done), "; ".join(codes), "; ".join(filter(None, wrong))]


def main(count: int, seed: int, out: Path) -> int:
    """Try damaged folders; write a log, print a summary, and return 1 where there are defects."""
    found, answers = [], Counter()
    with studies() as (source, other):
        place = source.with_name("damaged")
        shutil.copytree(source, place)
        ds = open_study(source / "whole.dp")
        honest = {name: run(command, place) for name, command in COMMANDS.items()}
        assert all(said.code in (0, 3) for said in honest.values()), honest
        out.mkdir(parents=True, exist_ok=True)
        with (out / "folders.csv").open("w", newline="", encoding="utf-8") as log:
            table = csv.writer(log, lineterminator="\n")
            table.writerow(["number", "damage", "answers", "defect"])
            for number in range(count):
                line = one(number, seed, place, source, other, honest, ds)
                table.writerow(line)
                log.flush()
                answers.update(line[2].split("; "))
                found += [line] if line[3] else []
    for line in found[:20]:
        print(f"{line[0]}: {line[1]}: {line[3]}")
    print(f"{count} damaged folders, {sum(answers.values())} commands, {len(found)} folders with defects; exit codes:")
    print(", ".join(f"{answer}: {number}" for answer, number in sorted(answers.items())))
    return int(bool(found))
