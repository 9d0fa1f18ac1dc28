"""Figures and tables in study files: their settings, and how each mistake is told."""

from pathlib import Path
from typing import Any

import pytest
import yaml

import damper
from damper.figures import draw
from damper.observers import OBSERVERS, make_observers
from damper.study.config import ConfigError, Study, load_study
from damper.study.kinds import FIGURES
from damper.study.messages import Mistakes
from damper.study.products import StudyContents
from damper.study.settings import OBSERVER_SETTINGS

GOOD: dict[str, Any] = {
    "title": "t",
    "source": "s",
    "parameters": {"damping_ratio": 0.02},
    "axes": {
        "mass_ratio": {"values": [0.1, 0.2]},
        "frequency_ratio": {"start": 0.8, "stop": 1.2, "step": 0.1},
        "clearance": {"start": 0.5, "stop": 2, "step": 0.5},
        "restitution": {"values": [0.5]},
    },
    "transient": 10,
    "periods": 10,
    "observers": {
        "stroboscopic_section": None,
        "bursts": {"records": 10},
        "response": None,
        "accumulation": None,
        "trajectory": None,
    },
}
MAP = {"kind": "map", "variable": "chatter", "x": "frequency_ratio", "y": "clearance"}
CURVES = {"kind": "curves", "variables": ["rms_ratio"], "along": "frequency_ratio"}
BIFURCATION = {"kind": "bifurcation", "along": "frequency_ratio"}
ACCUMULATION = {"kind": "accumulation", "at": {"frequency_ratio": 1}}
POINT = {"mass_ratio": 0.2, "frequency_ratio": 0.9, "clearance": 1.5}
TRAJECTORY = {"kind": "trajectory", "at": POINT}
FREE_MASS = {"kind": "free_mass", "at": POINT}
MARKED = BIFURCATION | {"each": "mass_ratio", "at": {"clearance": 1}, "mark": [0.9, 1.1]}
RELATIVE = BIFURCATION | {"each": "mass_ratio", "at": {"clearance": 1}}
RELATIVE |= {"variables": ["relative_velocity"]}
PLACE = {"frequency_ratio": 0.9, "clearance": 1.5}
HISTORIES = {"kind": "histories", "panels": "mass_ratio", "at": PLACE}
PORTRAIT = {"kind": "phase_portrait", "columns": "mass_ratio", "at": PLACE}


def load(folder: Path, figure: dict[str, Any], **changes: Any) -> Study:
    path = folder / "good.yaml"
    path.write_text(yaml.safe_dump({**GOOD, "figures": {"one": figure}, **changes}))
    return load_study(path)


def blame(folder: Path, figure: dict[str, Any], **changes: Any) -> str:
    """Return the message; of one fault only, and in plain words."""
    with pytest.raises(ConfigError) as caught:
        load(folder, figure, **changes)
    message = str(caught.value)
    assert message.startswith("1 error "), message
    for jargon in ("pydantic", "type=", "Traceback", "tuple", "None"):
        assert jargon not in message
    return message


# What is accepted.


@pytest.mark.parametrize("figure", [MAP, CURVES | {"lines": "clearance"}])
def test_a_file_for_each_value(tmp_path: Path, figure: dict[str, Any]) -> None:
    def places(change: dict[str, Any]) -> dict[str, Any]:
        files = load(tmp_path, figure | change).files("figures")
        return {path: settings["at"] for path, (_, settings) in files.items()}

    assert places({"each": "mass_ratio"}) == {
        "figures/one_mass_ratio~0.1": {"mass_ratio": 0.1},
        "figures/one_mass_ratio~0.2": {"mass_ratio": 0.2},
    }
    assert places({"at": {"mass_ratio": 0.1}}) == {"figures/one": {"mass_ratio": 0.1}}


def test_accumulation_table_needs_its_observer(tmp_path: Path) -> None:
    tables = {"one": {"kind": "accumulation", "within": 0.05}}
    assert load(tmp_path, TRAJECTORY, tables=tables).tables["one"].within == 0.05
    without = {name: None for name in GOOD["observers"] if name != "accumulation"}
    message = blame(tmp_path, TRAJECTORY, tables=tables, observers=without)
    assert "tables.one\n    needs accumulation among the observers" in message
    tables = {"one": {"kind": "accumulation", "within": 0}}
    assert "tables.one.within\n    out of range" in blame(tmp_path, TRAJECTORY, tables=tables)


