"""The stress study: corners of the parameter box, random lanes, and what must hold in all of them.

`box` makes the lanes, each a plain mapping for `damper.sweep.points.read_point`; `checks` runs them
and says how far each law is off.
"""
