"""Mutated files that a user could give: each is refused in a sentence, fails by name, or has a finite result.

    python studies/fuzz/run.py [--count 1000] [--seed 1] [--solved 0.05] [--out FOLDER]

The seed and the number of a file determine it. Tables are mutated as tables (keys removed, renamed, retyped, moved
between files; numbers made extreme; other units; deep nesting), and their text as bytes. Accepted small walls are built
and solved with a time limit.
"""

from __future__ import annotations

import argparse
import copy
import csv
import math
import os
import resource
import signal
import sys
import tempfile
import time
import tomllib
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import tomli_w

from damagepred import Limits, Scene, Study, solve
from damagepred.assembly import wall_cost
from damagepred.campaign.sample import solve_sample
from damagepred.damage import read_table
from damagepred.errors import LONGEST_MESSAGE, DamagepredError, InputError, SolverError
from damagepred.inputs.data_files import data_file
from damagepred.inputs.text import controls_escaped
from damagepred.one_wall.judged_path import model_of

GOOD = ("solved", "refused", "failed by name", "accepted")
"""Correct outcomes; all others are defects."""
COLUMNS = ("number", "kind", "changes", "outcome", "seconds", "message")


@dataclass(frozen=True)
class Options:
    """Options of the campaign: times in s of the processor, memory in bytes, shares of the files."""

    limits: Limits = Limits(memory=3e8, estimated_time=3.0, time=8.0)  # noqa: RUF009 - frozen
    solved_share: float = 0.3
    patience: float = 40.0
    most_changes: int = 4
    mild: float = 0.5
    damaged_bytes: float = 0.1
    memory: float = 1e9


class Hang(BaseException):
    """A file took longer than the patience."""


class Tried(NamedTuple):
    """Outcome of a file."""

    number: int
    kind: str
    changes: str
    outcome: str
    seconds: float
    message: str


# -- files to start from ----------------------------------------------------------------------------------------------

