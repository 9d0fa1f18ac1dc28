"""Figures of a study of a structure, one file for each kind."""
