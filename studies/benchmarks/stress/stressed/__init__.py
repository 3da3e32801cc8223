"""The extreme cases, how their results are judged, and how they are run and counted."""
