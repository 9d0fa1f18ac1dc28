"""Independent reference solutions of the rigid impact damper, for the tests only.

Nothing in here imports the package under test. Every module is derived on its own from the
equations of the model and is written for clarity, not for speed.

Modules
-------
mp_reference
    Events of the rigid model in arbitrary precision, complete bursts included.
accumulation
    Accumulation time of a burst, bounce by bounce, in arbitrary precision.
fine_step
    Brute force in double precision: tiny steps, bisection at the walls (no chatter).
dop853
    ``scipy.integrate.solve_ivp`` with events, restarted at each impact (no chatter).
two_impacts
    Closed form of the symmetric orbit with two impacts per cycle.
"""
