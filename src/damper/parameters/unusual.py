"""Values that few machines have: a unit may be wrong there, which no refusal can know."""

import math
from collections.abc import Collection, Iterable, Mapping

from damper.parameters.names import common_name

#: Quantity -> least and most of what machines usually have, unit, the same in another unit.
USUAL = {
    **dict.fromkeys(("mass", "primary_mass"), (1e-3, 1e7, "kg", "0.5 t")),
    **dict.fromkeys(("natural_frequency", "forcing_frequency"), (0.05, 2e4, "Hz", "1200 rpm")),
    "damping_ratio": (0.0, 0.3, "", "2 %"),
    "base_amplitude": (1e-8, 0.5, "m", "0.1 mm"),
    "initial_displacement": (1e-7, 1.0, "m", "10 mm"),
    **dict.fromkeys(("largest_mass", "free_mass"), (1e-6, 1e6, "kg", "500 g")),
    **dict.fromkeys(("largest_gap", "gap"), (1e-6, 0.5, "m", "20 mm")),
    "gap_tolerance": (0.0, 0.05, "m", "0.1 mm"),
}


def unusual(values: Mapping[str, Iterable[float]]) -> tuple[str, ...]:
    """A sentence for each quantity with a value that few machines have.

    Frequencies are in Hz. Zero and infinity are never unusual.

    Examples
    --------
    >>> [text.partition(":")[0] for text in unusual({"gap": [0.02, 20.0], "free_mass": [0.1]})]
    ['gap = 20 m is unusual']
    """
    found = []
    for name, numbers in values.items():
        common = common_name(name)
        least, most, unit, example = USUAL.get(common, (0.0, math.inf, "", ""))
        for value in map(abs, numbers):
            if value and value < math.inf and not least <= value <= most:
                shown, usual = f"{value:g} {unit}".strip(), f"{least:g} to {most:g} {unit}".strip()
                found.append(
                    f"{name} = {shown} is unusual: {usual} is usual. Is another unit meant, as in "
                    f"{example}? It is taken as it stands."
                )
                break
    return tuple(found)


def unusual_damper(values: Mapping[str, Collection[float]], kind: str) -> tuple[str, ...]:
    """As `unusual`, of a damper in SI units and of what follows from its quantities.

    Parameters
    ----------
    values : mapping of str to collection of float
        Values of quantities of `SIParameters`, all combined.
    kind : str
        Kind of the force.

    Examples
    --------
    >>> values = {"primary_mass": [2.0], "damping": [40.0], "stiffness": [200.0]}
    >>> [text.partition(":")[0] for text in unusual_damper(values, "harmonic")]
    ['damping_ratio = 1 is unusual']
    """
    found = {name: [min(each), max(each)] for name, each in values.items()}
    if kind == "base" and "force_amplitude" in found:
        found["base_amplitude"] = found["force_amplitude"]
    rates = {"forcing_frequency": found.pop("forcing_frequency", [])}
    (light, heavy), (soft, stiff) = (
        found.get("primary_mass", (0, 0)),
        found.get("stiffness", (0, 0)),
    )
    if light > 0.0 and soft > 0.0:
        rates["natural_frequency"] = [math.sqrt(soft / heavy), math.sqrt(stiff / light)]
        low, high = found.get("damping", (0.0, 0.0))
        found["damping_ratio"] = [
            0.5 * low / math.sqrt(stiff * heavy),
            0.5 * high / math.sqrt(soft * light),
        ]
    return unusual(found | {name: [rate / math.tau for rate in two] for name, two in rates.items()})
