"""Output of the command line: messages, JSON, progress, the grid of a table."""

from __future__ import annotations

import contextlib
import errno
import itertools
import json
import math
import os
import re
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass
from functools import cache, partial
from typing import IO, TYPE_CHECKING, Any, Self, cast

from damagepred.errors import ArchiveWarning, InputError
from damagepred.formatting import duration
from damagepred.inputs.text import controls_escaped

if TYPE_CHECKING:
    from rich.console import Console

    from damagepred.one_wall.judged_path import Step
    from damagepred.results.tables import Table
    from damagepred.study import Progress as StudyProgress


class _Stream:
    """Standard output or standard error; after a failed write, kept in ``error``, text is dropped."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.error: OSError | None = None

    def write(self, text: str) -> int:
        """Write text, as a file does."""
        encoding = getattr(sys, self.name).encoding or "utf-8"
        plain = text if encoding.lower() in ("utf-8", "utf8") else text.replace("\N{MINUS SIGN}", "-")
        self._try("write", plain.encode(encoding, "replace").decode(encoding))
        return len(text)

    def flush(self) -> None:
        """Flush, as a file does."""
        self._try("flush")

    def _try(self, action: str, *given: str) -> None:
        if self.error is not None:
            return
        try:
            with _WAIT.interrupted():
                getattr(getattr(sys, self.name), action)(*given)
        except OSError as error:
            self.error = error
            with contextlib.suppress(OSError):  # or the interpreter fails when it flushes at its end
                os.dup2(os.open(os.devnull, os.O_WRONLY), getattr(sys, self.name).fileno())

    def __getattr__(self, attribute: str) -> Any:
        return getattr(getattr(sys, self.name), attribute)


class Wait:
    """Names the activity of a command on the error stream while it prints no results."""

    FIRST, DOT, COUNT, TICK = 0.8, 1.5, 4.0, 0.2
    """Silence before the line on an activity, before each dot and each count; interval of the thread (s)."""

    def __init__(self) -> None:
        self.activities: list[list[Any]] = []
        self._printed = time.monotonic()
        self._named: set[str] = set()
        self._line_end = ""  # of the line on the activity, before other output
        self._lock = threading.RLock()
        self._thread: threading.Thread | None = None

    @contextlib.contextmanager
    def doing(self, activity: str, bar: bool = False) -> Iterator[list[Any]]:
        """Name the activity inside, with a bar of progress or without; the name is in the list and may change."""
        entry = [activity, time.monotonic(), bar]
        self._named.clear()
        self.activities.append(entry)
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=self._watch, daemon=True, name="silence")
            self._thread.start()
        try:
            yield entry
        finally:
            self.activities.remove(entry)
            self._named.clear()
            with self.interrupted():
                pass

    @contextlib.contextmanager
    def interrupted(self) -> Iterator[None]:
        """End or erase the line before other output."""
        with self._lock:
            if self._line_end:
                with contextlib.suppress(OSError):
                    sys.stderr.write(self._line_end)
                self._line_end = ""
            yield
            self._printed = time.monotonic()

    def _watch(self) -> None:
        while True:
            time.sleep(self.TICK)
            with contextlib.suppress(OSError, ValueError, IndexError), self._lock:  # streams closed, activity over
                self._say()

    def _say(self) -> None:
        activity, began, _ = self.activities[-1]
        bar = any(shown for *_, shown in self.activities)
        count, dot = "", self.DOT
        if work := _kernel_work():
            activity, count, dot = work, _compiled(), self.COUNT
        silence = time.monotonic() - max(self._printed, began)
        again = activity in self._named or (bar and not work)
        if FORM.quiet or not activity or (bar and again and not count):
            return
        on_a_terminal = _err().is_terminal and not bar
        erasing = "\r\x1b[K"
        if silence < (dot if again and not on_a_terminal else self.FIRST) and self._line_end != erasing:
            return
        text = f"{activity}{count}, {time.monotonic() - began:.0f} s so far"
        if on_a_terminal:
            sys.stderr.write(f"\r{text[: _err().width - 1]}\x1b[K")
            self._line_end = erasing
        elif again and not count:
            sys.stderr.write(".")
            self._line_end, self._printed = "\n", time.monotonic()
        else:
            _err().print(escaped(text))
        sys.stderr.flush()
        self._named.add(activity)


def _kernel_work() -> str:
    """Compilation of kernels or their loading from the cache, if a thread runs numba's compiler; otherwise empty."""
    compiler = os.path.join("numba", "core", "compiler.py")
    loads = False
    for frame in sys._current_frames().values():
        while frame is not None:
            code = frame.f_code
            if code.co_filename.endswith(compiler) and code.co_name != "<module>":
                if code.co_name != "_rebuild":  # of compiled code from a file
                    return "compiling the kernels, once per version"
                loads = True
            frame = frame.f_back  # type: ignore[assignment]
    return "loading the compiled kernels" if loads else ""


