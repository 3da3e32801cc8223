"""Linear algebra of the tangent equations."""
