"""Explicit solver: the load path by damped time stepping (Cundall)."""
