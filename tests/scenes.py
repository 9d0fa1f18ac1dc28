"""Dimensionless dampers that many tests share."""

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