def test_accumulation_is_of_the_rigid_damper_with_constant_restitution(tmp_path: Path) -> None:
    parameters = GOOD["parameters"] | {"support_stiffness_ratio": 0.1}
    message = blame(tmp_path, TRAJECTORY, parameters=parameters)
    assert "observers.accumulation\n    its formulas are those of the rigid damper" in message
    assert "this is the grounded one" in message
    message = blame(tmp_path, TRAJECTORY, parameters=GOOD["parameters"] | {"yield_speed": 0.1})
    assert "observers.accumulation\n    its formulas have a constant restitution" in message


def test_interactive_figures_are_of_rigid_walls(tmp_path: Path) -> None:
    entry = MAP | {"variable": "status", "each": "mass_ratio", "interactive": True}
    observers = {"response": None}
    study = load(tmp_path, entry, observers=observers)
    assert list(study.interactive) == ["one"]
    assert not any("interactive" in settings for _, settings in study.files("figures").values())
    parameters = GOOD["parameters"] | {"support_stiffness_ratio": 0.1}
    message = blame(tmp_path, entry, parameters=parameters, observers=observers)
    assert "figures.one.interactive\n    the page evaluates motions of the rigid damper" in message


# What is refused.

MISTAKES: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "axis without a place": (
        MAP,
        (
            "figures.one\n    axis 'mass_ratio' has 2 values but no place in the figure",
            "allowed: name it as panels or each, or give its value in at",
        ),
    ),
    "all roles taken": (
        CURVES | {"along": "clearance", "lines": "mass_ratio", "each": "restitution", "best": "r"},
        ("figures.one.best", "unknown axis 'r'", "did you mean 'restitution'?"),
    ),
    "twice": (
        MAP | {"panels": "clearance", "each": "mass_ratio"},
        ("figures.one.panels\n", "'clearance' is y already", "an axis without a place"),
    ),
    "twice in at": (
        MAP | {"each": "mass_ratio", "at": {"clearance": 1}},
        ("figures.one.at.clearance\n", "'clearance' is y already"),
    ),
    "value that is not listed": (
        MAP | {"at": {"mass_ratio": 0.12}},
        (
            "figures.one.at.mass_ratio\n    'mass_ratio' has no value 0.12",
            "allowed: one of its 2 values; the nearest is 0.1",
        ),
    ),
    "no axis in at": (
        MAP | {"each": "mass_ratio", "at": {"clearence": 1}},
        ("figures.one.at.clearence\n", "unknown axis 'clearence'", "did you mean 'clearance'?"),
    ),
    "unknown variable": (
        MAP | {"each": "mass_ratio", "variable": "chater"},
        (
            "figures.one.variable\n    no observer of the study writes 'chater'",
            "visible_impacts, chatter",
            "did you mean 'chatter'?",
        ),
    ),
    "variable of another observer": (
        MAP | {"each": "mass_ratio", "variable": "impacts_per_period"},
        ("'impacts_per_period' is written by the observer impacts, which the study lacks",),
    ),
    "variable with its own dimension": (
        CURVES | {"lines": "clearance", "each": "mass_ratio", "variables": ["displacement"]},
        ("figures.one.variables[0]\n", "writes 'displacement' as one value at each point"),
    ),
    "too many variables": (
        CURVES
        | {"lines": "clearance", "each": "mass_ratio"}
        | {"variables": ["chatter", "status", "rms_ratio", "energy_input", "impact_loss"]},
        ("figures.one.variables\n    5 variables are too many", "at most 4"),
    ),
    "map over one value": (
        MAP | {"y": "restitution", "each": "mass_ratio", "at": {"clearance": 1}},
        ("figures.one.y\n    axis 'restitution' has too few values (1)", "at least 2 values"),
    ),
    "histories beyond the stretch": (
        HISTORIES | {"stop": 11},
        ("figures.one.stop\n    stops 11 periods into a sampled stretch of 10",),
    ),
    "portrait of too many columns": (
        PORTRAIT | {"columns": "frequency_ratio", "at": {"clearance": 1, "mass_ratio": 0.1}},
        ("figures.one.columns\n    axis 'frequency_ratio' has too many values (5)", "at most 3"),
    ),
    "relative motion without the free mass": (
        RELATIVE,
        ("figures.one.variables\n    needs a section", "stroboscopic_section: {free_mass: true}"),
    ),
    "approach speeds that are not listed": (
        RELATIVE | {"variables": ["approach_speed"]},
        ("figures.one.variables\n    needs impacts that lists", "impacts: {speeds: 60}"),
    ),
    "multipliers without orbits": (
        RELATIVE | {"variables": ["displacement", "multiplier"]},
        ("figures.one.variables\n    'multiplier' is of the study's orbits", "orbits: true"),
    ),
    "motions that are not observed": (
        MAP | {"variable": "attractor", "each": "mass_ratio"},
        ("figures.one\n    needs motion among the observers",),
    ),
    "steady amplitude over other axes": (
        MAP | {"y": "mass_ratio", "at": {"clearance": 1}, "theory": "steady_amplitude"},
        ("figures.one.theory\n    the steady amplitude has no place over", "clearance as y"),
    ),
    "mark without label": (
        MARKED,
        ("figures.one.mark_label\n    'mark' is given, but 'mark_label' is missing", "text"),
    ),
    "label without mark": (
        {key: value for key, value in MARKED.items() if key != "mark"} | {"mark_label": "m"},
        ("figures.one.mark\n    'mark_label' is given, but 'mark' is missing", "[low, high]"),
    ),
    "mark of nothing": (
        MARKED | {"mark": [1, 1], "mark_label": "m"},
        ("figures.one.mark\n    low must be less than high", "[low, high], low < high"),
    ),
    "schematic at a point": (
        {"kind": "schematic", "drawing": "impact_damper", "at": POINT},
        ("figures.one.at\n    unknown key 'at'", "allowed: kind, drawing, caption"),
    ),
    "worst of what is not bad": (
        MAP | {"panels": "mass_ratio", "variable": "sticking_fraction", "worst": ["restitution"]},
        ("figures.one.worst\n    more of 'sticking_fraction' is not worse", "allowed: peak_displ"),
    ),
    "worst over an axis with a place": (
        CURVES
        | {"lines": "mass_ratio", "each": "clearance", "worst": ["restitution", "clearance"]},
        ("figures.one.worst\n    'clearance' is each already",),
    ),
    "worst over no axis": (
        CURVES | {"lines": "clearance", "each": "mass_ratio", "worst": ["drw"]},
        ("figures.one.worst\n    unknown axis 'drw'",),
    ),
    "one axis in place of a list": (
        MAP | {"panels": "mass_ratio", "worst": "restitution"},
        ("figures.one.worst\n    not a list (value: 'restitution')",),
    ),
    "share without limit": (
        MAP | {"panels": "mass_ratio", "share": ["restitution"]},
        ("figures.one.above\n    'share' is given, but 'above' is missing", "a number"),
    ),
    "limit without share": (
        MAP | {"panels": "mass_ratio", "above": 1},
        ("figures.one.share\n    'above' is given, but 'share' is missing", "[draw]"),
    ),
    "stop before start": (
        TRAJECTORY | {"start": 2, "stop": 1},
        ("figures.one.stop\n    start (2", "must be less than stop (1"),
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_refused(tmp_path: Path, name: str) -> None:
    figure, parts = MISTAKES[name]
    message = blame(tmp_path, figure)
    for part in parts:
        assert part in message, message


@pytest.mark.parametrize(
    ("figure", "observer", "words"),
    [
        (TRAJECTORY, "trajectory", "needs trajectory among the observers"),
        (PORTRAIT, "section", "needs a section among the observers"),
        (MARKED | {"mark_label": "m"}, "bursts", "needs bursts among the observers, to compare"),
        (MAP | {"each": "mass_ratio"}, "bursts", "written by the observer bursts"),
        (
            ACCUMULATION | {"rows": "mass_ratio", "each": "clearance"},
            "accumulation",
            "needs accumulation among the observers",
        ),
    ],
)
def test_observer_is_needed(
    tmp_path: Path, figure: dict[str, Any], observer: str, words: str
) -> None:
    observers = {k: v for k, v in GOOD["observers"].items() if observer not in k}
    assert words in blame(tmp_path, figure, observers=observers)


@pytest.mark.parametrize("kind", ["free_mass", "histories"])
def test_single_bursts_need_records(tmp_path: Path, kind: str) -> None:
    observers = GOOD["observers"] | {"bursts": None}
    figure = {"free_mass": FREE_MASS, "histories": HISTORIES}[kind]
    message = blame(tmp_path, figure, observers=observers)
    assert "figures.one\n    shows bursts one by one, but the observer bursts lists none" in message
    assert "allowed: records >= 1 for bursts" in message
    load(tmp_path, TRAJECTORY, observers=observers)


def test_schematics_ask_nothing_of_the_study(tmp_path: Path) -> None:
    figure = {"kind": "schematic", "drawing": "impact_damper"}
    study = load(tmp_path, figure, observers={"response": None})
    made = study.figures["one"]
    assert study.files("figures") == {"figures/one": (made, figure)}
    assert made.reads == ()
    assert all(cls.reads for kind, cls in FIGURES.items() if kind != "schematic")


def test_too_many_lines_or_panels(tmp_path: Path) -> None:
    axes = GOOD["axes"] | {"mass_ratio": {"start": 0.1, "stop": 1.3, "num": 13}}
    message = blame(tmp_path, MAP | {"panels": "mass_ratio"}, axes=axes)
    assert "axis 'mass_ratio' has too many values (13)" in message
    assert "an axis with at most 12 values, or one value in at" in message
    figure = CURVES | {"lines": "mass_ratio", "best": "clearance"}
    assert "too many values (13)" in blame(tmp_path, figure, axes=axes)


# Branches: several runs at each point.


def followed(way: str) -> dict[str, Any]:
    axis = GOOD["axes"]["frequency_ratio"] | {"follow": way}
    return {"axes": GOOD["axes"] | {"frequency_ratio": axis}}


def test_directions_need_a_place(tmp_path: Path) -> None:
    figure = MAP | {"each": "mass_ratio"}
    message = blame(tmp_path, figure, **followed("both"))
    assert "the study has several runs at each point (direction)" in message
    assert (
        "allowed: name it as panels or worst or share, or give its value: at: {direction: up}"
        in message
    )
    load(tmp_path, figure | {"at": {"direction": "down"}}, **followed("both"))
    load(tmp_path, figure | {"panels": "direction"}, **followed("both"))
    at = {"mass_ratio": 0.1, "clearance": 1}
    load(tmp_path, CURVES | {"lines": "direction", "at": at}, **followed("both"))


def test_basins_need_starts(tmp_path: Path) -> None:
    """Points of the grid are none, nor are the starts that the figure counts along."""
    figure = {"kind": "basins", "along": "clearance"}
    given: dict[str, Any] = {"observers": {"motion": None}}
    starts = {"initial_displacement": {"values": [0, 1]}}
    for along, axes in (("clearance", {}), ("initial_displacement", starts)):
        message = blame(tmp_path, figure | {"along": along}, axes=GOOD["axes"] | axes, **given)
        assert "needs several starts" in message
        assert "allowed: draws, or axes, of initial quantities" in message
    load(tmp_path, figure, axes=GOOD["axes"] | starts, **given)
    load(tmp_path, figure, draws={"count": 3, "seed": 1, "initial_position": [-1, 1]}, **given)


def test_draws_may_be_reduced(tmp_path: Path) -> None:
    given: dict[str, Any] = {"draws": {"count": 3, "seed": 1, "initial_position": [-1, 1]}}
    given |= followed("both")
    branches = ["draw", "direction"]
    load(tmp_path, MAP | {"each": "mass_ratio", "worst": branches}, **given)
    share = {"variable": "sticking_fraction", "share": branches, "above": 0.5}
    load(tmp_path, MAP | {"each": "mass_ratio"} | share, **given)
    figure = CURVES | {"lines": "clearance", "each": "mass_ratio", "worst": branches}
    load(tmp_path, figure, **given)
    observers = GOOD["observers"] | {"impacts": None}
    table = {"kind": "performance", "along": "frequency_ratio", "over": "clearance"}
    tables = {"one": table | {"worst": branches}}
    load(tmp_path, figure, **given, tables=tables, observers=observers)
    tables = {"one": table | {"worst": ["draw"]}}
    message = blame(tmp_path, figure, **given, tables=tables, observers=observers)
    assert "tables.one\n    the study has several runs at each point (direction)" in message
    assert "allowed: worst: [direction]" in message
    motions = MAP | {"each": "mass_ratio", "variable": "attractor", "share": ["draw"], "above": 0}
    motions |= {"at": {"direction": "up"}}
    message = blame(tmp_path, motions, **given, observers=observers | {"motion": None})
    assert "figures.one.share\n    motions are above no limit" in message


def test_draws_need_a_place_but_in_bifurcations(tmp_path: Path) -> None:
    draws = {"count": 3, "seed": 1, "initial_position": [-1, 1]}
    message = blame(tmp_path, TRAJECTORY, draws=draws)
    assert "several runs at each point (draw)" in message
    assert "give its value: at: {draw: 0}" in message
    load(tmp_path, TRAJECTORY | {"at": POINT | {"draw": 2}}, draws=draws)
    figure = BIFURCATION | {"rows": "mass_ratio", "at": {"clearance": 0.5}}
    load(tmp_path, figure, draws=draws)
    message = blame(tmp_path, TRAJECTORY | {"at": POINT | {"draw": -1}}, draws=draws)
    assert "figures.one.at.draw\n    out of range (value: -1)" in message
    message = blame(tmp_path, figure | {"each": "draw"}, draws=draws)
    assert "unknown axis 'draw'" in message


def told(figure: dict[str, Any], study: StudyContents) -> list[str]:
    """Return what a figure asks for and the study lacks."""
    mistakes = Mistakes()
    FIGURES[figure["kind"]].model_validate(figure).check_against(study, mistakes)
    return [line["type"].context["message"] for line in mistakes.lines]


@pytest.mark.parametrize(
    ("branches", "at", "words"),
    [
        ({"direction": ("up",)}, {}, None),
        ({"direction": ("up", "down")}, {}, "several runs at each point (direction)"),
        ({"direction": ("up",)}, {"direction": "down"}, "'direction' has no value 'down'"),
        ({"draw": (0, 1, 2)}, {"draw": 3}, "'draw' has no value 3"),
    ],
)
def test_known_values_of_branches(
    branches: dict[str, tuple[Any, ...]], at: dict[str, Any], words: str | None
) -> None:
    axes = {"frequency_ratio": (1.0, 2.0), "clearance": (1.0, 2.0)}
    bursts = OBSERVER_SETTINGS["bursts"].model_validate({})
    messages = told(MAP | {"at": at}, StudyContents(axes, branches, {"bursts": bursts}, {}, 10))
    assert (messages == []) if words is None else (len(messages) == 1 and words in messages[0])


# Whatever observers write.

ALL_WRITTEN = {"response": {"modulation_work": True}, "bursts": {"records": 2}}
POINTS = {"frequency_ratio": [0.8, 0.9], "clearance": [0.2, 0.4]}
DAMPER = {"mass_ratio": 0.1, "damping_ratio": 0.02, "restitution": 0.5}


@pytest.mark.parametrize("observer", OBSERVERS)
def test_every_variable_with_one_value_at_each_point_is_drawn(
    tmp_path: Path, observer: str
) -> None:
    observers = {observer: ALL_WRITTEN.get(observer)}
    run: dict[str, Any] = {"transient": 2, "periods": 5, "observers": observers}
    cube = damper.simulate(**DAMPER, **POINTS, **run)
    (made,) = make_observers(observers)
    axes = {axis: {"values": values} for axis, values in POINTS.items()}
    for name in [variable.name for variable in made.variables if not variable.dims]:
        for figure in (
            MAP | {"variable": name},
            CURVES | {"variables": [name], "lines": "clearance"},
        ):
            given = {"parameters": DAMPER, "axes": axes} | run
            _, settings = load(tmp_path, figure, **given).files("figures")["figures/one"]
            assert draw(settings.pop("kind"), {"cube": cube}, **settings).axes


def test_variable_of_a_setting_that_is_not_set(tmp_path: Path) -> None:
    work = MAP | {"each": "mass_ratio", "variable": "modulation_work"}
    message = blame(tmp_path, work)
    assert "written by the observer response, where modulation_work is set" in message
    # What is wrong with an observer is said once, where it stands.
    observers = GOOD["observers"] | {"response": {"modulation_work": "of course"}}
    assert "observers.response.modulation_work" in blame(tmp_path, work, observers=observers)


# Convergence to the rigid damper.

CONTACT = {
    "axes": {
        "contact_stiffness_ratio": {"values": [1e4, 1e6]},
        "contact_tension": {"values": [0, 1]},
    }
}
CONVERGENCE = {
    "kind": "convergence",
    "variables": ["rms_ratio", "displacement", "burst_onset"],
    "along": "contact_stiffness_ratio",
    "lines": "contact_tension",
}


def contact(**changes: Any) -> dict[str, Any]:
    point = {"clearance": 1.0, "frequency_ratio": 0.9, "mass_ratio": 0.1, "restitution": 0.5}
    observers = {"stroboscopic_section": None, "bursts": {"records": 1}, "response": None}
    given = {"parameters": GOOD["parameters"] | point, "observers": observers}
    return given | CONTACT | changes


def test_convergence_is_accepted(tmp_path: Path) -> None:
    load(tmp_path, CONVERGENCE, **contact(tables={"one": CONVERGENCE}))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"variables": ["burst_nonsense"]}, "burst_nonsense"),
        (
            {"variables": ["status", "chatter", "rms_ratio", "visible_impacts", "velocity"]},
            "too many for one figure",
        ),
        ({"along": "contact_tension", "lines": None}, "no stiffness of the contact"),
        ({"along": "clearance"}, "unknown axis 'clearance'"),
    ],
)
def test_convergence_names_what_is_wrong(
    tmp_path: Path, change: dict[str, Any], words: str
) -> None:
    figure = {k: v for k, v in (CONVERGENCE | change).items() if v is not None}
    if change.get("along") == "contact_tension":
        figure["at"] = {"contact_stiffness_ratio": 1e4}
    assert words in blame(tmp_path, figure, **contact())


