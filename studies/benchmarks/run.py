"""Measure all benchmarks, one after the other, and write RESULTS.md.

    python studies/benchmarks/run.py [--rooms NAME ...] [--anew]
    python studies/benchmarks/run.py --quick [--rooms NAME ...]
    python studies/benchmarks/run.py --from-data

Each benchmark runs by its own command in a separate process. The same call resumes an interrupted one (Ctrl-C);
``--anew`` first moves existing data aside (``aside/``), so that all are of one run. ``measured.csv`` records date,
version and machine. ``--quick`` runs the small form of each benchmark and does not change data; ``--from-data`` only
writes RESULTS.md. Times are most reliable on an otherwise idle machine.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from studies.benchmarks import results
from studies.benchmarks.pages import machine, version
from studies.benchmarks.rooms import HERE, ROOMS, ROOT, SEPARATE, Room, fingerprint, measured, record

PATIENCE = {signal.SIGINT: 30.0, signal.SIGTERM: 10.0, signal.SIGKILL: 10.0}
"""Signals that end a benchmark, and the time limit of each (s)."""


def say(words: str) -> None:
    """Print at once, because benchmarks print, too."""
    print(words, flush=True)


def costs(rooms: Sequence[Room]) -> None:
    """Print the expected time of the benchmarks: that of their last measurement."""
    minutes = measured().groupby("room")["minutes"].sum().reindex([room.name for room in rooms])
    for name, each in minutes.items():
        say(f"  {name:16}" + (f"{each:6.0f} min" if each == each else "     ? min: not measured yet"))
    say(f"  {'in all':16}{minutes.sum():6.0f} min, if measured anew; less where data are there already")


def command(arguments: Sequence[str]) -> int:
    """Run a command to its end; an interruption ends it with all of its child processes."""
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join(paths), "PYTHONUNBUFFERED": "1"}
    child = subprocess.Popen(
        [sys.executable, *arguments], cwd=ROOT, env=surroundings, stdin=subprocess.DEVNULL, process_group=0
    )
    try:
        return child.wait()
    except KeyboardInterrupt:
        end(child)
        raise


def end(child: subprocess.Popen[bytes]) -> None:
    """End a process and its children, first by an interrupt."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # once is enough
    for kind, seconds in PATIENCE.items():
        try:
            os.killpg(child.pid, kind)
            child.wait(seconds)
        except ProcessLookupError:  # nothing is left of it
            return
        except subprocess.TimeoutExpired:
            continue


def move_aside(rooms: Sequence[Room], folder: Path) -> None:
    """Move data of benchmarks into a folder."""
    for room in rooms:
        for name in () if room.name in SEPARATE else room.data:
            file = room.folder / name
            if file.exists():
                (folder / room.name).mkdir(parents=True, exist_ok=True)
                file.rename(folder / room.name / name)


def measure(room: Room) -> int:
    """Run a benchmark and record it; return the exit code of its command."""
    say(f"== {room.name}: {room.shell}")
    anew = room.name in SEPARATE or not any((room.folder / name).exists() for name in room.data)
    before, began, what, ended = fingerprint(room), time.perf_counter(), version(), "stopped"
    try:
        code = command(room.command)
        ended = f"failed ({code})" if code else "complete"
    finally:
        minutes = (time.perf_counter() - began) / 60
        last = measured().query("room == @room.name")["end"]
        if fingerprint(room) != before or (ended == "complete" and len(last) and last.iloc[-1] != ended):
            record(room, what, f"{datetime.now(UTC):%Y-%m-%d}", machine(), minutes, ended, anew)
        else:
            say("nothing new was measured")
    say(f"== {room.name}: {ended}, {minutes:.1f} min")
    return code


def quick(room: Room) -> int:
    """Run the small form of a benchmark, which stores nothing."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = [part.format(folder) for part in room.quick]
        say(f"== {room.name}, small form: python {' '.join(arguments)}")
        return command(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Read the command line, measure, write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    of = f"of {', '.join(ROOMS)} (all)"
    parser.add_argument("--rooms", nargs="+", choices=list(ROOMS), default=list(ROOMS), metavar="NAME", help=of)
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--anew", action="store_true", help="first move existing data aside")
    how.add_argument("--quick", action="store_true", help="the small form of each benchmark; does not change data")
    how.add_argument("--from-data", action="store_true", help="measure nothing; only write RESULTS.md")
    options = parser.parse_args(arguments)
    rooms = [ROOMS[name] for name in ROOMS if name in options.rooms]
    if options.from_data:
        results.write()
        return 0
    for kind in (signal.SIGINT, signal.SIGTERM):  # a shell that runs this in the background ignores the first
        signal.signal(kind, signal.default_int_handler)
    if not options.quick:
        costs(rooms)
    if options.anew:
        move_aside(rooms, HERE / "aside" / f"{datetime.now(UTC):%Y-%m-%dT%H%M%S}")
    try:
        codes = {room.name: quick(room) if options.quick else measure(room) for room in rooms}
    except KeyboardInterrupt:
        say("stopped" + ("" if options.quick else "; the same command resumes" + ", without --anew" * options.anew))
        return 130
    if not options.quick:
        results.write()
        say(f"written: {results.PAGE.relative_to(ROOT)}")
    failed = [f"{name} ({code})" for name, code in codes.items() if code]
    if failed:
        say(f"ended with an error: {', '.join(failed)}")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
