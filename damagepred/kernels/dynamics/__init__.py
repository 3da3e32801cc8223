"""Bodies that move and turn as far as they like, in physical time."""