@pytest.mark.parametrize("section", ["figures", "tables"])
def test_convergence_of_a_record_needs_records(tmp_path: Path, section: str) -> None:
    parts = contact(observers={"response": None, "stroboscopic_section": None, "bursts": None})
    without = CONVERGENCE | {"variables": ["chatter", "displacement"]}
    products = {"figures": without, "tables": without} | {section: CONVERGENCE}
    parts["tables"] = {"one": products["tables"]}
    message = blame(tmp_path, products["figures"], **parts)
    assert f"{section}.one\n    shows bursts one by one" in message
    assert message.count("one by one") == 1
    load(tmp_path, without, **parts | {"tables": {"one": without}})


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"along": "clearence", "start": 1}, "did you mean 'clearance'?"),
        ({"along": "clearance", "start": 5}, "orbits.two.start\n    'start' is outside of the"),
        (
            {"along": "clearance", "start": 1, "at": {"mass_ratio": 3}},
            "'mass_ratio' has no value 3",
        ),
        (
            {"along": "clearance", "start": 1, "curves": {"folds": {"restitution": [0, 1]}}},
            "did you mean 'fold'?",
        ),
        (
            {"along": "clearance", "start": 1, "curves": {"fold": {"damping_ratio": [0.5, 1]}}},
            "a range that holds these values",
        ),
    ],
)
def test_orbits_follow_an_axis_from_a_value_of_it(
    tmp_path: Path, entry: dict[str, Any], message: str
) -> None:
    parts: dict[str, Any] = {"orbits": {"two": entry}, "figures": {}, "tables": {}}
    assert message in blame(tmp_path, GOOD, **parts)


