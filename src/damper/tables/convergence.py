"""How a compliant contact approaches the rigid wall as it stiffens: distances and their order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.analysis.convergence import distance_to_rigid, order_of_convergence
from damper.analysis.labels import label_of
from damper.parameters.lazy import pd
from damper.parameters.quantities import MODEL_NAMES
from damper.study import products
from damper.study.fields import DistinctList, Text
from damper.study.messages import Mistakes
from damper.study.settings import SECTIONS
from damper.study.yaml_file import join_names
from damper.tables import Table, number, place_cells, with_units

#: Axes of stiffness, in either system of units.
STIFFNESSES = ("contact_stiffness_ratio", "contact_stiffness")

#: Recorded variables that may be compared with the rigid damper -> their observers.
_RECORDED = {
    "displacement": SECTIONS,
    "velocity": SECTIONS,
    **dict.fromkeys(products.BURST_RECORDS, ("bursts",)),
}

Compared = Annotated[
    DistinctList[Text],
    Field(
        description="Variables of the cube, each with one value at each point; or displacement "
        "or velocity, of which the section's last sample counts, or burst_onset, burst_duration, "
        "burst_accumulation_time, burst_sticking_time, of which the first record counts "
        "(records: 1); 4 at most."
    ),
]
Stiffness = Annotated[Text, Field(description="Axis of the contact's stiffness.")]
Conventions = Annotated[
    Text | None,
    Field(description="Axis of whose values, two at most, each makes a line: contact_tension."),
]


def check_convergence(settings: Any, study: products.StudyContents, mistakes: Mistakes) -> None:
    """Note what a study lacks for a comparison with the rigid damper."""
    for i, name in enumerate(settings.variables):
        needed = _RECORDED.get(name)
        if needed is None:
            products.check_written(("variables", i), name, study, mistakes)
        elif not any(observer in study.observers for observer in needed):
            message = f"'{name}' needs {' or '.join(needed)} among the observers"
            mistakes.add(("variables", i), message, " or ".join(needed))
    if "bursts" in study.observers and set(settings.variables).intersection(products.BURST_RECORDS):
        products.require_listed_bursts(study, mistakes)
    if len(settings.variables) > products.MOST_VARIABLES:
        message = f"{len(settings.variables)} variables are too many for one figure"
        mistakes.add(("variables",), message, f"at most {products.MOST_VARIABLES}")
    if settings.along in study.axes and settings.along not in STIFFNESSES:
        message = f"'{settings.along}' is no stiffness of the contact"
        mistakes.add(("along",), message, join_names(STIFFNESSES))
    for name in study.axes:
        if name not in MODEL_NAMES["compliant"]:
            message = f"axis '{name}' is not of the contact: the rigid damper is run at one point"
            mistakes.add((), message, "a study with no axes but those of the contact")


class ConvergenceTable(products.Product):
    """The same as a table: value, rigid value and distance at each stiffness, and the order."""

    roles: ClassVar[Mapping[str, products.Role]] = {
        "along": products.Role(least=2),
        "lines": products.Role(most=2),
    }
    runs_more = True

    variables: Compared
    along: Stiffness
    lines: Conventions = None

    def check_against(self, study: products.StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        check_convergence(self, study, mistakes)


def make(results: Mapping[str, Any], settings: ConvergenceTable) -> Table:
    """Write the distances to the rigid damper."""
    cube = results["cube"]
    along, lines = settings.along, settings.lines
    data = distance_to_rigid(cube, settings.variables, along)
    rows = []
    for place, group in data.groupby(["variable", *([lines] if lines else [])], sort=False):
        name = str(place[0])
        row = {"variable": with_units(label_of(name), cube[name])}
        row |= place_cells({lines: place[1]}, cube) if lines else {}
        row["rigid value"] = f"{group['rigid_value'].iloc[0]:.9g}"
        for stiffness, distance in zip(group[along], group["distance"], strict=True):
            row[f"{stiffness:g}"] = number(distance, ".2e")
        order = order_of_convergence(group[along].to_numpy(), group["distance"].to_numpy())
        rows.append({**row, "order": f"{order:.3f}"})
    how = (
        f"Columns of numbers: distance at each {label_of(along)}. The rigid value is that "
        "of one run with rigid walls; the order is the exponent of the power law that fits the "
        "distances over the stiffer half of the decades best, -1/2 where they fall as the time of "
        "contact."
    )
    return Table.of(cube, "distance to the rigid damper", data, [how, pd.DataFrame(rows)])
