"""Linear algebra of block tridiagonal systems."""
