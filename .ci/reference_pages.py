"""Guide pages of all keys and of all archive variables, generated from the code.

python .ci/reference_pages.py
"""

from __future__ import annotations

import dataclasses
import datetime as dt
import inspect
import re
import textwrap
from collections.abc import Iterator, Mapping
from itertools import groupby
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic_core import PydanticUndefined

from damagepred import guide
from damagepred.archive.schema import VARIABLES
from damagepred.archive.schema import Variable as ArchiveVariable
from damagepred.campaign.sampling import Sampling
from damagepred.scene import Corner, GroundSource, PlanMound, PlanWall, Scene
from damagepred.scene.quantity import Quantity
from damagepred.solvers.options import option_classes
from damagepred.uq.importance import Proposal
from damagepred.uq.observations import Observations
from damagepred.uq.stopping import StopWhen
from damagepred.uq.variable import Component, JointField, Variable

STUDY_TABLES: dict[str, type] = {
    "[study]": Sampling,
    "[study.stop_when]": StopWhen,
    '[study.importance."place"]': Proposal,
    '[variables."place"]': Variable,
    '[variables."place".field]': JointField,
    '[[variables."place".components]]': Component,
}

HOUSE_TABLES: dict[str, type] = {
    "[[wall]]": PlanWall,
    "[corner]": Corner,
    "[mound] in plan": PlanMound,
    "[[source]]": GroundSource,
}
"""Tables of a house, with the keys that one wall lacks."""

ADVANCED_TABLES = {f"[solver.advanced.{name}]": kind for name, kind in option_classes().items()}
"""Options of the algorithms, for experts."""

LARGE = 1e4
"""Larger bounds (SI) only catch typing errors, and are not listed."""

KEYS_HEAD = """\
# Keys: every table and key of a scene and a study

A scene file has the tables below at its top level. A study file has them under `[scene.*]`, such as `[scene.wall]`;
or it names a scene file with `scene = "wall.toml"`.

A number without a unit is SI; a string may carry a unit, such as `"8 mm"`. A key with the default *required* must be in
the file where its table is. A key with the default *none* may be left out: its meaning explains None.
`.ci/reference_pages.py` writes this page from the code.
"""
FIRST_KEYS = {
    "wall and openings": "wall.length wall.height wall.thickness wall.block_length wall.block_height opening.kind "
    "opening.x opening.y opening.width opening.height control_joint.x",
    "dpc, loads": "dpc.course dpc.friction loads.roof load.line_load load.y",
    "mortar": "joint.tensile_strength joint.cohesion joint.friction joint.normal_stiffness",
    "footing": "footing.width footing.depth footing.concrete.grade footing.concrete.bottom footing.concrete.top",
    "movement": "movement.shape movement.kind movement.central_deflection movement.increments",
    "ground": "mound.shape mound.surface_movement mound.suction_depth mound.position mound.reach "
    "soil.swelling_stiffness soil.shrinking_stiffness",
    "solver": "solver.accuracy",
    "study": "study.samples study.seed",
    "each variable": "distribution mean cov field",
}
"""Keys of an ordinary study, by subject: the box at the head of the page."""
ARCHIVE_HEAD = '''\
# Archive: every variable of a result

`damagepred solve -o wall.nc` writes a wall. `damagepred study` writes a folder; `damagepred.open_study` reads it.
In a study the dimension `sample` comes first, and sampled inputs have the name of their key, such as
`joint.friction`. A result has only the variables of its scene.

Each variable has its dimensions and its unit in brackets. Flags are whole numbers with the meanings listed; -1 is
unknown. NaN is unknown, too. Files follow the CF conventions 1.11, meshes of zones the UGRID conventions.

`.ci/reference_pages.py` writes this page from the code.

## With xarray and pandas

A wall has no variables of parts that it lacks: without windows and doors there is no dimension `opening`. All flags are
whole numbers, in memory and in files that plain xarray opens; their `valid_range` has the defined values. Where all
samples of a study have the same movement, it is the coordinate `movement` of the dimension `increment`.

```python
import damagepred
import xarray as xr

text = """
[study]
samples = 4
[scene.wall]
length = 1.2
height = 0.3
[scene.movement]
increments = 4
[variables."joint.friction"]
distribution = "uniform"
lower = 0.6
upper = 0.9
"""
with open("small.toml", "w") as file:
    file.write(text)

damagepred.Study.from_toml("small.toml").run("small.dp", workers=1)
study = damagepred.open_study("small.dp")
print(study["movement"].values)  # m, one for each increment
print(study["crack_width_max"].sel(increment=2).values)  # m, one for each sample
print(study.to_dataframe().head())  # one row per sample and increment
print(damagepred.frame(study))  # one row per sample
```

After `import damagepred`, each dataset has the methods of `ds.damagepred`, also a dataset that plain xarray opened. Its
attributes are the variables, such as `curves.damagepred.median`; `curves.median` is the method of xarray.

```python
import damagepred
import xarray as xr

with xr.open_dataset("small.dp/results.nc") as study:
    slight = study.damagepred.category("slight")
    print((study["damage_category"] >= slight).mean("sample").values)
    print(study.damagepred.exceedance("slight", at="4 mm").estimate)
    print(study.damagepred.status.values)
```

`damagepred.to_arviz(study)` gives the study to ArviZ (`pip install "damagepred[arviz]"`). Inputs are the group `prior`,
results `prior_predictive`. ArviZ supports neither weights nor failed samples: select the samples first.
'''


