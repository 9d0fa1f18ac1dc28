"""Figures of a stress study, one file for each kind."""
