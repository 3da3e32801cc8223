"""Analyses that run campaigns: rare events, sensitivity, design, back-analysis."""
