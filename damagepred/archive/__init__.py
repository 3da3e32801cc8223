"""Datasets on disk: what they hold, where they come from, and files that are whole or not there."""
