"""Time stepping with local damping, used by the explicit solver and by dynamic relaxation."""
