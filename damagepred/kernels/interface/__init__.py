"""Interfaces: kinematics, forces, tangent stiffness, residual."""
