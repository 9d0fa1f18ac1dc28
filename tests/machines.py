"""Machines of the tests of sizing."""

MACHINE = {
    "title": "A press",
    "mass": 100.0,
    "natural_frequency": 20.0,
    "damping_ratio": 0.05,
    "base_amplitude": 1e-3,
    "band": [19.0, 21.0],
    "largest_mass": 8.0,
    "largest_gap": 0.1,
    "restitution": 0.3,
    "gap_tolerance": 5e-4,
}
FRAME = {
    "mass": 100.0,
    "natural_frequency": 31.8,
    "damping_ratio": 0.005,
    "force_amplitude": 200.0,
    "band": [28.0, 36.0],
    "largest_mass": 5.0,
    "largest_gap": 0.02,
    "restitution": 0.7,
}
