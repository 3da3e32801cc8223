"""Exports of fragility curves and studies: files and tables for other programs."""

from damagepred.exports.files import FORMATS, export_curves
from damagepred.exports.files import export_place as export_place
from damagepred.exports.files import write_csv as write_csv
from damagepred.exports.frames import curves_frame, frame, parameters_frame, to_arviz, walls_frame
from damagepred.exports.openquake import openquake_xml
from damagepred.exports.pelicun import pelicun_config, pelicun_frame

__all__ = [
    "FORMATS",
    "curves_frame",
    "export_curves",
    "frame",
    "openquake_xml",
    "parameters_frame",
    "pelicun_config",
    "pelicun_frame",
    "to_arviz",
    "walls_frame",
]
