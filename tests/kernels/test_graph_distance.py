"""Number of joints between blocks, compared with scipy's shortest paths."""

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from damagepred.kernels.linear.graph_distance import joints_away


@pytest.mark.parametrize("seed", range(6))
def test_as_shortest_paths(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 60))
    joints = int(rng.integers(0, 2 * count))
    start, end = rng.integers(0, count, (2, joints))
    roots = rng.integers(0, count, int(rng.integers(1, 4)))
    graph = csr_array((np.ones(joints), (start, end)), shape=(count, count))
    expected = dijkstra(graph, directed=False, unweighted=True, indices=np.unique(roots), min_only=True)
    away = joints_away(start, end, count, roots)
    np.testing.assert_array_equal(away, np.where(np.isfinite(expected), expected, -1.0))
