"""Exports of fragility curves and studies: files and tables for other programs."""

from damagepred.exports.frames import curves_frame, frame, to_arviz, walls_frame
from damagepred.exports.programs import FORMATS, export_curves, openquake_xml, pelicun_config, pelicun_frame
from damagepred.exports.programs import export_place as export_place
from damagepred.exports.programs import write_csv as write_csv

__all__ = [
    "FORMATS",
    "curves_frame",
    "export_curves",
    "frame",
    "openquake_xml",
    "pelicun_config",
    "pelicun_frame",
    "to_arviz",
    "walls_frame",
]
