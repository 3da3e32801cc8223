"""Exports of fragility curves and studies: files and tables for other programs."""

from damagepred.exports.frames import curves_frame as curves_frame
from damagepred.exports.frames import frame, to_arviz
from damagepred.exports.frames import walls_frame as walls_frame
from damagepred.exports.programs import FORMATS, export_curves
from damagepred.exports.programs import export_place as export_place
from damagepred.exports.programs import openquake_xml as openquake_xml
from damagepred.exports.programs import pelicun_config as pelicun_config
from damagepred.exports.programs import pelicun_frame as pelicun_frame
from damagepred.exports.programs import write_csv as write_csv

__all__ = [
    "FORMATS",
    "export_curves",
    "frame",
    "to_arviz",
]
