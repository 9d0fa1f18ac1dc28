"""Calibration: how far the papers' statements pin down the parameters that their text lost.

`damper.papers.statements.SCORES` gives each set of parameters a score in [0, 1] for each statement,
`ranking` joins and orders them, and `tables` and `figures` show what was found. A deviation by its
tolerance halves a score, and deviations add up as a quadrature sum: the score falls as
2^-(sum of squares). A run that stopped early counts as one without chatter.
"""
