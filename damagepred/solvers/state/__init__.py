"""State of the joints and zones along a load path, and the result of an increment."""
