"""Dampers that many tests share, dimensionless but for `SI`."""

from damper.parameters.dampers import BASIC

#: Two impacts a period and more, nothing sticks.
GENERIC = {
    "mass_ratio": 0.1,
    "damping_ratio": 0.05,
    "frequency_ratio": 0.8,
    "clearance": 1.0,
    "restitution": 0.6,
}
#: Model section 7: complete chatter, many impacts each.
SLOW = GENERIC | {"frequency_ratio": 0.2, "clearance": 0.25}
#: The same with few: two complete sequences in each forcing period.
QUIET = SLOW | {"restitution": 0.3}
#: The restitution study.
STUDY = GENERIC | {"damping_ratio": 0.02, "frequency_ratio": 1.3, "clearance": 0.05}
#: Model section 8, A3: complete chatter of some sixty impacts in every half period.
PAPER_A = {
    "mass_ratio": 0.2,
    "damping_ratio": 0.01,
    "frequency_ratio": 0.2,
    "clearance": 0.03,
    "restitution": 0.8,
}
#: In SI units: F0/K = 0.05 m, sqrt(M/K) = 0.1 s, F0/sqrt(K M) = 0.5 m/s, F0^2/K = 0.5 J; damping
#: ratio and mass ratio 0.1, frequency ratio 1.1, clearance 1.
SI = {
    "primary_mass": 2.0,
    "damping": 4.0,
    "stiffness": 200.0,
    "force_amplitude": 10.0,
    "forcing_frequency": 11.0,
    "free_mass": 0.2,
    "gap": 0.1,
    "restitution": 0.5,
}

#: What the tests of observers run.
SCENES = {
    name: dict(zip(BASIC, values, strict=True))
    for name, values in {
        "generic": (0.1, 0.05, 0.8, 1.0, 0.6, 0.0),
        "chattering": (0.1, 0.05, 0.2, 0.25, 0.3, 0.0),
        "slow": (0.1, 0.05, 0.2, 0.25, 0.6, 0.4),
        "study": (0.1, 0.02, 1.3, 0.05, 0.6, 0.4),
        "incomplete": (0.1, 0.02, 1.3, 0.05, 0.9, 0.4),
        "elastic": (0.3, 0.05, 0.9, 0.4, 1.0, 0.4),
        "plastic": (0.2, 0.1, 0.4, 0.3, 0.0, 0.4),
        "overdamped": (0.5, 1.5, 0.6, 0.05, 0.5, 0.4),
        "very overdamped": (0.5, 10.0, 0.6, 5e-3, 0.5, 0.4),
        "undamped": (2.0, 0.0, 0.7, 0.6, 0.7, 0.4),
        "stuck": (0.5, 0.1, 0.6, 0.0, 0.5, 0.4),
        "free": (0.1, 0.1, 0.6, 40.0, 0.5, 0.4),
        "fast": (0.1, 0.1, 1e3, 1e-6, 0.5, 0.4),
    }.items()
}
