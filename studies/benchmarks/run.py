"""Measure all benchmarks, one after the other, and write RESULTS.md.

    python studies/benchmarks/run.py [--rooms NAME ...] [--anew] [--limit 90]
    python studies/benchmarks/run.py --quick [--rooms NAME ...]
    python studies/benchmarks/run.py --from-data

Each benchmark runs by its own command in a separate process, at most twice as long as expected and all together at most
``--limit`` minutes. The same call resumes what was interrupted (Ctrl-C, or a limit); ``--anew`` first moves existing
data aside (``aside/``), so that all are of one run. ``measured.csv`` records date, version and machine. ``--quick``
runs the small form of each benchmark and does not change data; ``--from-data`` only writes RESULTS.md. Times are most
reliable on an otherwise idle machine.
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

from studies.benchmarks.pages import machine, version
from studies.benchmarks.rooms import HERE, PAGE, ROOMS, ROOT, SEPARATE, Room, contents, measured, record, section, write

PATIENCE = {signal.SIGINT: 30.0, signal.SIGTERM: 10.0, signal.SIGKILL: 10.0}
"""Signals that end a benchmark, and the time limit of each (s)."""
SLACK = 2.0
"""Time that a benchmark may take, over the expected."""


def say(words: str) -> None:
    """Print at once, because benchmarks print, too."""
    print(words, flush=True)


def costs(rooms: Sequence[Room]) -> None:
    """Print the expected time of the benchmarks, and that of their last measurement."""
    last = measured().set_index("room")["minutes"]
    for room in rooms:
        say(f"  {room.name:16}{room.minutes:6.0f} min; last time {last.get(room.name, float('nan')):.0f} min")
    whole = sum(room.minutes for room in rooms)
    say(f"  {'in all':16}{whole:6.0f} min, if measured anew; less where data are there already")


def command(arguments: Sequence[str], minutes: float | None = None) -> int | None:
    """Run a command to its end or for some minutes; return its exit code, None if it took longer.

    An interruption, too, ends it with all of its child processes.
    """
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join(paths), "PYTHONUNBUFFERED": "1"}
    child = subprocess.Popen(
        [sys.executable, *arguments], cwd=ROOT, env=surroundings, stdin=subprocess.DEVNULL, process_group=0
    )
    try:
        return child.wait(None if minutes is None else 60 * minutes)
    except subprocess.TimeoutExpired:
        end(child)
        return None
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # once is enough
        end(child)
        raise


def end(child: subprocess.Popen[bytes]) -> None:
    """End a process and its children, first by an interrupt."""
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


def measure(room: Room, minutes: float | None = None) -> int:
    """Run a benchmark and record it; return the exit code of its command, 1 if it took longer than some minutes."""
    say(f"== {room.name}: {room.shell}")
    before, began, what, ended = contents(room), time.perf_counter(), version(), "stopped"
    code: int | None = None
    try:
        code = command(room.command, minutes)
        ended = "complete" if code == 0 else "stopped" if code is None else f"failed ({code})"
    finally:
        spent = (time.perf_counter() - began) / 60
        last = measured().set_index("room")["end"].get(room.name)
        if contents(room) != before or (ended == "complete" and last not in (None, ended)):
            row = {"room": room.name, "version": what, "date": f"{datetime.now(UTC):%Y-%m-%d}", "machine": machine()}
            record(row | {"minutes": spent, "end": ended}, anew=room.name in SEPARATE or not before)
        else:
            say("nothing new was measured")
    say(f"== {room.name}: {ended}, {spent:.1f} min")
    return 1 if code is None else code


def quick(room: Room) -> int | None:
    """Run the small form of a benchmark, which changes no data, and print the section that it writes."""
    say(f"== {room.name}, small form: python {' '.join(room.quick)}")
    if room.name in SEPARATE:
        return command(room.quick)
    with tempfile.TemporaryDirectory() as folder:
        code = command([*room.quick, "--output", folder])
        say(section(room, Path(folder)))
    return code


def main(arguments: Sequence[str] | None = None) -> int:
    """Read the command line, measure, write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    of = f"of {', '.join(ROOMS)} (all)"
    parser.add_argument("--rooms", nargs="+", choices=list(ROOMS), default=list(ROOMS), metavar="NAME", help=of)
    parser.add_argument("--limit", type=float, default=90.0, help="time of all of them (90 minutes)")
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--anew", action="store_true", help="first move existing data aside")
    how.add_argument("--quick", action="store_true", help="the small form of each benchmark; does not change data")
    how.add_argument("--from-data", action="store_true", help="measure nothing; only write RESULTS.md")
    options = parser.parse_args(arguments)
    rooms, began, codes = [ROOMS[name] for name in ROOMS if name in options.rooms], time.monotonic(), {}
    if options.from_data:
        write()
        return 0
    for kind in (signal.SIGINT, signal.SIGTERM):  # a shell that runs this in the background ignores the first
        signal.signal(kind, signal.default_int_handler)
    if not options.quick:
        costs(rooms)
    if options.anew:
        move_aside(rooms, HERE / "aside" / f"{datetime.now(UTC):%Y-%m-%dT%H%M%S}")
    try:
        for room in rooms:
            if options.quick:
                codes[room.name] = quick(room)
            else:
                left = options.limit - (time.monotonic() - began) / 60
                codes[room.name] = measure(room, max(min(SLACK * room.minutes, left), 0.0))
    except KeyboardInterrupt:
        say("stopped" + ("" if options.quick else "; the same command resumes" + ", without --anew" * options.anew))
        return 130
    missing = [room.name for room in ROOMS.values() if not contents(room)]
    if not options.quick and not missing:
        write()
    say(f"no page without data of {', '.join(missing)}" if missing else f"the page: {PAGE.relative_to(ROOT)}")
    failed = [f"{name} ({code})" for name, code in codes.items() if code]
    if failed:
        say(f"not complete: {', '.join(failed)}; the same command resumes" + ", without --anew" * options.anew)
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
