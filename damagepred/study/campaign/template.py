"""The commented study that ``damagepred new`` writes."""

from __future__ import annotations

from pathlib import Path

from damagepred.archive.files import write_whole
from damagepred.errors import InputError

TEMPLATE = """\
# A masonry wall on moving ground: which damage, how likely?
#   damagepred check {name}       is it valid, and what will it cost?
#   damagepred study {name} -j 2
#   damagepred fragility {stem}.dp --plot curves.png
# Numbers are SI; a string may carry a unit. What is left out takes the values of the paper (Zhuge et al.).

[study]
title = "my house"
samples = 32              # walls to sample; a larger -n on the command line extends the study
seed = 1                  # the same seed gives the same walls
sampler = "sobol"         # or "lhs" (cannot be extended), "random"
# stop_at_category = 3    # left out, a path ends at the highest category; "none": at the end of the movement
# movement = "path"       # what is kept of each wall; or "sampled", the end of its own movement alone, or "both"

[scene.wall]              # seen in elevation
length = "6 m"
height = "2.4 m"
thickness = "110 mm"
block_length = "240 mm"   # a brick with its joint
block_height = "75 mm"
bond = "running"          # or "stack"

[[scene.opening]]         # repeat the table for each opening, or remove it
kind = "window"           # or "door"
x = "2.55 m"              # left edge
y = "0.9 m"               # sill
width = "0.9 m"
height = "1.5 m"          # to the top of the wall here; lower ones get a lintel

# [[scene.control_joint]]   # parts the leaf above the dpc; repeat the table for each
# x = "3 m"
# width = "10 mm"           # of the gap

[scene.joint]
normal_stiffness = "82 N/mm3"
shear_stiffness = "36 N/mm3"
tensile_strength = "0.453 MPa"
cohesion = "0.375 MPa"
friction = 0.75           # tangent of the friction angle
# fracture_energy = "10 N/m"   # tension falls off as a crack opens; left out, the bond breaks at once

[scene.dpc]               # remove the table for a wall without damp-proof course
course = 2                # lies on top of that many courses
friction = 0.5

[scene.movement]
kind = "dishing"          # the centre goes down; "doming": up
central_deflection = "20 mm"
increments = 20
shape = "three_loads"     # or "parabola", "arc", "table"; on "jacks" or a "mound" the footing finds its own form

# With shape = "mound" the footing is a beam on soil, and the soil's surface moves; central_deflection is not read.
# [scene.mound]
# shape = "walsh"               # or "mitchell" (reactive clay), "tree", "pipe", "tunnel", "table"
# surface_movement = "40 mm"    # y_s of the site: class S up to 20 mm, M 40, H1 60, H2 75, E above
# suction_depth = "2.3 m"       # H_s: 1.5 m in wet climates, 4 m in dry ones
# [scene.soil]
# swelling_stiffness = "4000 kPa/m"    # read in dishing: 100 / m times the pressure on the soil; soft is unsafe
# shrinking_stiffness = "5000 kPa/m"   # read in doming
# [scene.footing]
# width = "400 mm"
# depth = "900 mm"
# [scene.footing.concrete]      # without this table the footing does not crack
# grade = "N25"
# bottom = "4-L12TM"            # trench mesh, at the top the same
# With shape = "jacks" it stands on supports and jacks of equal load, as in the test.
# [scene.rig]
# supports = [0.0, 6.0]         # m from the left end
# jacks = [1.5, 3.0, 4.5]

[scene.loads]
roof = "0 kN"             # in all, spread along the top

[scene.solver]
method = "quasi_static"   # equilibria without time or damping; "explicit": time stepping, the reference
accuracy = "standard"     # or "draft", "reference": what they set, and errors measured with them, says damagepred check

[scene.damage]
table = "as2870"          # or "bre251"
plasterboard = false      # true: limits half as large again

# What is uncertain, by its place in the scene.
[variables."joint.tensile_strength"]
distribution = "lognormal"
mean = "0.453 MPa"
cov = 0.30
field = {{ course_correlation = 0.4 }}   # one value a joint; leave out for one value a wall

[variables."joint.cohesion"]
distribution = "lognormal"
mean = "0.375 MPa"
cov = 0.35
field = {{ course_correlation = 0.4 }}

[variables."dpc.friction"]
distribution = "truncated_normal"
mean = 0.5
cov = 0.2
lower = 0.3
upper = 0.7

[correlation]
"joint.tensile_strength" = {{ "joint.cohesion" = 0.7 }}
"""


def write_template(path: Path) -> None:
    """Write the template under a new name.

    Parameters
    ----------
    path : Path
        New file, ending in ``.toml``.

    Raises
    ------
    InputError
        If the file exists or has another ending.
    StudyError
        If it cannot be written.
    """
    if path.suffix != ".toml":
        raise InputError(f"{path}: a study is a TOML file; give a name that ends in .toml.")
    if path.exists():
        raise InputError(f"{path}: exists already and is left as it is; give another name.")
    text = TEMPLATE.format(name=path.name, stem=path.stem)
    write_whole(path, lambda p: p.write_text(text, encoding="utf-8"))
