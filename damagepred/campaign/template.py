"""The commented studies that ``damagepred new`` writes."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, get_args

from damagepred.archive.files import write_whole
from damagepred.errors import InputError

Template = Literal["wall", "mound", "jacks", "control-joint", "seasons"]
"""A wall on ground of prescribed form; a house on a mound of clay; a wall on a rig; a house with a control joint; a
wall through thirty years of seasons."""


def template(name: Template, path: Path) -> str:
    """Return the text of a template.

    Parameters
    ----------
    name : str
        Which.
    path : Path
        File it is for; its comments name it.
    """
    if name not in get_args(Template):
        raise InputError(f"template = '{name}': must be one of {', '.join(get_args(Template))}.")
    text = (Path(__file__).parent / "templates" / f"{name}.toml").read_text(encoding="utf-8")
    return text.replace("{name}", path.name).replace("{stem}", path.stem)


def write_template(path: Path, name: Template = "wall") -> None:
    """Write a template under a new name.

    Parameters
    ----------
    path : Path
        New file, ending in ``.toml``.
    name : str
        Which template.

    Raises
    ------
    InputError
        If the file exists or has another ending.
    StudyError
        If it cannot be written.
    """
    if path.suffix != ".toml":
        raise InputError(f"{path}: a study is a TOML file; give a name that ends in .toml.")
    if path.exists():
        raise InputError(f"{path}: exists already and is left as it is; give another name.")
    text = template(name, path)
    write_whole(path, lambda p: p.write_text(text, encoding="utf-8"))
