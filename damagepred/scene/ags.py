"""Soil logs in AGS 4: layers of a borehole, with shrink-swell indices by geology code or by plasticity.

AGS has no shrink-swell index. Correlations with plasticity hold for one geology only: across geologies they misclassify
sites (Johnston and Fityus, Australian Geomechanics). So the indices come from a file of the user.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, nearest
from damagepred.inputs.input_files import read_text
from damagepred.scene.described import build
from damagepred.scene.number_table import Column, read_number_table, split_row
from damagepred.scene.quantity import is_number, to_si
from damagepred.scene.soil import SoilLayer

KEYS = ("file", "borehole", "indices")  # keys of an entry of ``[[soil_layer]]`` that names a file
CODES = ("GEOL_GEOL", "GEOL_GEO2", "GEOL_LEG")  # headings with a code of a layer, in the order of the search
GAP = 1e-3  # gap between layers (m) up to which depths are rounded
NON_PLASTIC = "NP"


@dataclass
class Group:
    """Group of an AGS file."""

    path: Path
    name: str
    headings: list[str] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)
    rows: list[tuple[int, dict[str, str]]] = field(default_factory=list)  # line and cells

    def of_borehole(self, borehole: str) -> list[tuple[int, dict[str, str]]]:
        """Rows of a borehole."""
        return [(line, row) for line, row in self.rows if row.get("LOCA_ID") == borehole]

    def number(self, line: int, row: Mapping[str, str], heading: str, unit: str) -> float:
        """Number (SI) of a cell."""
        cell, written = row.get(heading, ""), self.units.get(heading, "")
        try:
            if not is_number(cell):
                raise ValueError("is no number" if cell else "is empty")
            return to_si(f"{cell} {written}" if written else float(cell), unit)
        except ValueError as error:
            raise InputError(f"{self.path}, line {line}, {heading} = {cell!r} (UNIT {written!r}): {error}.") from None


def read_ags(path: Path) -> dict[str, Group]:
    """Groups of an AGS 4 file, by name."""
    groups: dict[str, Group] = {}
    group = None
    for number, line in enumerate(read_text(path).splitlines(), 1):
        if not line.strip():
            continue
        mark, *cells = split_row(path, number, line.strip(), ",")
        where = f"{path}, line {number}"
        if mark.startswith("*"):
            raise InputError(f'{where}: is AGS 3 ({mark}); convert the file to AGS 4, whose rows begin with "GROUP".')
        if mark == "GROUP" and cells:
            if cells[0] in groups:
                raise InputError(f"{where}: the file has group {cells[0]} twice.")
            group = groups[cells[0]] = Group(path, cells[0])
        elif group is None or mark not in ("HEADING", "UNIT", "TYPE", "DATA"):
            raise InputError(
                f"{where}, column 1 = {mark!r}: a row of AGS 4 begins with GROUP, HEADING, UNIT, TYPE or DATA."
            )
        elif mark == "HEADING":
            group.headings = cells
        elif len(cells) != len(group.headings):
            due = f"the HEADING of {group.name} {len(group.headings)}"
            raise InputError(f"{where}: has {len(cells)} cells after {mark}, {due}.")
        elif mark == "UNIT":
            group.units = dict(zip(group.headings, cells))
        elif mark == "DATA":
            group.rows.append((number, dict(zip(group.headings, cells))))
    if "GEOL" not in groups or not groups["GEOL"].rows:
        raise InputError(f"{path}: has no group GEOL with layers; it has {', '.join(groups) or 'no group'}.")
    headings = groups["GEOL"].headings
    if missing := [heading for heading in ("LOCA_ID", "GEOL_TOP", "GEOL_BASE") if heading not in headings]:
        raise InputError(f"{path}: group GEOL has no heading {missing[0]}; it has {', '.join(headings)}.")
    return groups


class _Indices(NamedTuple):
    """Shrink-swell indices (1) of a file: by code, and by plasticity index (rising)."""

    path: Path
    by_code: dict[str, tuple[float, str]]  # index and name
    plasticity: FloatArray
    of_plasticity: FloatArray

    @classmethod
    def read(cls, path: Path) -> _Indices:
        table = read_number_table(path)
        expected = {"code": Column("", ("geology", "legend")), "plasticity_index": Column("1", ("pi", "ip"))}
        expected |= {"shrink_swell_index": Column("1", ("iss", "i_ss"), required=True), "name": Column("")}
        columns = table.columns(expected | {"remark": Column("")})
        index = table.numbers(columns["shrink_swell_index"], "1", cell_units=True)
        texts = {k: table.cells[columns[k]].tolist() if k in columns else [""] * len(index) for k in expected}
        by_code: dict[str, tuple[float, str]] = {}
        for line, code, value, name, plastic in zip(
            table.cells.index, texts["code"], index.tolist(), texts["name"], texts["plasticity_index"]
        ):
            where, code = f"{path}, line {line}", code.removesuffix(".0")  # numbers of a workbook
            if bool(code) == bool(plastic):
                raise InputError(f"{where}: give a code or a plasticity_index.")
            build(SoilLayer, {"thickness": 1.0, "shrink_swell_index": value, "name": name or None}, where)
            if code in by_code:
                raise InputError(f"{where}, code = {code!r}: is given twice.")
            if code:
                by_code[code] = value, name
        plastic = np.array([text != "" for text in texts["plasticity_index"]])
        points = (
            table.numbers(columns["plasticity_index"], "1", cell_units=True, gaps=True) if plastic.any() else index[:0]
        )
        if len(points) == 1 or (np.diff(points) <= 0).any():
            raise InputError(f"{path}: plasticity_index needs two values or more that rise from line to line.")
        return cls(path, by_code, points, index[plastic])


def soil_layers(entry: Mapping[str, Any], folder: Path) -> list[dict[str, Any]]:
    """Layers (tables of ``[[soil_layer]]``) of a borehole in an AGS 4 file."""
    if unknown := [key for key in entry if key not in KEYS]:
        raise InputError(f"[[soil_layer]] {unknown[0]}: is not read with file; it takes {', '.join(KEYS)}.")
    if wrong := [key for key, value in entry.items() if not isinstance(value, str)]:
        raise InputError(f"[[soil_layer]] {wrong[0]} = {entry[wrong[0]]!r}: must be a text.")
    path = folder / entry["file"]
    groups = read_ags(path)
    geology = groups["GEOL"]
    boreholes = list(dict.fromkeys(row["LOCA_ID"] for _, row in geology.rows))
    borehole = entry.get("borehole", boreholes[0] if len(boreholes) == 1 else None)
    if borehole not in boreholes:
        given = "is missing" if borehole is None else f"= '{borehole}': is not in {path}"
        hint = nearest(borehole or "", boreholes)
        raise InputError(f"[[soil_layer]] borehole {given}; {path} has {', '.join(boreholes)} (LOCA_ID).{hint}")
    if "indices" not in entry:
        raise InputError(
            f"[[soil_layer]] indices: is missing; {path} has no shrink-swell index. Name a CSV file with columns code "
            f"({', '.join(CODES)}) or plasticity_index [%], and shrink_swell_index [%]."
        )
    indices = _Indices.read(folder / entry["indices"])
    layers: list[dict[str, Any]] = []
    bottom, last_code = 0.0, ""
    rows = [(geology.number(line, row, "GEOL_TOP", "m"), line, row) for line, row in geology.of_borehole(borehole)]
    for top, line, row in sorted(rows, key=lambda item: item[0]):
        where, base = f"{path}, line {line}", geology.number(line, row, "GEOL_BASE", "m")
        if abs(top - bottom) > GAP or base <= top:
            raise InputError(
                f"{where}: the layer goes from GEOL_TOP = {top:g} to GEOL_BASE = {base:g} m, and must go down from "
                f"{bottom:g} m, the {'bottom of the layer above' if layers else 'surface'}."
            )
        code, index, name = _index(groups, borehole, (top, base), row, indices, where)
        if layers and (code, index) == (last_code, layers[-1]["shrink_swell_index"]):
            layers[-1]["thickness"] += base - bottom
        else:
            layers.append({"thickness": base - bottom, "shrink_swell_index": index, "name": name})
        bottom, last_code = base, code
    return _with_unique_names(layers)


def _index(
    groups: Mapping[str, Group],
    borehole: str,
    depths: tuple[float, float],
    row: Mapping[str, str],
    indices: _Indices,
    where: str,
) -> tuple[str, float, str]:
    """Code, shrink-swell index and name of a layer: by its code, otherwise by the mean of its plasticity indices."""
    codes = [code for heading in CODES if (code := row.get(heading, ""))]
    for code in codes:
        if code in indices.by_code:
            index, name = indices.by_code[code]
            return code, index, name or code
    plasticity = _plasticity(groups.get("LLPL"), borehole, depths)
    words = f"{where}: {indices.path} has no index for the layer {depths[0]:g} to {depths[1]:g} m"
    words += f" ({row.get('GEOL_DESC', '')[:60]}), code {' or '.join(codes) or 'none'}"
    if not plasticity:
        raise InputError(f"{words}; its group LLPL has no plasticity index there. Add a line with its code.")
    mean = float(np.mean(plasticity))
    if not len(indices.plasticity) or not indices.plasticity[0] <= mean <= indices.plasticity[-1]:
        raise InputError(f"{words}, plasticity index {100 * mean:.3g} %. Add a line for one of them.")
    code = codes[0] if codes else ""
    return code, float(np.interp(mean, indices.plasticity, indices.of_plasticity)), code


def _plasticity(group: Group | None, borehole: str, depths: tuple[float, float]) -> list[float]:
    """Plasticity indices (1) of tests between two depths."""
    values = []
    for line, row in group.of_borehole(borehole) if group else ():
        heading = "SPEC_DPTH" if row.get("SPEC_DPTH") else "SAMP_TOP"
        if group and depths[0] <= group.number(line, row, heading, "m") < depths[1]:
            if NON_PLASTIC in (row.get("LLPL_PI"), row.get("LLPL_PL")):
                values.append(0.0)
            elif row.get("LLPL_PI"):
                values.append(group.number(line, row, "LLPL_PI", "1"))
            else:
                values.append(group.number(line, row, "LLPL_LL", "1") - group.number(line, row, "LLPL_PL", "1"))
    return values


def _with_unique_names(layers: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Layers whose names are words and differ; a layer without a word has no name."""
    seen: list[str] = []
    for layer in layers:
        name = re.sub(r"\W+", "_", layer.pop("name")).strip("_")
        if name and not name[0].isdigit() and name not in ("thickness", "shrink_swell_index", "name"):
            seen.append(name)
            layer["name"] = name if seen.count(name) == 1 else f"{name}_{seen.count(name)}"
    return layers
