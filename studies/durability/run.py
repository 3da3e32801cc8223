"""A study that is killed, hung or interrupted has the same results, bit by bit, as an undisturbed one.

Run: python studies/durability/run.py [--kills 10] [--walls 48] [--only kill worker hang dask disk interrupt]
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from damagepred.archive.folder import StudyFolder, open_study
from damagepred.errors import ArchiveWarning

HERE = Path(__file__).resolve().parent
STUDY = HERE / "small.toml"


class Mistreated(AssertionError):
    """A requirement on a disturbed study is not met."""


def command(folder: Path, walls: int, *more: str) -> list[str]:
    """Return the command line of a study with two workers."""
    where = [str(STUDY), "-n", str(walls), "-o", str(folder)]
    return [sys.executable, "-m", "damagepred", "study", *where, *(more or ("-j", "2"))]


def start(folder: Path, walls: int, *more: str) -> subprocess.Popen[str]:
    """Start a study as the leader of a new process group."""
    return subprocess.Popen(
        command(folder, walls, *more),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def finish(folder: Path, walls: int, *more: str) -> str:
    """Run or resume a study to its end; return its output."""
    run = subprocess.run(command(folder, walls, *more), capture_output=True, text=True, check=False, timeout=900)
    require(run.returncode == 0, f"exit code {run.returncode}: {run.stderr}")
    return run.stdout


def require(condition: bool, message: str) -> None:
    """Raise an error if a requirement is not met."""
    if not condition:
        raise Mistreated(message)


def same(first: Path, second: Path) -> None:
    """Check that the results of two studies are identical to the last bit, except for times."""
    a, b = open_study(first), open_study(second)
    require(set(a.variables) == set(b.variables), "other variables")
    for name in set(a.variables) - {"run_time"}:
        require(np.array_equal(a[name].values, b[name].values, equal_nan=a[name].dtype.kind == "f"), f"{name} differs")
    require(bool((a["status"].values <= 1).all()), "not every wall was solved")


def kept(folder: Path) -> dict[Path, bytes]:
    """Return every part with its content."""
    return {file: file.read_bytes() for file in StudyFolder(folder).part_files()}


def check_kept(before: dict[Path, bytes]) -> None:
    """Check that parts exist unchanged."""
    for file, content in before.items():
        require(file.is_file() and file.read_bytes() == content, f"{file.name} was lost or changed")


def wait_for(condition: Callable[[], bool], limit: float = 300.0) -> None:
    """Wait until a condition is true."""
    deadline = time.monotonic() + limit
    while not condition():
        require(time.monotonic() < deadline, "nothing happened")
        time.sleep(0.01)


def children(process: int) -> list[int]:
    """Return the processes that a process has started."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, IndexError):
            if int((entry / "stat").read_text().rpartition(")")[2].split()[1]) == process:
                found.append(int(entry.name))
    return found


# -- disturbances ----------------------------------------------------------------------------------------------------


def kill(folder: Path, walls: int, undisturbed: Path, kills: int, seed: int = 1) -> str:
    """Kill -9 the whole process group at random moments, and resume each time."""
    luck, acknowledged, done, restarts = random.Random(seed), 0, 0, 0
    target = folder
    for number in range(kills):
        before = kept(target) if target.exists() else {}
        count = len(StudyFolder(target).finished()) if before else 0
        if count == walls:  # complete: start another one
            same(undisturbed, target)
            restarts += 1
            target, before, count = folder.with_name(f"{folder.stem}-{restarts}.dp"), {}, 0
        run = start(target, walls)
        # from the start of the program to a few seconds of its work
        if luck.random() < 0.7:
            wait_for(lambda run=run, t=target, c=count: run.poll() is not None or len(StudyFolder(t).finished()) > c)
        time.sleep(luck.uniform(0.0, 1.5))
        with contextlib.suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)
        run.communicate()
        check_kept(before)
        if StudyFolder(target).exists:
            found = open_study(target)
            done = int((found["status"].values <= 1).sum())
            require(done >= count, "walls were lost")
            acknowledged += max(0, done - count)
        if (number + 1) % 10 == 0:
            print(f"  killed {number + 1} times, {acknowledged} walls kept", flush=True)
    before = kept(target)
    finish(target, walls)
    check_kept(before)
    same(undisturbed, target)
    return f"{kills} times killed, {acknowledged} walls kept of the killed runs, {restarts + 1} studies completed"


def worker(folder: Path, walls: int, undisturbed: Path) -> str:
    """Kill one worker in the middle of its work."""
    run = start(folder, walls)
    wait_for(lambda: bool(StudyFolder(folder).finished()))
    os.kill(random.choice(children(run.pid)), signal.SIGKILL)
    _, errors = run.communicate(timeout=900)
    require(run.returncode == 0, f"exit code {run.returncode}: {errors}")
    same(undisturbed, folder)
    return "one worker killed: complete, no wall failed"