def _compiled() -> str:
    """Progress of the kernels as text, empty before the first one; most walls need fewer than all kernels."""
    from damagepred.kernels.progress import _functions, progress

    return f": {done} of at most {len(_functions)}" if (done := progress()[0]) else ""


_WAIT = Wait()
doing = _WAIT.doing


def silent() -> None:
    """Say nothing more while the present activity lasts: it prints at intervals of its own."""
    _WAIT.activities[-1][0] = ""


@dataclass
class Form:
    """Form of the output."""

    quiet: bool = False  # neither progress nor notes are printed
    json: bool = False  # standard output has JSON alone; messages go to the error stream
    full: bool = True  # tables have all columns, in several tables where the screen is too narrow, and all rows


FORM = Form()
"""Form that the options of the command ask for."""

_OUTPUT, _ERRORS = _Stream("stdout"), _Stream("stderr")


@cache
def _console(stream: _Stream) -> Console:
    from rich.console import Console  # --help needs none

    return Console(file=cast(IO[str], stream), soft_wrap=True, highlight=False)


_out, _err = partial(_console, _OUTPUT), partial(_console, _ERRORS)


def lost_output() -> str | None:
    """Reason why output could not be written; None without an error, or if its reader has closed the pipe."""
    error = _OUTPUT.error
    return None if error is None or error.errno == errno.EPIPE else error.strerror or str(error)


def escaped(text: str) -> str:
    """Return text as it is to be read: nothing in it is markup or steers the terminal."""
    from rich.markup import escape

    return escape(controls_escaped(text))


def show_archive_warnings() -> None:
    """Print warnings of archives and of keys without effect, each once, to the error stream."""
    shown: set[str] = set()
    before = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
        text = str(message)
        if "missing from font" in text:  # matplotlib, once per letter
            text = (
                "the font of the pictures lacks letters of a title or name; they are drawn as boxes. A file "
                "matplotlibrc in the working folder may name more fonts: font.family: DejaVu Sans, Noto Sans CJK SC"
            )
        elif category is not UserWarning and not issubclass(category, ArchiveWarning):
            before(message, category, *where, **more)
            return
        if text not in shown and not FORM.quiet:
            shown.add(text)
            say(f"note: {text}", error=True)

    warnings.showwarning = show
    warnings.simplefilter("always", ArchiveWarning)


def say(message: str, *, error: bool = False) -> None:
    """Print a message, errors to the error stream."""
    if error:
        _err().print(f"[bold red]damagepred:[/] {escaped(message)}")
    else:
        console = _err() if FORM.json else _out()
        # a terminal wraps between words; a file or a pipe has each message on one line
        console.print(escaped(message), soft_wrap=not console.is_terminal)


def lines(messages: Iterable[str]) -> None:
    """Print messages, each on lines of its own."""
    for message in messages:
        say(message)


def cautions(said: Sequence[str]) -> None:
    """Print cautions on the solution of walls."""
    lines(f"caution: {line}" for line in said)


def note(message: str) -> None:
    """Print a message that is no result, unless output is to be quiet."""
    if not FORM.quiet:
        say(message)


def print_json(result: Any, without: Sequence[str] = ()) -> None:
    """Print a result as JSON in SI units, its numbers not rounded; NaN and infinity are null."""
    values = _plain(result)
    for name in without:
        del values[name]
    _OUTPUT.write(json.dumps(values, indent=1, allow_nan=False) + "\n")


def answer(result: Any, show: Callable[[Any], object], without: Sequence[str] = ()) -> None:
    """Print a result as JSON if the command is asked to, otherwise show it."""
    if FORM.json:
        print_json(result, without)
    else:
        show(result)


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    elif hasattr(value, "_asdict"):
        value = value._asdict()
    elif hasattr(value, "to_dict"):  # of pandas, of xarray
        value = value.to_dict("records" if hasattr(value, "columns") else "list")
    elif hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if hasattr(value, "isoformat"):  # dates
        return value.isoformat()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def markdown(text: str) -> None:
    """Print Markdown without comments, in a terminal laid out and with plain equations."""
    text = re.sub(r"^<!--.*?-->\n", "", text, flags=re.MULTILINE | re.DOTALL)
    if not _out().is_terminal:
        _OUTPUT.write(text)
        return
    from rich.console import Console
    from rich.markdown import Markdown

    from damagepred.guide import with_plain_equations

    Console(file=cast(IO[str], _OUTPUT), width=min(_out().width, 100)).print(Markdown(with_plain_equations(text)))


def quantity(option: str, text: str, unit: str) -> float:
    """Read a number with a unit from the command line."""
    from damagepred.scene.quantity import is_number, to_si

    if is_number(text):
        raise InputError(f"{option} {text}: give the unit with the number, such as '{text} mm' or '{text} m'.")
    try:
        return to_si(text, unit)
    except ValueError as error:
        raise InputError(f"{option} {text!r}: {error}.") from None


def categories(text: str | None) -> list[int | str] | None:
    """Damage categories of --categories, parted by commas."""
    return [category(word.strip()) for word in text.split(",")] if text else None


