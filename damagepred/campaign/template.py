"""Commented template studies of ``damagepred new``."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, get_args

from damagepred.archive.files import write_whole
from damagepred.errors import InputError

Template = Literal["wall", "mound", "jacks", "control-joint", "seasons"]
"""Wall on ground of prescribed form; house on a mound of clay; wall on a rig; house with a control joint; wall over
thirty years of seasons."""


def template(name: Template, path: Path) -> str:
    """Text of a template for a file, whose name is in its comments."""
    if name not in get_args(Template):
        raise InputError(f"template = '{name}': must be one of {', '.join(get_args(Template))}.")
    text = (Path(__file__).parent / "templates" / f"{name}.toml").read_text(encoding="utf-8")
    return text.replace("{name}", path.name).replace("{stem}", path.stem)


def write_template(path: Path, name: Template = "wall") -> None:
    """Write a template to a new TOML file."""
    if path.suffix != ".toml":
        raise InputError(f"{path}: a study is a TOML file; give a name that ends in .toml.")
    if path.exists():
        raise InputError(f"{path}: exists and was not changed; give another name.")
    text = template(name, path)
    write_whole(path, lambda p: p.write_text(text, encoding="utf-8"))
