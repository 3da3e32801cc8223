"""The joint law: yield limits, softening, the explicit stress update and the implicit return mapping with tangent."""
