"""Datasets on disk: schema, provenance, and files that are complete or absent."""
