"""Exports of fragility curves and studies: files and tables for other programs."""

from damagepred.exports.frames import frame, to_arviz
from damagepred.exports.programs import FORMATS, export_curves

__all__ = [
    "FORMATS",
    "export_curves",
    "frame",
    "to_arviz",
]
