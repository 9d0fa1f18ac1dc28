"""What people read in figures and tables for the names in files and code."""

#: Names of laws, models and solvers that are not their words with underscores.
LABELS = {
    "touch": "gap at impact",
    "tensile_force": "tensile contact force",
    "backwards": "step back in time",
    "time_varying": "time-varying",
    "exact": "exact engine",
    "rk4_step_end": "RK4, impacts at step ends",
    "rk4_located": "RK4 with located impacts",
    "dop853": "scipy DOP853, restarted",
    "dop853_free": "scipy DOP853, restarted, no sticking",
    "rk45": "scipy RK45, restarted",
    "lsoda": "scipy LSODA, restarted",
    "radau": "scipy Radau, restarted",
    "moreau_jean": "Moreau-Jean",
    "compliant_flow": "stiff springs, exact flow",
    "compliant_stiff": "stiff springs, scipy Radau",
}


def label_of(name: str) -> str:
    """Return the words for a name in code, a file or a study.

    Examples
    --------
    >>> label_of("impact_section")
    'impact section'
    """
    return LABELS.get(name, name.replace("_", " "))
