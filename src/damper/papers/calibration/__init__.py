"""Calibration: how far the papers' statements pin down the parameters that their text lost.

`statements` says what is stated and what a study must have to test it, `scores` gives each set of
parameters a score in [0, 1] for each statement, `ranking` joins and orders them, and
`ranking_table` writes what was found.
"""