TABLE_HEAD = ("| key | unit | default | range | meaning |", "|---|---|---|---|---|")


def _scene_tables(kind: Any, inside: str = "") -> Iterator[tuple[str, type]]:
    """Heading and class of each table of a file, from the fields of the classes."""
    for name, field in kind.__pydantic_fields__.items():
        inner = list(_parts(field.annotation))
        for kind_inside in inner:
            if isinstance(kind_inside, type) and dataclasses.is_dataclass(kind_inside):
                head = f"{inside}{name}"
                yield f"[[{head}]]" if any(get_origin(p) is tuple for p in inner) else f"[{head}]", kind_inside
                yield from _scene_tables(kind_inside, f"{head}.")


def _tables(kind: type) -> list[str]:
    """Section of each class of the tables inside a class, under its first heading."""
    heads: dict[type, str] = {}
    for head, inner in _scene_tables(kind):
        heads.setdefault(inner, head)  # [footing.joint] has the keys of [joint]
    return [_table(head, inner) for inner, head in heads.items()]


def keys_page() -> str:
    """Page of all keys of scenes and studies."""
    box = [f"> - {subject}: {', '.join(f'`{k}`' for k in keys.split())}" for subject, keys in FIRST_KEYS.items()]
    first = ["> **Keys you will set**", ">", *box, ""]
    title = "| `title` | text | `masonry wall` | | Description of the wall. |"
    parts = [KEYS_HEAD, *first, "## The scene\n", *TABLE_HEAD, title, ""]
    parts += _tables(Scene)
    parts += ["## A house\n", *(_table(head, kind, own=True) for head, kind in HOUSE_TABLES.items())]
    parts += ["## The study\n", "`[correlation]` has a table of partners for a variable, each with its correlation.\n"]
    parts += [_table(name, kind) for name, kind in STUDY_TABLES.items()]
    parts += ["## A survey\n", "Observations of `damagepred infer`, in a file of their own.\n", *_tables(Observations)]
    parts += ["## The algorithms, for experts\n", "Every archive records all of these as `solver_options`.\n"]
    parts += [_table(name, kind) for name, kind in ADVANCED_TABLES.items()]
    return "\n".join(parts)


def archive_page() -> str:
    """Page of all variables of archives."""
    groups: dict[str, list[str]] = {}
    for name, variable in VARIABLES.items():
        groups.setdefault(_group(variable), []).append(_variable(name, variable))
    parts = [f"## {group}\n\n" + "\n".join(lines) + "\n" for group, lines in groups.items()]
    return "\n".join([ARCHIVE_HEAD, *parts])


def _table(name: str, kind: type, own: bool = False) -> str:
    """Section of one table: description and keys."""
    head, texts = described_fields(kind)
    if own or kind is Component:
        shown = [f for f in dataclasses.fields(kind) if f.name in texts]
    else:
        for base in kind.__mro__[1:]:
            if dataclasses.is_dataclass(base):
                texts = described_fields(base)[1] | texts
        shown = list(dataclasses.fields(kind))
    names = [field.name for field in shown if field.name in texts]
    rows = [_keys(kind, list(group), text) for text, group in groupby(names, texts.__getitem__)]
    more = '\n\nAlso the keys of `[variables."place"]` except `components` and `field`.' if kind is Component else ""
    return f"### `{name}`\n\n{_wrapped(head + more)}\n\n" + "\n".join([*TABLE_HEAD, *rows]) + "\n"


def described_fields(kind: type) -> tuple[str, dict[str, str]]:
    """Description of a class, and of each of its attributes, from its docstring (numpydoc)."""
    described, _, _ = inspect.cleandoc(kind.__doc__ or "").partition("\nExamples\n--------\n")
    head, _, attributes = described.partition("\nAttributes\n----------\n")
    texts = re.findall(r"^(\w[\w, ]*) : [^\n]*\n((?:(?:    .*)?\n?)*)", attributes, re.MULTILINE)
    return _markdown(head), {
        n: _markdown(textwrap.dedent(text)) for names, text in texts for n in re.split(r",\s*", names)
    }