def hang(folder: Path, walls: int, undisturbed: Path) -> str:
    """Stop one worker so that it hangs; the time limit ends it."""
    run = start(folder, walls, "-j", "2", "--timeout", "10")
    wait_for(lambda: bool(StudyFolder(folder).finished()))
    os.kill(random.choice(children(run.pid)), signal.SIGSTOP)
    _, errors = run.communicate(timeout=900)
    require(run.returncode == 0, f"exit code {run.returncode}: {errors}")
    same(undisturbed, folder)
    return "one worker hung: ended by the time limit, its walls solved by another"


def dask(folder: Path, walls: int, undisturbed: Path) -> str:
    """Kill one of two Dask workers."""
    from distributed import Client, LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        with Client(cluster.scheduler_address) as client:
            pids = list(client.run(os.getpid).values())
        run = start(folder, walls, "--scheduler", cluster.scheduler_address)
        wait_for(lambda: bool(StudyFolder(folder).finished()))
        os.kill(pids[0], signal.SIGKILL)
        _, errors = run.communicate(timeout=900)
    require(run.returncode == 0, f"exit code {run.returncode}: {errors}")
    same(undisturbed, folder)
    return "one of two Dask workers killed: complete, no wall failed"


@contextlib.contextmanager
def small_disk(size: int) -> Iterator[Path | None]:
    """Mount a small file system where that is allowed."""
    place = Path(tempfile.mkdtemp(prefix="small-disk-"))
    options = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)]
    mounted = shutil.which("mount") and subprocess.run(options, capture_output=True, check=False).returncode == 0
    try:
        yield place if mounted else None
    finally:
        if mounted:
            subprocess.run(["umount", str(place)], check=True)
        place.rmdir()


def disk(folder: Path, walls: int, undisturbed: Path) -> str:
    """Fill the disk, free space, and resume; where no disk can be mounted, limit the size of files."""
    design = (undisturbed / "design.nc").stat().st_size
    with small_disk(32 * 2**20) as place:
        if place is not None:
            target = place / "study.dp"
            room = design + 8 * 4096 + 3 * 12 * 2**10  # for the design and a few parts
            free = shutil.disk_usage(place).free
            (place / "filler").write_bytes(bytes(free - room))
            run = subprocess.run(command(target, walls), capture_output=True, text=True, check=False, timeout=900)
            how = "full disk"
        else:
            target, how = folder, "limit on the size of files"
            limited = ["bash", "-c", 'ulimit -f "$1"; shift; exec "$@"', "bash", str(max(2, design // 1024 + 1))]
            finish(target, 1)
            run = subprocess.run(
                [*limited, *command(target, walls)], capture_output=True, text=True, check=False, timeout=900
            )
        require(run.returncode == 2, f"exit code {run.returncode}: {run.stderr}")
        require("could not be written" in run.stderr and "Traceback" not in run.stderr, run.stderr)
        message = run.stderr.strip().splitlines()[-1]
        before = kept(target)
        if place is not None:
            (place / "filler").unlink()
        finish(target, walls)
        check_kept(before)
        same(undisturbed, target)
    return f"{how}: {len(before)} parts kept, completed once there was room; said: {message}"


def interrupt(folder: Path, walls: int, undisturbed: Path) -> str:
    """Ctrl-C once, later twice in a row, as a terminal sends it: to all processes of the group."""
    said = []
    for times, limit in ((1, 60.0), (2, 10.0)):
        count = len(StudyFolder(folder).finished())
        run = start(folder, walls)
        wait_for(lambda count=count: len(StudyFolder(folder).finished()) > count)
        began = time.monotonic()
        for _ in range(times):
            os.killpg(run.pid, signal.SIGINT)
            time.sleep(0.05)
        out, errors = run.communicate(timeout=120)
        seconds = time.monotonic() - began
        require(run.returncode == 130, f"exit code {run.returncode}: {errors}")
        require("interrupted" in out and "Traceback" not in errors, errors)
        require(seconds < limit, f"took {seconds:.1f} s to end")
        require(not StudyFolder(folder).failed_samples(), "walls were blamed")
        said.append(f"{times} x Ctrl-C: over after {seconds:.1f} s")
    before = kept(folder)
    finish(folder, walls)
    check_kept(before)
    same(undisturbed, folder)
    return "; ".join(said)


TREATMENTS: dict[str, Callable[..., str]] = {
    "kill": kill,
    "worker": worker,
    "hang": hang,
    "dask": dask,
    "disk": disk,
    "interrupt": interrupt,
}


def mistreat(names: list[str], walls: int, kills: int, place: Path) -> dict[str, str]:
    """Run the disturbances, and compare; return the results."""
    warnings.simplefilter("error", ArchiveWarning)  # a damaged file was not written completely
    undisturbed = place / "undisturbed.dp"
    finish(undisturbed, walls)
    found = {}
    for name in names:
        more = (kills,) if name == "kill" else ()
        found[name] = TREATMENTS[name](place / f"{name}.dp", walls, undisturbed, *more)
        print(f"{name}: {found[name]}", flush=True)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=10, help="random moments to kill all at (10)")
    parser.add_argument("--walls", type=int, default=48, help="of the study (48)")
    parser.add_argument("--only", nargs="+", choices=TREATMENTS, default=list(TREATMENTS), help="disturbances to run")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        mistreat(options.only, options.walls, options.kills, Path(place))


if __name__ == "__main__":
    main()
