"""Closed forms and limits to compare simulations with."""