def category(text: str) -> int | str:
    """Damage category of the command line: its number, or its name in the damage table of a study."""
    return int(text) if text.isdecimal() else text


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table, its numbers to the right."""
    from rich.table import Table as Grid

    parts = _parts_that_fit(columns, rows, _out().width)
    for number, shown in enumerate(parts if FORM.full else parts[:1]):
        grid = Grid(title=escaped(f"{title}, continued" if number else title), title_justify="left")
        for i in shown:
            # folded, to fit narrow screens
            grid.add_column(escaped(columns[i]), justify="right", overflow="fold")
        for row in rows:
            grid.add_row(*(escaped(row[i]) for i in shown))
        _out().print(grid)
    if not FORM.full and (left := [" ".join(columns[i].split()) for part in parts[1:] for i in part[1:]]):
        say(f"not shown: {', '.join(left)}; --full shows them")


def show(*tables: Table) -> None:
    """Print tables of results."""
    for shown in tables:
        table(shown.caption, shown.columns, shown.rows)


def _parts_that_fit(columns: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[list[int]]:
    """Return the columns of each table that is no wider than the screen, the first column in all."""
    cells = zip(columns, *rows)
    widths = [3 + max(len(line) for text in column for line in text.split("\n")) for column in cells]
    parts = [[0]]

    def fits(more: Sequence[int]) -> bool:
        return len(parts[-1]) == 1 or 1 + sum(widths[k] for k in (*parts[-1], *more)) <= width

    for _, alike in itertools.groupby(range(1, len(columns)), lambda i: columns[i].split("\n")[0]):
        together = list(alike)
        if not fits(together):
            parts.append([0])
        for i in together:
            if not fits([i]):
                parts.append([0])
            parts[-1].append(i)
    return parts


class _Progress(contextlib.ExitStack[bool | None]):
    """A bar of progress, shown only on a terminal, with columns of rich before and after it."""

    def __init__(self, before: str, *after: str, transient: bool) -> None:
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        super().__init__()
        texts = map(TextColumn, after[:-1])
        columns = (TextColumn(before), BarColumn(), MofNCompleteColumn(), *texts, TimeElapsedColumn())
        last = map(TextColumn, after[-1:])
        self._shown = _err().is_terminal and not FORM.quiet
        self._progress = Progress(*columns, *last, console=_err(), transient=transient, disable=not self._shown)
        self._activity: list[Any] = [before]

    def __enter__(self) -> Self:
        self._activity = self.enter_context(doing(self._activity[0], self._shown))
        self.enter_context(self._progress)
        return self


class Bar(_Progress):
    """Progress of one wall, of replays or of new samples, with the time that is left; shown only on a terminal."""

    def __init__(self, label: str, total: int | None = None) -> None:
        super().__init__(label, "{task.fields[left]}", transient=True)
        self._task, self._began = self._progress.add_task("", total=total, left=""), time.monotonic()

    def step(self, step: Step) -> None:
        """Show one more increment."""
        self._progress.update(self._task, completed=step.increment.number + 1)

    def replays(self, done: int, total: int) -> None:
        """Show the number of replays done and the time left."""
        left = (time.monotonic() - self._began) / done * (total - done)
        self._progress.update(self._task, completed=done, total=total, left=f"about {duration(left)} left")

    def walls(self, state: StudyProgress) -> None:
        """Show the number of new samples done."""
        self._progress.update(self._task, completed=state.done, total=state.total, left="new samples")


class StudyBar(_Progress):
    """Progress of a study: done, failed, remaining time. Without a terminal, a line now and then."""

    def __init__(self, houses: bool = False) -> None:
        self.noun = "houses" if houses else "walls"
        super().__init__(self.noun, "[red]{task.fields[failed]} failed[/]", "{task.fields[left]}", transient=False)
        self._activity[0] = f"preparing the {self.noun}"
        self._task: Any = None
        self._spoke = -math.inf

    def update(self, state: StudyProgress) -> None:
        """Show the present state of the study."""
        if self._task is None:
            self._task = self._progress.add_task("", total=state.total, completed=state.done, failed=0, left="")
        solving = f"solving {self.noun}, {state.done} of {state.total} done"
        begun = state.just_failed or math.isfinite(state.seconds_left)
        self._activity[0] = solving if begun else f"preparing the {self.noun}"
        if state.just_failed:
            say(state.just_failed, error=True)
        remaining = state.done < state.total and math.isfinite(state.seconds_left)
        left = f"about {duration(state.seconds_left)} left" if remaining else ""
        self._progress.update(self._task, completed=state.done, failed=state.failed, left=left)
        if FORM.quiet or _err().is_terminal:
            return
        if time.monotonic() - self._spoke > 10 or state.done == state.total:
            self._spoke = time.monotonic()
            left = f", {left}" if left else ""
            _err().print(f"{state.done} of {state.total} {self.noun}, {state.failed} failed{left}")
