"""No command is silent for more than two seconds: it says on the error stream what it does."""

import importlib
import os
import pty
import re
import signal
import subprocess
import sys
import time

import pytest

from damagepred.cli import terminal
from damagepred.kernels import progress

SLOW = """
import sys, time
from damagepred import cli
from damagepred.cli.options import DOING
import damagepred.archive.folder as folder
def slow(path):
    print("a result"); sys.stdout.flush()
    time.sleep({seconds})
    raise SystemExit(0)
folder.open_study = slow
sys.argv = ["damagepred", *{arguments!r}]
cli.main()
"""


def slow(seconds: float, *arguments: str) -> list[str]:
    """Command whose reading of a study takes its time."""
    return [sys.executable, "-c", SLOW.format(seconds=seconds, arguments=list(arguments))]


def test_a_pipe_has_one_line_and_dots_on_the_error_stream() -> None:
    run = subprocess.run(slow(3.2, "fragility", "a.dp"), capture_output=True, text=True, check=False)
    assert run.stdout == "a result\n"
    assert re.fullmatch(r"fitting curves, their bands and their goodness, \d+ s so far\n\.{1,3}\n", run.stderr)


@pytest.mark.parametrize("encoding", ["latin-1", "ascii", "utf-8"])
def test_streams_of_other_encodings_take_all_text(encoding: str) -> None:
    code = "from damagepred.cli import terminal; terminal.say('\u22123 mm \u2192 Ä')"
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, env=environment)
    expected = {"latin-1": "-3 mm ? Ä", "ascii": "-3 mm ? ?", "utf-8": "\u22123 mm \u2192 Ä"}[encoding]
    assert run.stdout.decode(encoding).strip() == expected


@pytest.mark.thorough
def test_a_terminal_counts_seconds_and_erases_them() -> None:
    parent, child = pty.openpty()
    process = subprocess.Popen(slow(3.0, "fragility", "a.dp"), stdout=subprocess.PIPE, stderr=child)
    os.close(child)
    said = b""
    while True:
        try:
            said += os.read(parent, 4096)
        except OSError:  # closed at the other end
            break
    assert process.wait() == 0
    assert process.stdout.read() == b"a result\n"
    assert len(set(re.findall(rb"goodness, (\d+) s so far", said))) >= 2
    assert said.endswith(b"\r\x1b[K")


@pytest.mark.thorough
def test_an_interrupt_while_waiting() -> None:
    process = subprocess.Popen(slow(60.0, "fragility", "a.dp"), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.readline()
    time.sleep(1.5)
    process.send_signal(signal.SIGINT)
    assert process.wait(20) == 130
    said = process.stderr.read().decode()
    assert "interrupted" in said
    assert "Traceback" not in said


def test_activities_follow_each_other(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    def until_it_is_said(activity: str) -> None:
        end = time.monotonic() + 20.0
        while activity not in terminal._WAIT._named and time.monotonic() < end:
            time.sleep(0.01)
        assert activity in terminal._WAIT._named

    monkeypatch.setattr(terminal.FORM, "quiet", False)
    monkeypatch.setattr(terminal.Wait, "FIRST", 0.3)
    with terminal.doing("reading"):
        until_it_is_said("reading")
        with terminal.doing("fitting") as activity:
            until_it_is_said("fitting")
            activity[0] = "drawing"
            until_it_is_said("drawing")
        monkeypatch.setattr(terminal.Wait, "FIRST", 60.0)
        with terminal.doing("too quick to be named"):
            time.sleep(2 * terminal.Wait.TICK)
    words = [line.partition(",")[0] for line in capfd.readouterr().err.splitlines()]
    assert words == ["reading", "fitting", "drawing"]


class Function:
    def __init__(self, compiled: bool) -> None:
        self.signatures = ["float64"] if compiled else []


def test_an_activity_is_named_once_however_often_it_is_interrupted(monkeypatch, capfd) -> None:
    work = [""]
    monkeypatch.setattr(terminal.FORM, "quiet", False)
    monkeypatch.setattr(terminal, "_kernel_work", lambda: work[0])
    monkeypatch.setattr(progress, "_functions", [("linear", Function(done)) for done in (True, False, True)])
    monkeypatch.setattr(terminal.Wait, "FIRST", 0.0)
    wait = terminal.Wait()
    monkeypatch.setattr(wait, "_watch", lambda: None)  # no thread: the test looks instead
    with wait.doing("solving"):
        for work[0] in ("", "compiling", "", "compiling", "loading"):
            wait._say()
    words = [line.partition(", 0 s")[0] for line in capfd.readouterr().err.splitlines()]
    assert words == ["solving", "compiling: 2 of at most 3", "loading: 2 of at most 3"]


def test_a_long_compilation_is_counted_again(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]):
    """The total does not grow, although each function is of a room of kernels of its own."""
    functions = [Function(False) for _ in range(3)]
    monkeypatch.setattr(terminal.FORM, "quiet", False)
    monkeypatch.setattr(terminal, "_kernel_work", lambda: "compiling the kernels")
    monkeypatch.setattr(progress, "_functions", [(f"room {k}", function) for k, function in enumerate(functions)])
    monkeypatch.setattr(terminal.Wait, "FIRST", 0.0)
    monkeypatch.setattr(terminal.Wait, "COUNT", 0.0)
    wait = terminal.Wait()
    monkeypatch.setattr(wait, "_watch", lambda: None)
    with wait.doing("solving", bar=True):  # which stands still meanwhile
        for function in functions:
            function.signatures = ["float64"]
            wait._say()
    said = [line.partition(", 0 s")[0].rpartition(": ")[2] for line in capfd.readouterr().err.splitlines()]
    assert said == [f"{k} of at most 3" for k in (1, 2, 3)]


def test_compilation_has_its_name(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    import numba

    monkeypatch.setattr(terminal.Wait, "FIRST", 0.0)
    monkeypatch.setattr(terminal.Wait, "TICK", 0.01)
    printed = ""
    with terminal.doing("solving"):
        for k in range(50):  # until the thread that looks has met the compiler
            assert numba.njit(lambda x, k=k: x + k)(2.0) == 2.0 + k
            printed += capfd.readouterr().err
            if "compiling" in printed:
                break
    assert "compiling the kernels, once per version" in printed + capfd.readouterr().err


def test_kernels_from_the_cache_are_loaded_and_not_compiled(monkeypatch, capfd, tmp_path) -> None:
    source = tmp_path / "cached_kernel.py"
    source.write_text("import numba\n\n\n@numba.njit(cache=True)\ndef twice(x):\n    return 2 * x\n")
    monkeypatch.syspath_prepend(tmp_path)
    kernels = importlib.import_module("cached_kernel")
    kernels.twice(2.0)  # compiles, and writes the cache
    monkeypatch.setattr(terminal.Wait, "FIRST", 0.0)
    monkeypatch.setattr(terminal.Wait, "TICK", 0.01)
    printed = ""
    with terminal.doing("solving"):
        for _ in range(500):  # until the thread that looks has met the loading
            kernels = importlib.reload(kernels)
            assert kernels.twice(2.0) == 4.0
            printed += capfd.readouterr().err
            if "loading" in printed:
                break
    printed += capfd.readouterr().err
    assert "loading the compiled kernels" in printed
    assert "compiling" not in printed
