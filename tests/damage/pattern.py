"""A running bond drawn by hand: no bricks, only the lines between them."""

from dataclasses import asdict, dataclass, field

import numpy as np

from damagepred.damage.joints import JointMap
from damagepred.damage.judge import Rules, Verdict, judge
from damagepred.enumerations import ContactKind
from damagepred.scene import Damage

HALF, COURSE = 0.12, 0.075
OFFSET = np.array([-0.5, 0.0, 0.5])
WEIGHT = np.array([1, 4, 1]) / 6


@dataclass
class Pattern:
    """Half bricks along, courses up; joints are named by (column, row) of the half-brick grid.

    ``bed(i, r)`` runs from column i to i + 1 on top of row r - 1 (so r = 0 is the footing), ``head(i, r)`` stands at
    column i in row r, where the bond has a perpend: i + r even.
    """

    columns: int = 20
    rows: int = 12
    dpc: int | None = None
    origin: tuple[float, float] = (0.0, 0.0)
    half: float = HALF
    lines: dict[tuple[str, int, int], int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        places, normals, kinds, lengths, blocks = [], [], [], [], []

        def brick(i: int, r: int) -> int:
            """Number of the brick in row r that covers the half brick from column i on."""
            return -1 if r < 0 else r * (self.columns + 2) + 1 + i - (i + r) % 2

        for r in range(self.rows):
            for i in range(self.columns):
                kind = (
                    ContactKind.FOOTING_INTERFACE
                    if r == 0
                    else ContactKind.DPC
                    if r == self.dpc
                    else ContactKind.BED_JOINT
                )
                self.lines["bed", i, r] = len(kinds)
                places.append(((i + 0.5) * self.half, r * COURSE))
                normals.append((0.0, 1.0))
                kinds.append(kind)
                lengths.append(self.half)
                blocks.append((brick(i, r - 1), brick(i, r)))
            for i in range(1, self.columns):
                if (i + r) % 2 == 0:
                    self.lines["head", i, r] = len(kinds)
                    places.append((i * self.half, (r + 0.5) * COURSE))
                    normals.append((1.0, 0.0))
                    kinds.append(ContactKind.HEAD_JOINT)
                    lengths.append(COURSE)
                    blocks.append((brick(i - 1, r), brick(i, r)))
        middle = np.array(places) + np.array(self.origin)
        normal, length = np.array(normals), np.array(lengths)
        tangent = np.column_stack((normal[:, 1], -normal[:, 0]))
        along = OFFSET * length[:, None]
        self.map = JointMap.from_contacts(
            middle[:, :1] + tangent[:, :1] * along,
            middle[:, 1:] + tangent[:, 1:] * along,
            WEIGHT * length[:, None],
            normal,
            np.array(kinds, dtype=np.int8),
            np.array(blocks),
        )
        shape = (len(kinds), 3)
        self.opening, self.slip, self.cracked = np.zeros(shape), np.zeros(shape), np.zeros(shape, dtype=bool)

    def open(self, line: str, i: int, r: int, width: float | tuple[float, float, float]) -> None:
        """Crack a joint open; the three widths run along its tangent."""
        self.opening[self.lines[line, i, r]] = width
        self.cracked[self.lines[line, i, r]] = True

    def slide(self, line: str, i: int, r: int, slip: float) -> None:
        self.slip[self.lines[line, i, r]] = slip

    def vertical(self, i: int, width: float, rows: tuple[int, int] = (2, 8)) -> None:
        """A crack up the wall: perpends where there are any at the column, toothing by half a brick where not."""
        for r in range(*rows):
            if (i + r) % 2 == 0:
                self.open("head", i, r, width)
            else:
                self.open("head", i + 1, r, width)
            if r > rows[0]:
                self.open("bed", i, r, width)

    def place(self, line: str, i: int, r: int) -> int:
        return self.lines[line, i, r]

    def judge(self, settings: Damage | None = None) -> Verdict:
        return judge(self.map, self.opening, self.slip, self.cracked, rules_of(settings or Damage()))


def rules_of(settings: Damage) -> Rules:
    return Rules.from_settings(**asdict(settings))
