"""What people read in figures and tables for the names in files and code."""

#: Names that are not their words with underscores.
LABELS: dict[str, str] = {}


def label(name: str) -> str:
    """Return the words for a name.

    Examples
    --------
    >>> label("impact_section")
    'impact section'
    """
    return LABELS.get(name, name.replace("_", " "))
