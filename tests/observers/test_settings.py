"""Settings of observers: what is declared once is checked, and refused in plain words."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from damper.observers import OBSERVERS, make_observers, observer_class
from damper.observers.common.base import Observer
from damper.observers.common.settings import Setting

REFUSED = yaml.safe_load((Path(__file__).parent / "mistakes.yaml").read_text())


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
