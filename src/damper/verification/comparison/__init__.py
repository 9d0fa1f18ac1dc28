"""Other ways to simulate the damper, compared with the engine: error against run time.

`solvers` holds one file for each solver, `reference` the answer to 50 digits, `errors` what a
solution is off by, `runs` the jobs. Only the comparison study needs any of this; nothing else
imports it.
"""

#: Module of a solver -> the setting by which it becomes more exact, in the order of figures.
SOLVERS = {
    "exact": "accuracy",
    "dop853": "tolerance",
    "rk4_located": "steps_per_period",
    "rk4_step_end": "steps_per_period",
    "moreau_jean": "steps_per_period",
}
#: Outcomes of a run; ``missed`` is any event that the reference has and the run lacks, or reverse.
OUTCOMES = ("good", "stalled", "capped", "failed", "left_box", "missed")
GOOD = OUTCOMES.index("good")
