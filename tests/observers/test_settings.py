"""Settings of observers: what is declared once is checked, and refused in plain words."""

import math
from typing import Any

import pytest

from damper.observers import OBSERVERS, make_observers, observer_class
from damper.observers.common.base import Observer
from damper.observers.common.settings import Setting

#: Observer, setting, values that it refuses, and what the message says.
REFUSED = [
    ("stroboscopic_section", "when", [1.0, math.nan, "0.5"], "a number >= 0 and < 1"),
    ("impact_section", "wall", ["up"], "one of 'left', 'right'"),
    ("impact_section", "samples", [0, 1.5, True], "a whole number >= 1 and <= 100000"),
    ("impact_section", "free_mass", [1], "True or False"),
    (
        "impacts",
        "threshold",
        [
            *(1.0, "0.1", {"speed": 0.0}, {"fraction": 1.5}),
            *({"speed": 1.0, "fraction": 0.1}, {}, {"sped": 1.0}),
        ],
        r"a fraction in \(0, 1\)",
    ),
    (
        "bursts",
        "compare_thresholds",
        [[1.0], [0.1, 0.1], 0.1],
        "a list of distinct numbers, each > 0 and < 1",
    ),
    ("chatter_bursts", "since", [[], [-1.0], [0.0, math.nan]], "a list of at least 1 distinct"),
    ("trajectory", "length", [0.0, -1.0, math.inf], "a number > 0"),
]


@pytest.mark.parametrize(
    ("observer", "setting", "bad", "allowed"),
    [(name, setting, bad, allowed) for name, setting, all_, allowed in REFUSED for bad in all_],
)
def test_bad_value_is_refused(observer: str, setting: str, bad: Any, allowed: str) -> None:
    with pytest.raises(ValueError, match=rf"^{observer}\.{setting} = .*: must be {allowed}"):
        make_observers({observer: {setting: bad}})


@pytest.mark.parametrize("name", OBSERVERS)
def test_declared_once(name: str) -> None:
    """The file's name is the observer's, every setting has a default that it allows."""
    cls = observer_class(name)
    assert issubclass(cls, Observer)
    assert cls.__module__ == f"damper.observers.{name}"
    assert cls.__doc__
    (observer,) = make_observers([name])
    for key, setting in cls.settings.items():
        assert setting.meaning.endswith(".")
        held = getattr(observer, key)
        (again,) = make_observers({name: {key: setting.default}})
        assert getattr(again, key) == held
    assert observer.variables


def test_unknown_names_get_the_nearest() -> None:
    with pytest.raises(ValueError, match=r"unknown observer 'burst' \(did you mean 'bursts'\?\)"):
        make_observers(["burst"])
    with pytest.raises(ValueError, match=r"impacts: unknown setting 'treshold' .*'threshold'"):
        make_observers({"impacts": {"treshold": 0.1}})


def test_a_subclass_fixes_a_setting() -> None:
    class Section(Observer):
        at = Setting(0.0, "When.", ge=0)
        depth = Setting(1, "How deep.")

    class Middle(Section):
        at = 0.5

    assert list(Middle.settings) == ["depth"]
    assert Middle(depth=2.0).depth == 2
    assert Middle().at == 0.5
    with pytest.raises(ValueError, match="unknown setting 'at'"):
        Middle(at=0.1)
