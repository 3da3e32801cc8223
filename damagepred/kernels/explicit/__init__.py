"""Cycle of the explicit solver."""
