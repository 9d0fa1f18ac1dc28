"""What the two kinds of section share."""

from damper.compiled import compiled
from damper.variables import LENGTH, SPEED, Variable


def section_variables(where: str, free_mass: bool) -> tuple[Variable, ...]:
    """Describe the variables of a section, which are the same for every kind of section."""
    variables = (
        Variable("displacement", f"primary displacement {where}", LENGTH, ("sample",)),
        Variable("velocity", f"primary velocity {where}", SPEED, ("sample",)),
    )
    if free_mass:
        variables += (
            Variable("free_displacement", f"free mass displacement {where}", LENGTH, ("sample",)),
            Variable("free_velocity", f"free mass velocity {where}", SPEED, ("sample",)),
        )
    return variables


@compiled
def free_state(
    clearance: float, side: float, x: float, v: float, gap: float, rate: float
) -> tuple[float, ...]:
    """Displacement and velocity of the free mass from the primary's and the gap's."""
    return x + side * (clearance - gap), v - side * rate