SMALL = {"wall": {"length": 1.44, "height": 0.45}, "movement": {"central_deflection": "4 mm", "increments": 3}}
SCENES: dict[str, dict[str, Any]] = {
    "solid": {"title": "a small wall", "dpc": {"course": 1, "friction": 0.5}, "loads": {"roof": "2 kN"}},
    "window": {
        "wall": {"length": 2.4, "height": 0.9, "bond": "stack"},
        "opening": [{"kind": "window", "x": 0.72, "y": 0.3, "width": "480 mm", "height": 0.3}],
        "joint": {"tensile_strength": "0.1 MPa", "cohesion": "0.1 MPa", "fracture_energy": 10.0, "friction": 0.7},
    },
    "explicit": {
        "solver": {"method": "explicit", "ramp_cycles": 500, "maximum_cycles": 5000, "tolerance": 0.01},
        "control_joint": [{"x": 0.72, "width": "10 mm"}],
    },
    "deformable": {
        "wall": {"length": 0.96, "height": 0.3},
        "solver": {"blocks": "deformable", "zone_size": 0.075},
        "block": {"cohesion": "1 MPa", "elastic_modulus": "9000 MPa", "density": 2000.0},
    },
    "mound": {
        "movement": {"shape": "mound", "kind": "doming", "increments": 3},
        "mound": {"shape": "walsh", "surface_movement": "20 mm", "suction_depth": 2.3},
        "soil": {"swelling_stiffness": "4000 kPa/m", "friction": 0.5},
        "footing": {"width": 0.4, "depth": 0.5},
    },
    "jacks": {
        "movement": {"shape": "jacks", "increments": 3, "central_deflection": "2 mm"},
        "rig": {"supports": [0.0, 1.44], "jacks": [0.4, 0.72, 1.0], "support": "lift_off"},
    },
    "in time": {
        "dynamics": {
            "duration": 0.05,
            "outputs": 3,
            "damping": "viscous",
            "contact_damping": 0.3,
            "base": [{"kind": "half_sine", "acceleration": 3.0, "duration": "20 ms"}],
        },
        "joint": {"tensile_strength": 0.0, "cohesion": 0.0},
    },
    "record": {"dynamics": {"duration": 0.05, "outputs": 2, "base": [{"file": "record.csv", "scale": 2.0}]}},
}
VARIABLES: dict[str, dict[str, Any]] = {
    "joint.tensile_strength": {
        "distribution": "lognormal",
        "mean": "0.1 MPa",
        "cov": 0.3,
        "field": {"course_correlation": 0.4},
    },
    "joint.cohesion": {
        "distribution": "gamma",
        "mean": "0.1 MPa",
        "std": "0.03 MPa",
        "field": {"correlation_length": 0.4, "over": "wall"},
    },
    "joint.friction": {"distribution": "truncated_normal", "mean": 0.75, "cov": 0.2, "lower": 0.3, "upper": 1.2},
    "block.density": {"distribution": "uniform", "lower": 1800, "upper": 2200},
    "block.elastic_modulus": {"distribution": "discrete", "values": ["5 GPa", "9 GPa"], "weights": [1, 2]},
    "movement.central_deflection": {"distribution": "beta", "lower": 0.0, "upper": "8 mm", "alpha": 2, "beta": 3},
    "joint.normal_stiffness": {"distribution": "scipy", "name": "weibull_min", "parameters": {"c": 3, "scale": 8e10}},
    "joint.shear_stiffness": {"distribution": "empirical", "file": "column.csv", "column": "k", "unit": "N/mm3"},
    "loads.roof": {
        "distribution": "mixture",
        "components": [
            {"weight": 1, "distribution": "normal", "mean": 2000, "cov": 0.1},
            {"weight": 2, "distribution": "lognormal", "median": 3000, "dispersion": 0.2},
        ],
    },
}
STUDIES: dict[str, dict[str, Any]] = {
    "fields": {
        "study": {"samples": 4, "seed": 3, "replicates": 2},
        "of": ["joint.tensile_strength", "joint.friction", "movement.central_deflection"],
        "correlation": {"joint.friction": {"movement.central_deflection": 0.3}},
    },
    "by distance": {"study": {"sampler": "random", "movement": "both"}, "of": ["joint.cohesion", "block.density"]},
    "families": {
        "study": {"sampler": "lhs", "stop_at_category": 3},
        "of": ["block.elastic_modulus", "joint.normal_stiffness", "joint.shear_stiffness", "loads.roof"],
    },
    "samples": {"study": {"sampler": "table", "table": "samples.csv"}, "of": []},
}
CSV = {
    "record.csv": "time,acceleration\n0,0\n0.01,1.5\n0.02,-1.5\n0.03,0\n",
    "column.csv": "name,k\na,30\nb,36\nc,41\n",
    "samples.csv": "joint.friction,block.density [kg/m3],weight\n0.7,2000,1\n0.8,1900,2\n0.6,2100 kg/m3,1\n",
}

# -- mutations --------------------------------------------------------------------------------------------------------

NUMBERS = (
    *(0, -1, 1, 2, 7, 1000, 0.5, 1e-3, 1e5, 1e-9, 1e9, 1e15),
    *(1e308, -1e308, 5e-324, 1e-300, 2**62, -(2**63), math.nan, math.inf, -math.inf),
)
UNITS = ("mm", "m", "km", "kg", "MPa", "N/mm3", "%", "furlong", "K", "N", "s", "degree", "µm", "1/m", "")
WORDS = (
    *("", " ", "nan", "inf", "1e400", "9" * 400, "x" * 3000, "a\0b", "\x1b[31m", "[/]", "$x_{$", "Löwe"),
    *("../x", "/dev/zero", "none", "true", "8,5 mm", "1 mm 2", "__class__", "\u202e", "=1+1"),
    *("quasi_static", "deformable", "mound"),
)
OTHERS: tuple[Any, ...] = (True, [], {}, [[]], [1, "a", {}], {"a": {"b": 1}}, "text", 3, 2.5, [[0, 0], [1, 1]])


