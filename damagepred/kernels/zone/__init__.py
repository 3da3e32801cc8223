"""Constant-strain zones of deformable blocks: law and forces."""
