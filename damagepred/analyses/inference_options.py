"""Options of a back-analysis."""

from __future__ import annotations

from dataclasses import dataclass

from damagepred.inputs.documentation import documented


@documented
@dataclass(frozen=True)
class InferenceOptions:
    """Options of a back-analysis."""

    replays: int = 200
    """Largest number of replayed samples per study, for local cracks and levels."""
    fewest_effective: float = 50.0
    """Effective number of samples below which the result has a caution, and new walls are run."""
    new_walls: int = 0
    """Walls per round of adaptive importance sampling; 0: no new walls."""
    rounds: int = 3
    """Largest number of rounds."""
    nominal_share: float = 0.2
    """Share of the new walls drawn from the study's own distributions (defensive mixture)."""
    smallest_cause: float = 0.01
    """Least posterior probability of a cause, among the studies, for new walls."""
    resemblance: float = 0.01
    """Probability of a larger misfit below which the best state does not resemble the observations."""
    further: tuple[float, ...] = (0.0, 0.1, 0.25, 0.5)
    """Further movements, as shares of the study's largest."""
    map_cell: float = 0.15
    map_width: float = 5e-4
    """Side of the cells of the crack map (m), and the smallest width of its cracks (m)."""
    negligible: float = 1e-4
    """Share of the posterior up to which a sample is left out of the map."""
    quantiles: tuple[float, ...] = (0.05, 0.25, 0.5, 0.75, 0.95)
    """Quantiles of the movement."""
    discrepancy_points: int = 7
    """Points of the quadrature over each fitted term of the model's discrepancy; 1: without uncertainty of the fit."""
    histories: int = 256
    """Histories of each kind, of observations with dates."""


DEFAULT = InferenceOptions()