def places(node: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the places of all values in nested tables and lists."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from places(value, (*path, key))


def holder_of(tables: dict[str, Any], path: tuple[Any, ...]) -> Any:
    """Return the table or list that holds the value at a place."""
    for key in path[:-1]:
        tables = tables[key]
    return tables


def scale(tables: dict[str, Any], rng: np.random.Generator) -> str:
    """Make one number of nested tables larger or smaller, in place; return a description."""
    found = [p for p in places(tables) if type(holder_of(tables, p)[p[-1]]) in (int, float)]
    if not found:
        return "nothing to scale"
    path = found[rng.integers(len(found))]
    holder, key = holder_of(tables, path), path[-1]
    factor = 10.0 ** rng.normal(0.0, 1.5)
    holder[key] = type(holder[key])(holder[key] * factor)
    return f"scaled {'.'.join(map(str, path))}"


def mutate(tables: dict[str, Any], others: list[dict[str, Any]], rng: np.random.Generator) -> str:
    """Change one entry of nested tables, in place; return a description."""
    found = list(places(tables))
    if not found:
        tables["wall"] = {}
        return "made a table"
    path = found[rng.integers(len(found))]
    holder, key = holder_of(tables, path), path[-1]
    value = holder[key]
    at = ".".join(map(str, path))
    match rng.integers(10):
        case 0:
            del holder[key]
            return f"removed {at}"
        case 1 if isinstance(holder, dict):
            holder[f"{key}{rng.choice(['x', '_', ' ', '.a'])}"] = holder.pop(key)
            return f"renamed {at}"
        case 2:
            holder[key] = copy.deepcopy(OTHERS[rng.integers(len(OTHERS))])
            return f"retyped {at}"
        case 3:
            holder[key] = WORDS[rng.integers(len(WORDS))]
            return f"word for {at}"
        case 4:
            holder[key] = f"{rng.choice([1, 2.5, -3, 1e-3, 1e6])} {UNITS[rng.integers(len(UNITS))]}"
            return f"unit of {at}"
        case 5 if isinstance(value, int | float) and not isinstance(value, bool):
            holder[key] = value * 10.0 ** int(rng.integers(-8, 9))
            return f"scaled {at}"
        case 6:
            other = others[rng.integers(len(others))]
            taken = list(other)[rng.integers(len(other))]
            (tables if rng.random() < 0.7 or not isinstance(holder, dict) else holder)[taken] = copy.deepcopy(
                other[taken]
            )
            return f"took {taken} from another file"
        case 7:
            for _ in range(int(rng.choice([2, 10, 60, 400]))):
                value = {"a": value} if rng.random() < 0.5 else [value]
            holder[key] = value
            return f"nested {at}"
        case 8 if isinstance(value, list):
            holder[key] = value * int(rng.choice([2, 50, 1000])) if rng.random() < 0.6 else value[::-1]
            return f"repeated or turned {at}"
        case _:
            holder[key] = NUMBERS[rng.integers(len(NUMBERS))]
            return f"number at {at}"


def damage_text(content: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    """Change the bytes of a text; return them and a description."""
    text = bytearray(content)
    where = int(rng.integers(len(text) + 1))
    lines = content.splitlines(keepends=True)
    match rng.integers(9):
        case 0 if text:
            text[min(where, len(text) - 1)] ^= 1 << int(rng.integers(8))
            return bytes(text), "flipped a bit"
        case 1:
            return bytes(text[:where]), "cut off the end"
        case 2:
            return bytes(text[:where] + rng.bytes(int(rng.integers(1, 9))) + text[where:]), "put bytes in"
        case 3 if lines:
            line = int(rng.integers(len(lines)))
            return b"".join([*lines[:line], lines[line], *lines[line:]]), "wrote a line twice"
        case 4 if lines:
            line = int(rng.integers(len(lines)))
            return b"".join(lines[:line] + lines[line + 1 :]), "left a line out"
        case 5:
            return b"\xef\xbb\xbf" + content.replace(b"\n", b"\r\n"), "byte order mark and Windows' lines"
        case 6:
            return content.decode().encode("utf-16"), "UTF-16"
        case 7:
            return bytes(text[:where] + b"[" * int(rng.choice([1, 50, 5000])) + text[where:]), "put brackets in"
        case _:
            return content.replace(b",", b";").replace(b"=", b"==", 1), "other separators"


def scene_of(name: str) -> dict[str, Any]:
    """Return the tables of one of the scenes."""
    tables = copy.deepcopy(SMALL)
    for key, value in copy.deepcopy(SCENES[name]).items():
        tables[key] = tables[key] | value if isinstance(value, dict) and key in tables else value
    return tables


def study_of(name: str, scene: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of one of the studies."""
    how = copy.deepcopy(STUDIES[name])
    return {
        "study": how["study"] | {"samples": how["study"].get("samples", 4)},
        "scene": scene,
        "variables": {place: copy.deepcopy(VARIABLES[place]) for place in how["of"]},
        "correlation": how.get("correlation", {}),
    }


def written(folder: Path, number: int, seed: int, options: Options) -> tuple[str, Path, str]:
    """Write a mutated file and all files that it names; return its kind, path, and changes."""
    rng = np.random.default_rng((seed, number))
    names = list(SCENES)
    scenes = [scene_of(name) for name in names]
    kind = str(rng.choice(["scene", "study", "damage table", "csv"], p=[0.5, 0.3, 0.1, 0.1]))
    base = names[rng.integers(len(names))]
    tables, damaged = scene_of(base), "wall.toml"
    if kind == "damage table":
        tables = tomllib.loads(data_file("damage", f"{rng.choice(['as2870', 'bre251'])}.toml").read_text("utf-8"))
    elif kind == "csv":
        damaged = str(rng.choice(list(CSV)))
        which = {"column.csv": "families", "samples.csv": "samples"}
        tables = scene_of("record") if damaged == "record.csv" else study_of(which[damaged], scene_of("solid"))
    elif kind == "study":
        tables = study_of(str(rng.choice(list(STUDIES))), scene_of(str(rng.choice(names[:6]))))
    changes = []
    if kind != "csv":
        mild = rng.random() < options.mild
        times = range(int(rng.integers(1, options.most_changes + 1)))
        changes = [scale(tables, rng) if mild else mutate(tables, scenes, rng) for _ in times]
    contents = {name: text.encode() for name, text in CSV.items()}
    try:
        contents["wall.toml"] = tomli_w.dumps(tables).encode("utf-8", "surrogatepass")
    except (RecursionError, TypeError, ValueError):
        contents["wall.toml"] = repr(tables).encode()
    if kind == "csv":
        cells = contents[damaged].decode().replace("\n", ",\n,").split(",")
        for _ in range(int(rng.integers(1, 4))):
            cells[rng.integers(len(cells))] = str(rng.choice([*map(str, NUMBERS), *WORDS[:8], "1 kg", '"', "#"]))
            changes.append("cell")
        contents[damaged] = ",".join(cells).replace(",\n,", "\n").encode()
    if rng.random() < options.damaged_bytes or (kind == "csv" and rng.random() < 0.5):
        contents[damaged], how = damage_text(contents[damaged], rng)
        changes.append(how)
    for name, content in contents.items():
        (folder / name).write_bytes(content)
    return (
        f"{kind}: {damaged if kind == 'csv' else base if kind == 'scene' else ''}".rstrip(": "),
        folder,
        ", ".join(changes),
    )


# -- trying a file ----------------------------------------------------------------------------------------------------


@contextmanager
def patience(seconds: float) -> Iterator[None]:
    """Raise ``Hang`` when the time is over."""

    def stop(number: int, frame: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)  # processor time of this process, because of other load
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


FINITE = (
    *("block_displacement_x", "block_displacement_y", "block_rotation", "contact_opening", "contact_slip"),
    *("contact_normal_stress", "contact_shear_stress", "crack_width_max", "crack_band_width_max"),
    *("base_reaction", "deflection_ratio", "central_deflection"),
)


def not_finite(values: Any) -> list[str]:
    """Return the names of results that must be finite and are not."""
    return [name for name in FINITE if name in values and not np.isfinite(np.asarray(values[name])).all()]


def attempt(kind: str, folder: Path, solved: bool, options: Options) -> tuple[str, str]:
    """Read a file, and build or solve what it describes; return the outcome and a message."""
    file = folder / "wall.toml"
    if kind == "damage table":
        table = read_table(file)
        found = table.by_width_and_group(np.array([0.0, 0.004, 1.0]), 0.003)
        return ("accepted", "") if 0 <= found.min() <= found.max() <= table.highest else ("wrong", str(found))
    study = kind.startswith("study") or kind in ("csv: column.csv", "csv: samples.csv")
    if study:
        made = Study.from_toml(file, options.limits)
        scene, fields = made.sample(0)
        if solved:
            row = solve_sample(made.settings, made.design, 0, _values(made))
            if row.reason == "error":
                return "traceback in a sample", row.outcome.message
            return ("failed by name" if row.reason else "solved"), row.outcome.message
    else:
        scene, fields = Scene.from_toml(file), {}
    if not solved:
        wall_cost(scene).require(options.limits)
        model_of(scene, fields)
        return "accepted", ""
    ds = solve(scene, fields=fields, limits=options.limits, on_failure="return")
    if wrong := not_finite(ds):
        return "not finite", f"{ds.attrs['status']}: {', '.join(wrong)}"
    if ds.attrs["status"] == "failed":
        return "failed by name", str(ds.attrs["status_message"])
    return "solved", str(ds.attrs["status"])


def _values(study: Study) -> dict[str, float]:
    values = study.design.wall_values(study.settings.study.samples)
    return {place: float(v[0]) for place, v in values.items()}


def try_file(number: int, seed: int, options: Options, folder: Path) -> Tried:
    """Make a file, try it, and return its outcome."""
    kind, place, changes = written(folder, number, seed, options)
    solved = np.random.default_rng((seed, number, 1)).random() < options.solved_share
    before, began, here = _peak(), time.perf_counter(), Path.cwd()
    os.chdir(place)
    try:
        with patience(options.patience), warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always", RuntimeWarning)
            outcome, message = attempt(kind, place, solved, options)
    except InputError as error:
        outcome, message = "refused", controls_escaped(str(error))
    except (SolverError, DamagepredError) as error:
        outcome, message = "failed by name", controls_escaped(f"{type(error).__name__}: {error}")
    except Hang:
        outcome, message = "hang", ""
    except Exception as error:
        outcome, message = "traceback", f"{type(error).__name__}: {error}"
    finally:
        os.chdir(here)
    if outcome in GOOD:
        if noise := [w for w in warned if issubclass(w.category, RuntimeWarning) and "damagepred" in w.filename]:
            outcome, message = (
                "warning",
                f"{outcome}: {Path(noise[0].filename).name}:{noise[0].lineno}: {noise[0].message}",
            )
        elif bad_message(outcome, message):
            outcome = "bad message"
        elif _peak() - before > options.memory:
            outcome, message = "memory", f"{outcome}: {(_peak() - before) / 1e9:.2g} GB"
    return Tried(number, kind, changes, outcome, time.perf_counter() - began, message)


def bad_message(outcome: str, message: str) -> bool:
    """Return whether a message is too long, missing, or contains unprintable text."""
    missing = outcome in ("refused", "failed by name") and not message.strip()
    return missing or len(message) > LONGEST_MESSAGE or "Traceback" in message or "\x1b" in message


def _peak() -> float:
    return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


# -- many files -------------------------------------------------------------------------------------------------------


def read_log(log: Path) -> list[Tried]:
    """Read the rows of earlier runs; an incomplete last line is ignored."""
    if not log.is_file():
        return []
    with log.open(encoding="utf-8", newline="") as stream:
        rows = [row for row in csv.reader(stream) if len(row) == len(COLUMNS) and row[0].isdigit()]
    return [Tried(int(n), kind, changes, outcome, float(s), said) for n, kind, changes, outcome, s, said in rows]


def run(
    count: int,
    seed: int,
    out: Path,
    options: Options = Options(),
    say: Callable[[str], None] = print,
) -> list[Tried]:
    """Try files and write ``files.csv`` and ``files_summary.csv``; the same call resumes an interrupted run."""
    out.mkdir(parents=True, exist_ok=True)
    log = out / "files.csv"
    known = read_log(log)[:count]
    began = time.perf_counter()
    if options.solved_share > 0 and len(known) < count:
        warm_up()
    with log.open("w", encoding="utf-8", newline="") as stream, tempfile.TemporaryDirectory() as folder:
        writer = csv.writer(stream)
        writer.writerow(COLUMNS)
        writer.writerows(_row(tried) for tried in known)
        for number in range(len(known), count):
            tried = try_file(number, seed, options, Path(folder))
            writer.writerow(_row(tried))
            stream.flush()
            known.append(tried)
            if tried.outcome not in GOOD:
                say(f"{number}: {tried.outcome}: {tried.kind}: {tried.changes}: {tried.message[:200]}")
            if (number + 1) % max(count // 40, 1) == 0:
                say(f"{number + 1} of {count} files, {time.perf_counter() - began:.0f} s")
    (out / "files_summary.csv").write_text(summary(known), encoding="utf-8")
    return known


def warm_up() -> None:
    """Compile all kernels, so that no file's time includes it."""
    for name in SCENES:
        if name != "record":
            solve(Scene.from_dict(scene_of(name)), on_failure="return")


def _row(tried: Tried) -> list[Any]:
    said = tried.message if tried.outcome not in GOOD else tried.message[:120]
    plain = said.encode("ascii", "backslashreplace").decode().replace("\n", " | ").replace("\r", " ").replace("\0", " ")
    return [tried.number, tried.kind, tried.changes.replace("\0", " "), tried.outcome, f"{tried.seconds:.3f}", plain]


def summary(tried: list[Tried]) -> str:
    """Return a table of kinds and outcomes: files, and the longest time."""
    counted = Counter((t.kind.split(":")[0], t.outcome) for t in tried)
    lines = ["kind,outcome,files,longest_s"]
    for (kind, outcome), files in sorted(counted.items()):
        longest = max(t.seconds for t in tried if (t.kind.split(":")[0], t.outcome) == (kind, outcome))
        lines.append(f"{kind},{outcome},{files},{longest:.1f}")
    return "\n".join(lines) + "\n"


def defects(tried: list[Tried]) -> list[Tried]:
    """Return the files with a defect."""
    return [t for t in tried if t.outcome not in GOOD]


def main() -> int:
    """Run, print the summary, and return an exit code: 1 where there are defects."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000, help="files in all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--solved", type=float, default=0.05, help="share of accepted files that are solved")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder of log and summary")
    given = parser.parse_args()
    options = Options(solved_share=given.solved)
    found = run(given.count, given.seed, given.out, options, lambda text: print(text, flush=True))
    sys.stdout.write(summary(found))
    return 1 if defects(found) else 0


if __name__ == "__main__":
    sys.exit(main())
