"""Explicit solver: the load path by damped time stepping (Cundall)."""

from damagepred.solvers.explicit.load_path import explicit_path

__all__ = ["explicit_path"]
