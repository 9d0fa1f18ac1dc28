"""The stress study: corners of the parameter box, random runs, and what must hold in all of them.

`box` makes the points, mappings for `damper.sweep.points.read_point`; `checks` runs them
and measures how far each law is violated.
"""
