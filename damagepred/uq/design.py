"""The design of a study: what every sample's inputs are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from damagepred.errors import InputError
from damagepred.uq.correlation import cholesky, from_normal
from damagepred.uq.fields import course_noise, innovation_factor, lag_correlation
from damagepred.uq.samplers import Stream, generator, unit_points
from damagepred.uq.variable import Variable

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Design:
    """Distributions made ready to draw from.

    Attributes
    ----------
    seed : int
        Of all streams.
    sampler : str
        See ``damagepred.uq.samplers.unit_points``.
    marginals : mapping of str to frozen distribution
        By place.
    wall, joint : tuple of str
        Places with one value a wall, and with one a joint.
    wall_factor, joint_factor : array
        Cholesky factors of their correlation.
    lag : mapping of str to float
        For places with one value a joint, the correlation of the underlying normals along a course.
    innovation_factor : array
        Cholesky factor of the correlation of what is new from one joint of a course to the next.
    """

    seed: int
    sampler: str
    marginals: Mapping[str, Any]
    wall: tuple[str, ...]
    joint: tuple[str, ...]
    wall_factor: FloatArray
    joint_factor: FloatArray
    lag: Mapping[str, float]
    innovation_factor: FloatArray

    @classmethod
    def make(
        cls,
        variables: Mapping[str, Variable],
        units: Mapping[str, str],
        correlation: Mapping[frozenset[str], float],
        sampler: str,
        seed: int,
    ) -> Design:
        """Check the variables and prepare to draw.

        Parameters
        ----------
        variables : mapping of str to Variable
            By place.
        units : mapping of str to str
            SI unit of each place.
        correlation : mapping of pairs to float
            Correlation of variables.
        sampler : str
            Kind of sampling of the values a wall.
        seed : int
            Of all streams.

        Raises
        ------
        InputError
            If a distribution or a correlation is not possible.
        """
        marginals = {place: v.frozen(place, units[place]) for place, v in variables.items()}
        wall = tuple(place for place, v in variables.items() if v.field is None)
        joint = tuple(place for place, v in variables.items() if v.field is not None)
        for pair in correlation:
            if len(pair & set(wall)) == 1:
                a, b = sorted(pair, key=lambda p: p in joint)
                raise InputError(
                    f'[correlation] "{a}" with "{b}": one has a value a wall, the other one a joint; give both a field '
                    "or neither."
                )
        lag = {
            place: lag_correlation(marginals[place], field.course_correlation)
            for place in joint
            if (field := variables[place].field) is not None
        }
        joint_factor = cholesky(joint, marginals, {p: c for p, c in correlation.items() if p <= set(joint)})
        return cls(
            seed, sampler, marginals, wall, joint,
            cholesky(wall, marginals, {p: c for p, c in correlation.items() if p <= set(wall)}),
            joint_factor, lag, innovation_factor(joint_factor, [lag[place] for place in joint]),
        )  # fmt: skip

    def wall_values(self, samples: int) -> dict[str, FloatArray]:
        """Return the values that hold for a whole wall: place -> array (samples,)."""
        from scipy.special import ndtri

        normal = ndtri(unit_points(self.sampler, len(self.wall), samples, self.seed)) @ self.wall_factor.T
        return {place: from_normal(self.marginals[place], normal[:, k]) for k, place in enumerate(self.wall)}

    def joint_values(self, sample: int, sequence: IntArray) -> dict[str, FloatArray]:
        """Return the values that vary from joint to joint in one sample: place -> array (joints,).

        Parameters
        ----------
        sample : int
            Number of the sample; the values depend on the seed and on it alone.
        sequence : array of int (joints,)
            Which joints are neighbours; see ``course_noise``.
        """
        if not self.joint:
            return {}
        random = generator(self.seed, Stream.FIELD, sample)
        independent = random.standard_normal((len(self.joint), len(sequence)))
        first = np.diff(sequence, prepend=sequence[0] - 1) != 0
        new = np.where(first, self.joint_factor @ independent, self.innovation_factor @ independent)
        return {
            place: from_normal(self.marginals[place], course_noise(new[k], sequence, self.lag[place]))
            for k, place in enumerate(self.joint)
        }
