"""Measures of a run on a structure. Kept light: studies are checked without the engine."""

from damper.parameters.variables import STATUS, Variable

_RELATIVE = "relative to the base where that moves"
#: Quantities of the motion of a point, and their units.
RESULTS_OF_POINTS = (("displacement", "m"), ("velocity", "m/s"), ("acceleration", "m/s2"))
#: Measures of a run.
RESULTS = (
    *(
        Variable(
            f"{how}_{what}", f"{text} {what} of the point", unit, ("point",), comment=_RELATIVE
        )
        for what, unit in RESULTS_OF_POINTS
        for how, text in (("peak", "largest"), ("rms", "rms"))
    ),
    Variable(
        "amplitude",
        "amplitude of the point",
        "m",
        ("point",),
        comment="half the range of displacements in a cycle, the mean over whole cycles",
    ),
    Variable("impacts_per_cycle", "impacts in a cycle", "1", ("body",)),
    Variable("mean_approach_speed", "mean approach speed", "m/s", ("body",)),
    Variable("max_approach_speed", "largest approach speed", "m/s", ("body",)),
    Variable(
        "impact_power",
        "power lost in impacts",
        "W",
        ("body",),
        comment="closed bursts included; impacts of one instant count with one of their masses",
    ),
    Variable("tie_power", "power lost in the dashpot of the tie", "W", ("body",)),
    Variable("friction_power", "power lost in dry friction on the box", "W", ("body",)),
    Variable("mode_power", "power lost in the structure's damping, by mode", "W", ("mode",)),
    Variable("mean_energy", "mean energy of the mode", "J", ("mode",)),
    Variable("input_power", "power of the force", "W"),
    Variable(
        "power_residual",
        "input less losses and change of the stored energy",
        "W",
        comment="zero in exact arithmetic: shows how well the balance closes",
    ),
    STATUS,
)
#: Samples of a run's first cycles.
HISTORY = (
    Variable("time", "time since the window begins", "s", ("instant",)),
    Variable("displacement", "displacement of the point", "m", ("instant", "point")),
    Variable("mode_energy", "energy of the mode", "J", ("instant", "mode")),
)
#: Variables of a cube of a structure, and its dimensions beside the axes.
VARIABLES = (*RESULTS, *HISTORY)
DIMENSIONS = ("point", "body", "mode", "instant")
#: Most points of a grid.
MOST_POINTS = 10_000
