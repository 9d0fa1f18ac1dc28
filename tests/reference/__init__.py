"""Independent reference solutions of the impact damper, for the tests only.

Nothing in here imports the engine under test. Every module is derived on its own from the
equations of the model and is written for clarity, not for speed.

Modules
-------
closed_form
    Events of the rigid model in arbitrary precision by exponentials, brackets and extrapolation:
    a second implementation beside `damper.verification.comparison.reference_rigid`, which some of
    these use.
compliant
    The damper with compliant contact, in arbitrary precision.
accumulation
    Completion time of a chatter sequence, bounce by bounce, in arbitrary precision.
grounded, varying_mass
    The damper with a grounded and with a time-varying free mass, in arbitrary precision.
two_impacts
    Closed form of the symmetric orbit with two impacts per cycle.
"""
