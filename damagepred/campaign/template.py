"""Commented template studies of ``damagepred new``."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, get_args

from damagepred.archive.files import write_text
from damagepred.errors import InputError

Template = Literal[
    "wall", "mound", "jacks", "control-joint", "seasons", "tree", "end-settlement", "soil-log", "survey", "house"
]
"""Wall on ground of prescribed form; house on a mound of clay; wall on a rig; house with a control joint; wall over
thirty years of seasons; tree at one end; end that settles; ground of a soil log; cracks and levels of a survey; walls
in plan beside a tree, a scene."""
VARIABLES = {"": "joints", "[scene.dpc]": "dpc"}
"""Files with variables that templates end with, by a line that a template must have; its own variables stay alone."""
FOLDER = Path(__file__).parent / "templates"


def template(name: Template, path: Path) -> str:
    """Text of a template for a file, whose name is in its comments."""
    if name not in get_args(Template):
        raise InputError(f"template = '{name}': must be one of {', '.join(get_args(Template))}.")
    text = _text(name)
    parts = {} if name == "house" else VARIABLES  # a scene
    more = [_text(part) for line, part in parts.items() if f"\n{line}" in text]
    text = "\n".join([text, *(part for part in more if part.partition("\n")[0] not in text)])
    return text.replace("{name}", path.name).replace("{stem}", path.stem)


def _text(name: str) -> str:
    return (FOLDER / f"{name}.toml").read_text(encoding="utf-8")


def write_template(path: Path, name: Template = "wall") -> list[Path]:
    """Write a template to a new TOML file, and beside it the observations of a survey; return the files."""
    if path.suffix != ".toml":
        raise InputError(f"{path}: a study is a TOML file; give a name that ends in .toml.")
    texts = {path: template(name, path)}
    if name == "survey":
        texts[path.with_name(f"{path.stem}_observations.toml")] = _text("survey_observations")
    for file in texts:
        if file.exists():
            raise InputError(f"{file}: exists and was not changed; give another name.")
    for file, text in texts.items():
        write_text(file, text)
    return list(texts)
