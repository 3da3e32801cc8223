"""Units of masonry of several sizes and materials, and small arrangements for many checks."""

from dataclasses import dataclass

from damagepred import Assembly, BlockMaterial, Joint
from damagepred.assembly.assembly import rectangle

G = 9.81


@dataclass(frozen=True)
class Unit:
    name: str
    b: float
    h: float
    t: float
    density: float
    k_n: float
    k_s: float

    @property
    def area(self) -> float:
        """Of the bed (m2)."""
        return self.b * self.t

    @property
    def mass(self) -> float:
        """Of the block (kg)."""
        return self.density * self.area * self.h

    @property
    def weight(self) -> float:
        """Of the block (N)."""
        return self.mass * G

    @property
    def material(self) -> BlockMaterial:
        return BlockMaterial(density=self.density)

    def joint(self, **law: float) -> Joint:
        """Return a joint of this stiffness; without further words one that carries neither tension nor cohesion."""
        return Joint(**{"normal_stiffness": self.k_n, "shear_stiffness": self.k_s, **DRY, **law})

    def at(self, left: float, bottom: float) -> list[tuple[float, float]]:
        """Return the corners of the block whose lower left corner is there."""
        return list(rectangle(left, bottom, left + self.b, bottom + self.h))

    def __str__(self) -> str:
        return self.name


DRY = {"tensile_strength": 0.0, "cohesion": 0.0}

BRICK = Unit("brick", 0.24, 0.075, 0.11, 2000.0, 82e9, 36e9)
BLOCK = Unit("light block", 0.5, 0.25, 0.2, 600.0, 5e9, 2e9)
STONE = Unit("stone", 1.2, 0.6, 0.8, 2600.0, 0.5e9, 0.3e9)
UNITS = (BRICK, BLOCK, STONE)


def table() -> list[str]:
    """Return the units as a table in Markdown."""
    rows = ["| unit | length x height x thickness (mm) | density (kg/m³) | k_n, k_s (N/mm³) |", "|---|---|---|---|"]
    for u in UNITS:
        size = f"{1e3 * u.b:g} x {1e3 * u.h:g} x {1e3 * u.t:g}"
        rows.append(f"| {u.name} | {size} | {u.density:g} | {1e-9 * u.k_n:g}, {1e-9 * u.k_s:g} |")
    return rows


def stack(unit: Unit, count: int, joint: Joint | None = None, material: BlockMaterial | None = None) -> Assembly:
    """Return units one on the other, the lowest on the ground."""
    assembly = Assembly(thickness=unit.t, joint=joint or unit.joint(), block=material or unit.material)
    for i in range(count):
        assembly.add_block(unit.at(0.0, i * unit.h), course=i)
    assembly.rest_on_ground([0])
    return assembly


def on_plate(unit: Unit, joint: Joint, gravity: tuple[float, float] = (0.0, -G), plates=1) -> tuple[Assembly, int]:
    """Return an assembly with one unit, its middle over x = 0, on a fixed plate, and the unit's number."""
    assembly = Assembly(thickness=unit.t, gravity=gravity, joint=joint, block=unit.material)
    top = assembly.add_block(unit.at(-unit.b / 2, 0.0))
    for i in range(plates):
        left = -unit.b / 2 + unit.b * i / plates
        assembly.support(assembly.add_block(rectangle(left, -0.1, left + unit.b / plates, 0.0)))
    return assembly, top
