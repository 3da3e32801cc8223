"""A case in pymunk: rigid blocks that collide, impulses found by sequential iteration (Chipmunk2D)."""

from __future__ import annotations

import math

import numpy as np
import pymunk
from record import Record, Wall, run

SLOP = 1e-5
"""Overlap that is not corrected (m); the default, 0.1, is meant for lengths in pixels."""


class Space:
    """The wall as pymunk has it."""

    def __init__(self, case: dict, settings: dict) -> None:
        self.wall = Wall(case)
        self.case, self.dt, self.every = case, settings["dt"], settings.get("every", 5)
        self.space = pymunk.Space()
        self.space.iterations = settings["iterations"]
        self.space.collision_slop = SLOP
        self.space.gravity = (0.0, -case["gravity"])
        self.now = 0.0
        self.ground = []
        for corners in case["ground"]:
            body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            self._shape(body, corners)
            self.ground.append(body)
        self.bodies = []
        for i, corners in enumerate(self.wall.corners):
            body = pymunk.Body(self.wall.mass[i], self.wall.inertia[i])
            body.position = tuple(self.wall.centre[i])
            self._shape(body, (corners - self.wall.centre[i]).tolist())
            self.bodies.append(body)

    def _shape(self, body: pymunk.Body, corners: list) -> None:
        shape = pymunk.Poly(body, [tuple(c) for c in corners])
        shape.friction = math.sqrt(self.case["friction"])  # that of a pair is the product
        shape.elasticity = 0.0
        self.space.add(body, shape)

    def step(self) -> None:
        """Integrate over a time step, with the velocity of the ground at its beginning."""
        first, last = self.case["drop_from"], self.case["drop_until"]
        moving = first <= self.now < last - 1e-9
        for body, drop in zip(self.ground, self.case["drop"]):
            if drop:
                body.velocity = (0.0, -drop / (last - first) if moving else 0.0)
        self.space.step(self.dt)
        self.now += self.dt

    def advance(self, record: Record) -> int:
        """Integrate over some steps, and note the change of velocities in the last; return their number."""
        record.start()
        for _ in range(self.every - 1):
            self.step()
        record.stop()
        before = self.velocity()
        record.start()
        self.step()
        record.stop()
        self.change = self.velocity() - before
        return self.every

    def check(self) -> tuple[float, np.ndarray]:
        """Return the residual, and the vertical force of the ground on each of the lowest blocks (N)."""
        return self.wall.from_velocity(self.change, self.dt), self.base()

    def velocity(self) -> np.ndarray:
        """Return the velocity of each block (n, 3)."""
        return np.array([(*b.velocity, b.angular_velocity) for b in self.bodies])

    def displacement(self) -> np.ndarray:
        """Return x, y and rotation of each block (n, 3)."""
        moved = np.array([(*b.position, b.angle) for b in self.bodies])
        moved[:, :2] -= self.wall.centre
        return moved

    def base(self) -> np.ndarray:
        """Return the vertical force of the ground on each of the lowest blocks (N)."""
        force = np.zeros(len(self.wall.lowest))
        place = {id(self.bodies[b]): i for i, b in enumerate(self.wall.lowest)}
        ground = {id(b) for b in self.ground}

        def add(arbiter: pymunk.Arbiter) -> None:
            a, b = (s.body for s in arbiter.shapes)
            if id(a) in ground or id(b) in ground:
                block = b if id(a) in ground else a
                force[place[id(block)]] += abs(arbiter.total_impulse.y) / self.dt

        for b in self.wall.lowest:
            self.bodies[b].each_arbiter(add)
        return force


if __name__ == "__main__":
    run(pymunk.version, Space)
