"""Closed forms of single motions, for the tests only: nothing in here imports `damper`.

Modules
-------
two_impacts
    The symmetric orbit with two impacts per cycle.
impact_oscillator
    Motions of the classical impact oscillator with one impact in n forcing periods.
"""
