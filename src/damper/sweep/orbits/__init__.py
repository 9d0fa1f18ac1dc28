"""Periodic motions, stable or not, and what becomes of them along parameters.

`periodic` finds one, `branch` follows it along a parameter. `arcs` runs from one moment to
another with the derivative, `equation` is what an orbit satisfies and its corrector, `walk` steps
along a branch, `special` locates the points on it, `corners` goes on where it has a corner, and
`point_curve` follows such a point along two parameters. `shock` asks how large a shock throws an
orbit out.
"""

#: Kind of special point -> its marker in figures.
MARKERS = {
    "fold": "o",
    "period doubling": "s",
    "torus": "D",
    "branch point": "v",
    "symmetry breaking": "^",
    "grazing": "x",
    "complete chatter": "*",
}
KINDS = tuple(MARKERS)
