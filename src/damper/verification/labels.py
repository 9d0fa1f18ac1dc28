"""What people read in figures and tables for the names in files and code."""

#: Names that are not their words with underscores.
LABELS = {
    "touch": "gap at impact",
    "tensile_force": "tensile contact force",
    "backwards": "step back in time",
    "time_varying": "time-varying",
}


def label(name: str) -> str:
    """Return the words for a name in code, a file or a study.

    Examples
    --------
    >>> label("impact_section")
    'impact section'
    """
    return LABELS.get(name, name.replace("_", " "))
