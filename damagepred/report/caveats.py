"""What the results do not say."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import xarray as xr

from damagepred.archive.cautions import study_cautions, wall_cautions
from damagepred.archive.provenance import GIVEN
from damagepred.assembly.brick_cracks import bricks_break
from damagepred.campaign.settings import StudySettings
from damagepred.enumerations import PathStatus
from damagepred.formatting import counted, length, number
from damagepred.report.inputs import unsure
from damagepred.report.parts import Section, Text
from damagepred.results.house import is_house
from damagepred.results.tables import curve_notes
from damagepred.scene import House, Scene
from damagepred.scene.assumed import assumed_ground, assumed_seasons, assumed_slow_strains
from damagepred.uq.capacity import sample_weights
from damagepred.uq.fragility.describe import median_lower_bound
from damagepred.uq.fragility.fit import EXTRAPOLATED


def model_caveats(scene: Scene, stated: Collection[str]) -> list[str]:
    """Limits of the model of one wall, and assumptions of the ground: keys neither given in the file nor sampled."""
    kind = "house" if isinstance(scene, House) else "wall"
    said = [
        "Straight walls, each in its own plane, which pass vertical shear where they meet. The push of a wall's end on "
        "another wall, floors, roof, movement out of the planes, and torsion of the footings are not in the model."
        if kind == "house"
        else "One straight wall in its own plane. Return walls, floors, roof and foundations that tie it in, movement "
        "out of its plane, and torsion of the house are not in the model."
    ]
    if scene.dynamics is None:
        absent = [
            *(["creep"] if scene.creep is None else []),
            *(["shrinkage, moisture expansion, temperature"] if scene.strain is None else []),
            *([] if scene.movement.stage else ["repetition of wet and dry seasons"]),
        ]
        left_out = f" There is no {', no '.join(absent)}." if absent else ""
        said.append(f"Displacements are small, and nothing swings or falls in time.{left_out}")
    if assumed := assumed_slow_strains(scene, stated):
        said.append(f"Slow strains have defaults, which are assumed: {', '.join(assumed)}.")
    if scene.solver.blocks in ("rigid", "elastic") and scene.solver.above_dpc in (None, "rigid", "elastic"):
        whole = "Bricks neither crack nor crush: cracks run through joints alone."
        said.append("Bricks break upright in the middle alone, and do not crush." if bricks_break(scene) else whole)
    bonds = (
        "Bonds break at once when their strength is reached. Small differences decide which joint breaks next, and the "
        f"widest crack with it: single {kind}s are examples, and probabilities need many {kind}s. "
    )
    law = "lose" if scene.joint.brittle_shear else "keep"
    detail = "at the first slip" if scene.joint.brittle_shear else "(Eq. 4 of the paper)"
    slip = f"Joints that slip {law} their cohesion {detail}. Real joints lose it over about a millimetre of slip."
    if (energy := scene.joint.shear_fracture_energy) is not None:
        slip = f"Joints that slip lose their cohesion by softening, with {energy:g} N/m in mode II."
    said.append(("" if scene.joint.fracture_energy else bonds) + slip)
    if scene.movement.prescribed:
        said.append(
            "The underside of the wall follows a given form: the wall's weight and stiffness do not change the form of "
            "the footing."
        )
    if assumed := assumed_ground(scene, stated):
        said.append(
            f"Of the ground nothing was given but defaults: {', '.join(assumed)}. Your site differs; softer soil than "
            f"the site's spares the {kind}."
        )
    if assumed := assumed_seasons(scene, stated):
        said.append(f"The seasons have defaults, which are assumed and not measured at a site: {', '.join(assumed)}.")
    if not scene.movement.prescribed and scene.footing.concrete is None:
        said.append("The footing is linear elastic; a real one is cracked, and bends where it is.")
    if scene.dpc is not None:
        said.append(
            "The category is of the wall above the damp-proof course. Opening and slip of the course itself, and "
            "cracks in the courses below it, are reported apart and make no category."
        )
    if scene.block.elastic_modulus == 9.0e9 and scene.joint.normal_stiffness < 1e11:
        said.append(
            "The blocks' modulus is one of masonry (9000 MPa), in series with the joints: the compliance of the joints "
            "counts twice, as in the paper that the model follows. The wall is softer than that modulus says."
        )
    said.append(
        "Crack width is the main measure of the damage table, not the only one: place and look of a crack, and its "
        "effect on doors, windows and tightness count as well. The limits were read in a secondary source."
    )
    return said


def wall_caveats(ds: xr.Dataset, scene: Scene) -> Section:
    """Return the caveats of one wall."""
    said = []
    if ds.attrs.get("status", PathStatus.COMPLETE) != PathStatus.COMPLETE:
        said.append(f"The path ended early: {ds.attrs.get('status_message', ds.attrs['status'])}.")
    kind = "house" if isinstance(scene, House) else "wall"
    said.append(
        f"This is one sampled {kind} of a study. Others of the same study may look quite different."
        if "sample" in ds.attrs
        else f"This is one {kind} with the values stated. Real joints scatter, and scatter decides places and widths "
        f"of cracks: a study of many {kind}s gives the probability of each category."
    )
    if int(ds.attrs.get("apex_limited_joints", 0)):
        said.append(
            f"{int(ds.attrs['apex_limited_joints'])} joints have a tensile strength beyond cohesion / friction, the "
            "tip of their friction law; it was cut to that."
        )
    said += wall_cautions(ds)
    return Section("caveats", "What to keep in mind", [Text([], said + model_caveats(scene, _given(ds)))])


def study_caveats(ds: xr.Dataset, curves: xr.Dataset, settings: StudySettings, moved: float) -> Section:
    """Return the caveats of a study."""
    said = [
        "Bands and intervals tell the error of the number of samples alone, not whether the model and the inputs are "
        "right; `damagepred estimate` with [study.epistemic] weighs the inputs."
    ]
    if doubtful := unsure(settings):
        said.append(
            f"The mean or the scatter of {len(doubtful)} variables is assumed, not measured: "
            f"{', '.join(doubtful)}. Measure the important ones before you build on the figures."
        )
    said += _curve_caveats(curves, moved)
    apexes = ds["apex_limited"].values if "apex_limited" in ds else np.zeros(0)
    if (apexes > 0).any():
        cut = np.average(apexes[apexes >= 0], weights=sample_weights(ds)[apexes >= 0])
        said.append(
            f"In a sample, {number(float(cut), 3)} joints on average have a sampled tensile strength beyond cohesion / "
            "friction, the tip of their friction law; it was cut to that, so the strength in effect is smaller than "
            "its mean says."
        )
    said += [counted(caution, is_house(ds)) for caution in study_cautions(ds)]
    if "limit_deflection" in ds and np.isfinite(ds["limit_deflection"].values).any():
        count = int(np.isfinite(ds["limit_deflection"].values).sum())
        said.append(
            f"{count} walls ended before the full movement, where jacks or supports carry no load any more; categories "
            "not reached there count as not yet reached."
        )
    if not is_house(ds):
        shared = "walls of a house, and houses of a street, share bricks, builders and ground"
        said.append(f"Walls are single walls: {shared}.")
    said += model_caveats(settings.scene, {*settings.variables, *_given(ds)})
    return Section("caveats", "What to keep in mind", [Text([], said)])


def _given(ds: xr.Dataset) -> list[str]:
    """Keys that the user's file gave; none in older archives."""
    return str(ds.attrs.get(GIVEN, "")).split()


def _curve_caveats(curves: xr.Dataset, moved: float) -> list[str]:
    said = curve_notes(curves)
    for k, category in enumerate(curves["category"].values):
        one = curves.isel(category=k)
        reached, not_yet, median = int(one["reached"]), int(one["not_reached"]), float(one["median"])
        if not_yet > reached > 0:
            said.append(
                f"Category {category} was not reached by {not_yet} of {reached + not_yet} walls: its curve is known at "
                "its lower end, and its median rests on the assumption that capacities are lognormal."
            )
        if str(curves.attrs.get("intensity_measure")) == "deflection_ratio":
            continue
        if "fit_status" in one and str(one["fit_status"].item()) == EXTRAPOLATED:
            said.append(
                f"The median of category {category} lies beyond {length(median_lower_bound(one))}, the largest "
                "movement of a wall: its curve is known as far as that and no further."
            )
        elif median > moved > 0:
            said.append(
                f"The median of category {category}, {length(median)}, lies beyond {length(moved)}, to which all walls "
                "were moved: an extrapolation."
            )
    return [counted(words, is_house(curves)) for words in said]
