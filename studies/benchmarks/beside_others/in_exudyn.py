"""A case in Exudyn: rigid blocks in the plane, penalty contact of small spheres at corners with the others' faces.

``GeneralContact`` knows spheres and triangles: each block has spheres, flush with its faces, at its corners and on
either side of the middle of its underside, and triangles as faces. Friction is regularised by a velocity, so blocks
that carry friction creep. Ground plates, one under each of the lowest blocks, are supported by stiff springs.
"""

from __future__ import annotations

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CoordinateSpringDamper,
    LoadMassProportional,
    MarkerBodyMass,
    MarkerBodyRigid,
    MarkerNodeCoordinate,
    NodePointGround,
    NodeRigidBody2D,
    ObjectRigidBody2D,
)
from record import Record, Wall, run

RADIUS = 2e-3
"""Radius of the spheres (m)."""
CONTACT = {"contactStiffness": 1e7, "contactDamping": 2e3, "frictionMaterialIndex": 0}
"""Stiffness and damping of a contact (N/m, N s/m): a hundred times softer than mortar, for a larger time step."""
CREEP = 1e-2
"""Velocity below which friction is reduced (m/s)."""
GROUND = (1e3, 1e9, 4e5)
"""Mass (kg), springs (N/m) and dashpots (N s/m) of the plates of the ground."""


class System:
    """The wall as Exudyn has it."""

    def __init__(self, case: dict, settings: dict) -> None:
        self.case, self.wall, self.now = case, Wall(case), 0.0
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        self.contact = self.system.AddGeneralContact()
        self.contact.SetFrictionPairings(np.array([[case["friction"]]]))
        self.contact.frictionProportionalZone = CREEP
        wall = self.wall
        for i, corners in enumerate(wall.corners):
            marker, body, _ = self._body(wall.centre[i], wall.mass[i], wall.inertia[i])
            self._faces(marker, corners - wall.centre[i])
            self._spheres(body, wall.size[i])
            mass = self.system.AddMarker(MarkerBodyMass(bodyNumber=body))
            weight = [0.0, -case["gravity"], 0.0]
            self.system.AddLoad(LoadMassProportional(markerNumber=mass, loadVector=weight))
        self.drops: list[tuple[int, float]] = []
        self.plate_drop: list[float] = []
        self.share = 0.0
        rest = self.system.AddNode(NodePointGround())
        still = self.system.AddMarker(MarkerNodeCoordinate(nodeNumber=rest, coordinate=0))
        for block in wall.lowest:
            (left, _), (right, _) = wall.corners[block].min(axis=0), wall.corners[block].max(axis=0)
            middle = np.array([(left + right) / 2, -0.05])
            marker, _, node = self._body(middle, GROUND[0], GROUND[0] * 0.01)
            # a little wider at the ends of the wall; between plates there is no play
            half = (right - left) / 2
            self._faces(marker, np.array([[-half, -0.05], [half, -0.05], [half, 0.05], [-half, 0.05]]))
            piece = next(i for i, g in enumerate(case["ground"]) if np.min(g, axis=0)[0] < middle[0] < np.max(g, 0)[0])
            self.plate_drop.append(case["drop"][piece])
            for axis in range(3):
                at = self.system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=axis))
                share = 0.01 if axis == 2 else 1.0
                law = {"stiffness": GROUND[1] * share, "damping": GROUND[2] * share}
                spring = self.system.AddObject(CoordinateSpringDamper(markerNumbers=[still, at], **law))
                if axis == 1 and case["drop"][piece]:
                    self.drops.append((spring, case["drop"][piece]))
        cells = max(4, int(np.sqrt(len(wall.mass))))
        self.contact.SetSearchTreeCellSize(numberOfCells=[cells, 2 * cells, 1])
        low, high = wall.corners.min(axis=(0, 1)) - 0.3, wall.corners.max(axis=(0, 1)) + 0.3
        self.contact.SetSearchTreeBox(pMin=[*low, -0.1], pMax=[*high, 0.1])
        self.system.Assemble()
        self.dt, self.slab = settings["dt"], settings["slab"]
        self.settings = exu.SimulationSettings()
        self.settings.timeIntegration.numberOfSteps = round(self.slab / self.dt)
        self.settings.timeIntegration.verboseMode = 0
        self.settings.solution.file.write = False
        self.settings.solution.sensors.writePeriod = 1e9
        self.settings.timeIntegration.explicit.computeEndOfStepAccelerations = False

    def _body(self, centre: np.ndarray, mass: float, inertia: float) -> tuple[int, int, int]:
        node = self.system.AddNode(NodeRigidBody2D(referenceCoordinates=[*centre, 0.0]))
        body = self.system.AddObject(ObjectRigidBody2D(nodeNumber=node, physicsMass=mass, physicsInertia=inertia))
        return self.system.AddMarker(MarkerBodyRigid(bodyNumber=body)), body, node

    def _faces(self, marker: int, corners: np.ndarray, depth: float = 0.02) -> None:
        front = [[x, y, -depth] for x, y in corners]
        points = front + [[x, y, depth] for x, y in corners]
        triangles = []
        for i, j in ((0, 1), (1, 2), (2, 3), (3, 0)):
            triangles += [[i, j, j + 4], [i, j + 4, i + 4]]
        self.contact.AddTrianglesRigidBodyBased(
            rigidBodyMarkerIndex=marker, pointList=points, triangleList=triangles, **CONTACT
        )

    def _spheres(self, body: int, size: np.ndarray) -> None:
        x, y = size / 2 - RADIUS
        places = [(-x, -y), (x, -y), (x, y), (-x, y)]
        if size[0] > 0.2:
            places += [(-RADIUS, -y), (RADIUS, -y)]
        for place in places:
            marker = self.system.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=[*place, 0.0]))
            self.contact.AddSphereWithMarker(marker, radius=RADIUS, **CONTACT)

    def advance(self, record: Record) -> int:
        """Integrate over an interval of time, the ground moving at its beginning; return the number of steps."""
        record.start()
        first, last = self.case["drop_from"], self.case["drop_until"]
        if self.drops:
            self.share = min(1.0, max(0.0, (self.now + self.slab - first) / (last - first)))
        for spring, drop in self.drops:
            self.system.SetObjectParameter(spring, "offset", -drop * self.share)
        time_settings = self.settings.timeIntegration
        time_settings.startTime, time_settings.endTime = self.now, self.now + self.slab
        verlet = exu.DynamicSolverType.VelocityVerlet
        self.system.SolveDynamic(self.settings, solverType=verlet, updateInitialValues=True, storeSolver=False)
        self.now += self.slab
        record.stop()
        return round(self.slab / self.dt)

    def check(self) -> tuple[float, np.ndarray]:
        """Return the residual, and the vertical force of the ground on each of the lowest blocks (N)."""
        count, data = len(self.wall.mass), self.system.systemData
        acceleration = np.array(data.GetODE2Coordinates_tt()).reshape(-1, 3)[:count]
        moved = np.array(data.GetODE2Coordinates()).reshape(-1, 3)[count:, 1]
        offset = np.array([-drop * self.share for drop in self.plate_drop])
        mass = np.column_stack((self.wall.mass, self.wall.mass, self.wall.inertia))
        return self.wall.residual(mass * acceleration), -GROUND[1] * (moved - offset)

    def displacement(self) -> np.ndarray:
        """Return x, y and rotation of each block (n, 3)."""
        return np.array(self.system.systemData.GetODE2Coordinates()).reshape(-1, 3)[: len(self.wall.mass)]


if __name__ == "__main__":
    run(exu.__version__, System)