def test_curves_of_special_points_are_those_of_orbits(tmp_path: Path) -> None:
    """A second parameter may be any, not only an axis."""
    two = {"along": "clearance", "start": 1, "at": {"mass_ratio": 0.1, "frequency_ratio": 1}}
    two["curves"] = {"fold": {"restitution": [0.4, 0.6], "damping_ratio": [0.01, 0.1]}}
    figure = {"kind": "special_points", "x": "damping_ratio", "y": "clearance"}
    load(tmp_path, figure, orbits={"two": two})
    message = blame(tmp_path, figure | {"x": "mass_ratio"}, orbits={"two": two})
    assert "figures.one.y\n    the study follows no special points over mass_ratio and" in message
    assert "clearance and damping_ratio, clearance and restitution" in message
    assert "not text" in blame(tmp_path, figure | {"x": ["mass_ratio"]}, orbits={"two": two})
    message = blame(tmp_path, figure | {"theory": "small_mass_limit"}, orbits={"two": two})
    assert "figures.one.theory\n    the small-mass limit has no place over" in message


def test_special_points_are_those_of_orbits(tmp_path: Path) -> None:
    tables = {"points": {"kind": "special_points"}}
    message = blame(tmp_path, GOOD, figures={}, tables=tables)
    assert "shows periodic motions, but the study follows none" in message
