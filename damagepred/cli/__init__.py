"""The command line: thin, and quick to start; everything is imported when a command needs it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from damagepred.cli import results, studies, terminal, walls
from damagepred.cli.options import BAD_INPUT, DOING, INTERRUPTED, OK, SOME_FAILED, app
from damagepred.errors import InputError, SolverError, StudyError

__all__ = ["BAD_INPUT", "INTERRUPTED", "OK", "SOME_FAILED", "app", "main", "results", "studies", "walls"]


@app.command("guide")
def guide(
    topic: Annotated[str | None, typer.Argument(help="Page to read; left out, the pages are listed.")] = None,
) -> None:
    """Read the guide in the terminal."""
    from damagepred.guide import TOPICS, page, title

    if topic is not None:
        terminal.markdown(page(topic))
        return
    terminal.say("damagepred guide TOPIC, with one of these topics:")
    for name in TOPICS:
        terminal.say(f"  {name:{max(map(len, TOPICS))}} {title(name)}")


@app.command("cache", hidden=True)
def cache(
    clear: Annotated[bool, typer.Option("--clear", help="Remove the folders that no running process uses.")] = False,
) -> None:
    """List the folders of compiled code, or remove them; the next wall is then compiled again."""
    import shutil

    from damagepred.kernels.cache_folder import kept_folders
    from damagepred.kernels.process_cache import in_use

    folders = kept_folders()
    for folder in folders:
        files = {found.st_ino: found.st_size for found in map(Path.stat, folder.rglob("*.nb?"))}  # links count once
        used = in_use(folder)
        if clear and not used:
            shutil.rmtree(folder)
        state = "in use" if used else "removed" if clear else "not in use"
        terminal.say(f"{folder}: {sum(files.values()) / 1e6:.0f} MB, {state}")
    if not folders:
        terminal.say("no compiled code is kept")


app.registered_commands.sort(key=lambda command: list(DOING).index(str(command.name)))


def main() -> None:
    """Run the command line; every expected error is one message and an exit code."""
    terminal.FORM.quiet = terminal.FORM.json = False
    terminal.FORM.full = True
    terminal.show_archive_warnings()
    try:
        app(prog_name="damagepred")
    except (InputError, StudyError) as error:
        terminal.say(str(error), error=True)
        sys.exit(BAD_INPUT)
    except SolverError as error:
        terminal.say(str(error), error=True)
        sys.exit(SOME_FAILED)
    except OSError as error:
        terminal.say(f"{error.filename or 'system'}: {error.strerror or error}", error=True)
        sys.exit(BAD_INPUT)
    except SystemExit as ending:
        if isinstance(getattr(ending.__context__, "__cause__", None), KeyboardInterrupt):  # as Typer ends then
            terminal.say("interrupted", error=True)
        if (reason := terminal.lost_output()) and not ending.code:
            terminal.say(f"the output could not be written: {reason}", error=True)
            sys.exit(BAD_INPUT)
        raise
