"""Reinforced concrete of a footing: grade and trench mesh by name, law of cracking."""

from __future__ import annotations

import re
from functools import partial
from math import sqrt
from typing import Literal

from pydantic import Field, model_validator

from damagepred.errors import nearest
from damagepred.inputs.data_files import data_tables
from damagepred.scene.described import described
from damagepred.scene.quantity import Length, Moment, Pressure, Pure

_tables = partial(data_tables, "materials", "concrete.toml")
_MESH = re.compile(r"\s*(\d{1,2})\s*[-x]?\s*([A-Za-z]\w*)\s*")


@described
class ReinforcedConcrete:
    """Reinforced concrete of the footing (``[footing.concrete]``): cracks, and its steel yields.

    Names and values come from the shipped table ``materials/concrete.toml``, which has their sources.

    Examples
    --------
    >>> from damagepred import ReinforcedConcrete
    >>> ReinforcedConcrete(grade="N32", bottom="4-L12TM", top="3-L11TM").cover
    0.04
    """

    law: Literal["cracked", "branson"] = "cracked"
    """"cracked": a cracked and an uncracked state share the length of the beam (Ghali and Favre; EN 1992-1-1 7.4.3).
    Steel yields, and axial force counts. "branson": an effective second moment of area between the gross and the
    cracked one, whatever the axial force; its steel does not yield."""
    grade: str = "N25"
    """N20, N25, N32, N40 or N50: the characteristic cylinder strength f'c in MPa."""
    bottom: str = "3-L11TM"
    """Trench mesh as on drawings, "3-L11TM" for three wires of L11TM: L8TM, L11TM or L12TM."""
    top: str | None = None
    """Trench mesh at the top; "none" (or "") for no mesh. None: the same as the bottom."""
    cover: Length = Field(default=0.04, ge=0)
    """Distance from the face of the concrete to the wires (m)."""
    elastic_modulus: Pressure | None = Field(default=None, gt=0)
    """E_c (Pa); None takes the mean value of AS 3600 for the grade."""
    tensile_strength: Pressure | None = Field(default=None, gt=0)
    """Tensile strength in bending (Pa), at which the outermost fibre cracks; None takes 0.6 sqrt(f'c), f'c in MPa (AS
    3600)."""
    tension_stiffening: Pure = Field(default=1.0, ge=0, le=1)
    """beta (1) of EN 1992-1-1 7.4.3: 1 for a first short load, 0.5 for sustained or repeated ones."""
    steel_modulus: Pressure = Field(default=200e9, gt=0)
    """E_s of the wires (Pa)."""
    steel_strength: Pressure = Field(default=500e6, gt=0)
    """Yield strength of the wires (Pa)."""
    hardening: Pure = Field(default=0.006, ge=1e-4, lt=1)
    """Slope of the wires' stress after yield over E_s (1)."""
    branson_exponent: Pure = Field(default=3.0, ge=1, le=6)
    """Exponent of M_cr / M in Branson's formula (1): 3 for a whole beam, 4 for one section."""
    earlier_moment: Moment = Field(default=0.0, ge=0)
    """Largest earlier moment of every section, sagging and hogging (Nm), which has cracked it."""

    @model_validator(mode="after")
    def _known_names(self) -> ReinforcedConcrete:
        grades = list(_tables()["grade"])
        if self.grade not in grades:
            hint = nearest(self.grade.upper(), grades)
            raise ValueError(f"grade = '{self.grade}': must be one of {', '.join(grades)}.{hint}")
        self.bottom_wires  # noqa: B018 - reading the names checks them
        self.top_wires  # noqa: B018
        if self.steel_modulus <= self.concrete_modulus:
            raise ValueError(
                f"steel_modulus = {self.steel_modulus:g}: must exceed the concrete's, {self.concrete_modulus:g} Pa"
            )
        return self

    @property
    def compressive_strength(self) -> float:
        """Characteristic cylinder strength f'c (Pa)."""
        return float(_tables()["grade"][self.grade]["compressive_strength"])

    @property
    def concrete_modulus(self) -> float:
        """Modulus of the concrete E_c (Pa): given, or by the grade."""
        given = self.elastic_modulus
        return float(_tables()["grade"][self.grade]["elastic_modulus"]) if given is None else given

    @property
    def flexural_strength(self) -> float:
        """Tensile strength in bending (Pa): given, or by the grade."""
        if self.tensile_strength is not None:
            return self.tensile_strength
        return float(_tables()["tensile"]["factor"]) * sqrt(self.compressive_strength * 1e-6) * 1e6

    @property
    def bottom_wires(self) -> tuple[float, float]:
        """Area of the bottom mesh (m2) and diameter of its wires (m)."""
        return _wires("bottom", self.bottom)

    @property
    def top_wires(self) -> tuple[float, float]:
        """Area of the top mesh (m2) and diameter of its wires (m); both 0 without a top mesh."""
        if self.top is None:
            return self.bottom_wires
        if self.top.strip().lower() in ("", "none"):
            return 0.0, 0.0
        return _wires("top", self.top)


def _wires(key: str, name: str) -> tuple[float, float]:
    meshes = _tables()["mesh"]
    parts = _MESH.fullmatch(name)
    mesh = parts[2].upper() if parts else name.strip().upper()
    if parts is None or mesh not in meshes or int(parts[1]) < 1:
        number = parts[1] if parts and int(parts[1]) > 0 else "3"
        nothing = " or 'none'" if key == "top" else ""
        raise ValueError(
            f"{key} = '{name}': must be a number of wires and a mesh, such as '3-L11TM'{nothing}; the meshes are "
            f"{', '.join(meshes)}.{nearest(f'{number}-{mesh}', [f'{number}-{m}' for m in meshes])}"
        )
    return int(parts[1]) * float(meshes[mesh]["area"]), float(meshes[mesh]["diameter"])
