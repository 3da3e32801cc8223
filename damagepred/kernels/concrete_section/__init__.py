"""Reinforced-concrete sections of a footing: law and forces."""
