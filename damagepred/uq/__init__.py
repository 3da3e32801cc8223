"""Uncertainty: distributions, correlation, fields along joints, samplers, fragility."""
