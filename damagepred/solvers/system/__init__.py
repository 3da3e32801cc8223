"""The discrete system: elastic stiffness, loading stages, deformable blocks, and forces read from contacts."""
