"""Other ways to simulate the damper, compared with the engine: error against run time.

`scene` is what is simulated, `solution` what a solver returns, `solvers` holds one file for
each solver, `reference` the answer to 50 digits, `errors` what a solution is off by. Only the
comparison study needs any of this; nothing else imports it.
"""
