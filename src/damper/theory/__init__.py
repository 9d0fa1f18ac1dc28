"""Closed forms to compare simulations with."""
