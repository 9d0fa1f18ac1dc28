"""Metamorphic tests: runs made again in ways that must not matter.

`relations` makes them and compares, by the `condition` of each run or by the `backward` error of
its steps.
"""
