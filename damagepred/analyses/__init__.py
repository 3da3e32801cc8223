"""Analyses that run campaigns: rare events, two levels, shares of variance."""
