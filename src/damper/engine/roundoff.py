"""Roundoff of doubles."""

#: Distance of 1 to the next double: a unit of roundoff.
EPSILON = 2.0**-52