def _markdown(text: str) -> str:
    """Markdown of reStructuredText literals, with each paragraph on one line."""
    paragraphs = re.split(r"\n\s*\n", text.strip().replace("``", "`"))
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)


def _wrapped(text: str, indent: str = "") -> str:
    return "\n\n".join(
        textwrap.fill(paragraph, 118, subsequent_indent=indent, break_on_hyphens=False, break_long_words=False)
        for paragraph in text.split("\n\n")
    )


def _keys(kind: Any, names: list[str], text: str) -> str:
    """Row of a key, or of several keys with one text; the meaning repeats no unit that has its own column."""
    fields = [kind.__pydantic_fields__[name] for name in names]
    facts = ({_type(f) for f in fields}, {_default(f) for f in fields}, {", ".join(_bounds(f)) for f in fields})
    unit, default, bounds = (values.pop() if len(values) == 1 else "" for values in facts)
    meaning = text.replace(f" ({'1' if unit == 'no unit' else unit})", "").replace("\n\n", " ").replace("|", r"\|")
    return f"| {', '.join(f'`{name}`' for name in names)} | {unit} | {default} | {bounds} | {meaning} |"


def _parts(annotation: Any) -> Iterator[Any]:
    """An annotation and everything nested in it."""
    yield annotation
    for nested in (*get_args(annotation), *getattr(annotation, "__metadata__", ())):
        yield from _parts(nested)


def _all(field: Any) -> list[Any]:
    return [*field.metadata, *_parts(field.annotation)]


def _type(field: Any) -> str:
    """Unit, allowed words, or type of a key."""
    inside = _all(field)
    if any(get_origin(nested) in (dict, Mapping) for nested in inside):
        return "table"
    if units := [nested.unit for nested in inside if isinstance(nested, Quantity)]:
        return _unit(units[0])
    for nested in inside:
        if get_origin(nested) is Literal:
            return " or ".join(f"`{word}`" for word in get_args(nested))
        if isinstance(nested, type) and dataclasses.is_dataclass(nested):
            return "table"
    names = {bool: "true or false", int: "whole number", float: "number", dt.date: "date", str: "text"}
    return next((word for kind, word in names.items() if kind in inside), "")


def _unit(unit: str) -> str:
    return "no unit" if unit == "1" else unit.replace("**", "").replace("*", " ")


def _default(field: Any) -> str:
    value = field.get_default(call_default_factory=True)
    if value is PydanticUndefined:
        return "required"
    if value is None or value in ((), {}, ""):
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return ", ".join(f"`{item}`" if isinstance(item, str) else f"{item:g}" for item in value)
    return f"`{value}`" if isinstance(value, str) else f"{value:g}"


def _bounds(field: Any) -> list[str]:
    """Range of a number in words, without bounds that only catch typing errors."""
    words = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}
    bounds: dict[str, float] = {}
    for mark in _all(field):
        for sign, tightest in (("gt", max), ("ge", max), ("lt", min), ("le", min)):
            value = getattr(mark, sign, None)
            if isinstance(value, int | float) and abs(value) < LARGE:
                bounds[sign] = tightest(bounds.get(sign, value), value)
    if "gt" in bounds and "ge" in bounds:
        bounds.pop("ge" if bounds["ge"] <= bounds["gt"] else "gt")
    return [f"{words[sign]} {value:g}" for sign, value in bounds.items()]


def _group(variable: ArchiveVariable) -> str:
    """Heading of a variable of an archive, by its last dimension."""
    names = {
        "increment": "Of the wall, increment by increment",
        "sample": "Of a sample of a study",
        "group_count": "Of groups of cracks",
        "opening": "Of openings",
        "support": "Of supports",
        "jack": "Of jacks",
        "section": "Of sections of the footing",
        "block": "Of blocks",
        "vertex": "Of corners of blocks",
        "contact": "Of contacts",
        "zone": "Of zones",
        "gridpoint": "Of gridpoints",
    }
    last = variable.dims[-1] if variable.dims else ""
    return names.get(last, "Of the mesh of zones")


def _variable(name: str, variable: ArchiveVariable) -> str:
    facts = [", ".join(variable.dims) or "no dimension"]
    facts += [_unit(variable.units)] if variable.units else []
    flags = "; ".join(f"{number} {word}" for number, word in enumerate(variable.flags))
    return _wrapped(
        f"- `{name}` ({'; '.join(facts)}): {variable.long_name}." + (f" Flags: {flags}." if flags else ""), "  "
    )


PAGES = {"keys": keys_page, "archive": archive_page}
"""Topic -> function that writes its page."""


def main() -> None:
    """Write the pages into the guide."""
    for topic, write in PAGES.items():
        (Path(guide.__file__).parent / f"{topic}.md").write_text(write(), encoding="utf-8")


if __name__ == "__main__":
    main()
