"""What solvers are stressed with, how their answers are judged, and how it is run and counted."""
