"""Runs in physical time with updated geometry: blocks rock, slide, fall, meet others and come to rest."""
