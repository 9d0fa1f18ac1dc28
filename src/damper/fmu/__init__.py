"""A machine with its damper as an FMU: a part of another simulation, by FMI 3 for co-simulation."""
