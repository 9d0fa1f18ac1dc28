"""Compiled and plain are one source; a stale cache never answers; importing stays light."""

import importlib.util
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from new_process import in_new_process, modules_after

import damper
from damper.engine import compiled

SOURCE = Path(damper.__file__).parent
needs_numba = pytest.mark.skipif(
    importlib.util.find_spec("numba") is None, reason="numba is not installed"
)

#: Every model and law at ordinary and at extreme parameters; what observers make of them.
RUNS = """
import json, sys
from dataclasses import asdict
import damper
from damper.engine.compiled import COMPILED, compile_at_once
from damper.sweep.runs import run_points
compile_at_once()
P, S = damper.Parameters, damper.State
GROUNDED = dict(support_stiffness_ratio=0.05, support_damping_ratio=0.02)
CONTACT = dict(contact_stiffness_ratio=1e8)
VARYING = dict(modulation_depth=0.4, modulation_order=3)
runs = [
    (P(0.1, 0.05, 0.2, 0.25, 0.6), None, 60.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.0), None, 60.0),
    (P(0.1, 0.0, 1.0, 2.0, 0.9, 0.5), S(0.1, 0.2, 0.3, -0.4), 60.0),
    (P(2.0, 3.0, 0.5, 0.2, 1.0), S(0.1, 0.0, 0.0, 1.0), 60.0),
    (P(1e-6, 1.0, 10.0, 0.005, 0.7), None, 20.0),
    (P(1e18, 10.0, 0.7, 0.05, 0.8), S(0.0, 0.0, 0.0, 1.0), 5.0),
    (P(0.3, 0.1, 1e3, 1e-3, 0.7), S(1.0, 0.0, 1.0, 0.0), 2.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.6, yield_speed=0.1), None, 60.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.6, **GROUNDED), None, 40.0),
    (P(0.3, 10.0, 0.5, 0.1, 0.5, support_stiffness_ratio=1e5), S(0.0, 0.0, 0.1, 1.0), 1.0),
    (P(0.3, 0.1, 0.5, 0.0, 0.5, support_damping_ratio=20.0), None, 40.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.3, **CONTACT), None, 21.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.3, **CONTACT, contact_tension=1), None, 21.0),
    (P(0.1, 0.05, 0.2, 0.0, 0.3, contact_stiffness_ratio=30.0), None, 21.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.3, **CONTACT, restitution_left=0.5, gravity=0.1), None, 21.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.3, **VARYING), None, 60.0),
    (P(1e6, 10.0, 0.7, 5e-3, 0.5, modulation_depth=0.999999), S(0.0, 0.0, 0.0, 0.1), 5.0),
    (P(2.0, 3.0, 0.5, 0.0, 1.0, modulation_depth=0.9), S(0.1, 0.0, 0.1, 1.0), 60.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.6, friction=0.02), None, 60.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.6, friction=0.5, gravity=0.1), S(0.1, 0.0, 0.1, 1.0), 60.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.6, masses=[{}, dict(clearance=0.4)]), None, 40.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.6, masses=[{}, dict(mass_ratio=0.5, friction=0.1)]), None, 40.0),
]
found = []
for parameters, state, until in runs:
    if MODEL != (parameters.main_feature if parameters.law == "constant" else parameters.law):
        continue
    rows = damper.events(parameters, state, until=until, max_events=60)
    found.append([[float(v).hex() for v in row] for row in rows.tolist()])
    bodies = {"bodies": [0, 1]} if MODEL == "several" else {}
    together = [{"response": {}, "bursts": bodies, "impacts": bodies, "stroboscopic_section": {}}]
    if MODEL == "rigid":
        together += [["impact_section", "accumulation", "trajectory", "motion"]]
    for observers in together if not ALONE else ():
        # One that its events do not last for, too.
        for periods, max_events in ((1, 1000), (3, 20)):
            arrays, _ = run_points(
                [parameters.given], observers, state=state, transient=0, periods=periods,
                max_events=max_events,
            )
            found.append({name: array.tobytes().hex() for name, array in arrays.items()})
print(json.dumps([COMPILED, "numba" in sys.modules, found]))
"""


def run(code: str, folder: Path = SOURCE.parent, **variables: str) -> str:
    """Output of code in a fresh interpreter that finds damper in `folder`."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env={**os.environ, "PYTHONPATH": str(folder), **variables},
        capture_output=True,
        text=True,
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


#: Compiling another model, or the rigid one with another law, takes half a minute or more each,
#: without observers a part of that. Time-varying masses are in no study of the reduced workflow.
OTHERS = [
    pytest.param(model, marks=pytest.mark.exhaustive)
    for model in ("grounded", "compliant", "sliding", "several", "time_varying")
]
YIELDING = pytest.param("yielding", marks=pytest.mark.exhaustive)


@needs_numba
@pytest.mark.parametrize("model", ["rigid", "time_varying alone", *OTHERS, YIELDING])
def test_compiled_and_plain_give_the_same_bytes(model: str) -> None:
    """Chaotic runs included. Plain Python neither warns nor raises: no nan or inf comes up."""
    code = f"MODEL, *ALONE = {model.split()!r}\n{RUNS}"
    fast = in_new_process(code, "-W", "error", DAMPER_COMPILE="1")
    plain = in_new_process(code, "-W", "error", DAMPER_COMPILE="0")
    assert (fast[:2], plain[:2]) == ([True, True], [False, False])
    for one, other in zip(fast[2], plain[2], strict=True):
        assert one == other
    rows = [row for found in plain[2] if isinstance(found, list) for row in found]
    assert len(rows) > 30
    assert not [row for row in rows if "nan" in row or "inf" in row]


# --- when it compiles

YOUNG = """
import json, sys
import damper
import damper.engine.trajectory
from damper.engine import compiled
found = ["numba" in sys.modules]
short = damper.events(damper.Parameters(0.1, 0.05, 0.2, 0.25, 0.6), until=30.0)
found.append("numba" in sys.modules)
# Long without an event, in one piece for who runs it.
compiled.LOADING = compiled.COMPILING = 0.1
run = damper.models.start_run(damper.Parameters(0.1, 0.0, 1.3, 1e9, 0.6))
run.skip(3e4)
found.append("numba" in sys.modules)
print(json.dumps([*found, len(short)]))
"""


@needs_numba
def test_a_process_compiles_when_it_pays() -> None:
    """Importing and a short run do not load numba; a long run does not stay plain."""
    *loaded, count = in_new_process(YOUNG, "-W", "error", DAMPER_COMPILE="1")
    assert loaded == [False, False, True]
    assert count > 3


SWEEP = """
import json
from damper.engine import compiled
compiled.LOADING, compiled.COMPILING = 0.0, 0.02
names = "one", "long", "other", "last"
for name in names:
    exec(f"@compiled.compiled\\ndef {name}(x):\\n while x > 0.0:\\n  x -= 1.0\\n return x")
def said():
    return [name for name in names if globals()[name]._entries]
found = []
with compiled.compiling(at_once=False):
    one(1.0), long(1.0)
    found.append(said())
    while not said():
        long(1e5)
    one(1.0)
    found.append(said())
other(1.0)
found.append(said())
with compiled.compiling():
    last(1.0)
print(json.dumps([*found, said()]))
"""


@needs_numba
def test_a_sweep_compiles_all_as_soon_as_one_function_is_worth_it() -> None:
    """Or at once, where it is known to be long; other calls run plain as before."""
    found = in_new_process(SWEEP, "-W", "error", DAMPER_COMPILE="1")
    assert found == [[], ["one", "long"], ["one", "long"], ["one", "long", "last"]]


#: A module of two functions, of which one becomes a part of the other.
PARTS = """
from damper.engine.compiled import compiled
@compiled
def part(x):
    return 2.0 * x
@compiled
def whole(x):
    return part(x) + 1.0
"""

#: What another version of numba may do -> whether machine code is spared.
CHANGES = {
    "nothing": ("", True),
    "another version": ("numba.version_info = numba.version_info._replace(short=(0, 99))", True),
    "no such class": ("import numba.core.codegen as c; del c.JITCodeLibrary", False),
    "another compiler": (
        "numba.version_info = numba.version_info._replace(short=(0, 99))\n"
        "from numba.core.compiler import Compiler\n"
        "before = Compiler.define_pipelines\n"
        "def define_pipelines(self):\n"
        "    if self.state.library: raise AttributeError('library')\n"
        "    return before(self)\n"
        "Compiler.define_pipelines = define_pipelines",
        False,
    ),
}


@needs_numba
@pytest.mark.parametrize("change", CHANGES)
def test_another_numba_compiles_as_it_always_does(tmp_path: Path, change: str) -> None:
    """Its private classes may differ: then inner functions get machine code of their own."""
    text, spared = CHANGES[change]
    (tmp_path / "parts.py").write_text(PARTS)
    code = (
        f"import json, sys, numba\nsys.path.insert(0, {str(tmp_path)!r})\n{text}\n"
        "from damper.engine.compiled import INNER_OPTIONS, compile_at_once\n"
        "from parts import whole\ncompile_at_once()\n"
        "print(json.dumps([whole(1.5), len(whole._entries), 'pipeline_class' in INNER_OPTIONS]))"
    )
    settings = {"NUMBA_CACHE_DIR": str(tmp_path), "DAMPER_COMPILE": "1"}
    assert in_new_process(code, **settings) == [4.0, 1, spared]


TWICE = """
import gc, json, threading
import damper
from damper.engine.compiled import Compiled, compile_at_once
from damper.models import start_run
compile_at_once()

def versions():
    entries = [c._outer for c in gc.get_objects() if type(c) is Compiled and c._outer]
    return {e.py_func.__name__: len(e.signatures) for e in entries}

def use(state, **values):
    given = dict(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.2, clearance=0.25,
                 restitution=0.6)
    p = damper.Parameters(**given | values)
    run = start_run(p, state, max_events=1000)
    run.skip(1)
    list(run.segments(2))
    run.state_at(2)
    return damper.events(p, state, until=20).tobytes().hex()

use(damper.State(0.0, 0.0, 0.0, 0.0))
results = [use(None)]
first = versions()
use(damper.State(0, 1, 0, 0, 3), phase=1, restitution=0, clearance=2, mass_ratio=10)
use(None, damping_ratio=3, frequency_ratio=1)
second = versions()
threads = [threading.Thread(target=lambda: results.append(use(None))) for _ in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(json.dumps([first, second, len(set(results)), len(results)]))
"""


@needs_numba
def test_nothing_is_compiled_twice() -> None:
    """Whatever numbers parameters and times are given as, and from however many threads."""
    first, second, different, threads = in_new_process(TWICE, DAMPER_COMPILE="1")
    assert first["run"] == 1
    assert first == second
    assert set(first.values()) == {1}
    assert (different, threads) == (1, 5)


#: Models that differ in one inner type, or in the length of an inner tuple.
STRUCTURES = """
from typing import Any, NamedTuple
import numpy as np
from damper.engine.compiled import compile_at_once, compiled, plain
from damper.engine.dispatch import by_class

class Near(NamedTuple):
    value: float
    more: Any = (0.5,)
    forcing: float = 0.0

class Far(NamedTuple):
    value: float
    more: Any = (0.5,)
    forcing: float = 0.0

class Model(NamedTuple):
    law: Any
    free: Any
    size: float = 1.0

@by_class
def value_of(part):
    raise AssertionError

@value_of.of(Near)
def near(part):
    return part.value + 10.0 * len(part.more) + 1.0 / part.more[-1]

@value_of.of(Far)
def far(part):
    return -1000.0 * part.value

@compiled
def value(model):
    return 3.0 * value_of(model.law) + value_of(model.free) + model.size

compile_at_once()
inner = [(0.5,), (0.5, 0.5), (3,), (0.5, 3), np.array([0.5]), np.array([3, 4]),
         np.array([0.5, 2.5, 0.5])[::2]]
parts = [Far(1.0), Near(1), *[Near(1.5, more) for more in inner]]
models = [Model(Near(1.0), part) for part in parts] + [Model(part, Near(1.0)) for part in parts]
models += [Model(Near(1.0), Near(1.0), 2), Model(Near(1.0), Near(1.0), 2.5)]
for model in [*models, *models[::-1]]:
    assert value(model) == plain(value)(model), model
"""


@needs_numba
def test_machine_code_serves_only_tuples_of_the_same_types(tmp_path: Path) -> None:
    """Compiled for one, code would read the parts of another as if they were its own."""
    (tmp_path / "structures.py").write_text(STRUCTURES)
    code = f"import sys\nsys.path.insert(0, {str(tmp_path)!r})\nimport structures"
    run(code, NUMBA_CACHE_DIR=str(tmp_path), DAMPER_COMPILE="1")


GIVEN_BACK = """
import gc, json
from numba.core import types
from damper.engine.compiled import Compiled, compile_at_once
from damper.parameters.models import MODELS
from damper.sweep.runs import run_points
compile_at_once()
point = dict(mass_ratio=0.1, damping_ratio=0.05, frequency_ratio=0.2, clearance=0.25,
             restitution=0.6)
observers = {"impacts": {"bodies": [0]} if MODEL == "several" else {}, "response": {}}
run_points([point | MODELS[MODEL].example], observers, transient=1, periods=2)

def things(kind):
    if isinstance(kind, types.BaseNamedTuple):
        return True
    return isinstance(kind, types.BaseTuple) and any(map(things, kind))

entries = [c._outer for c in gc.get_objects() if type(c) is Compiled and c._outer]
given_back = [(e.py_func.__name__, s) for e in entries for s in e.nopython_signatures]
print(json.dumps([len(given_back), [name for name, s in given_back if things(s.return_type)]]))
"""


@needs_numba
@pytest.mark.parametrize("model", ["rigid", *OTHERS])
def test_compiled_code_gives_no_named_tuple_back(model: str) -> None:
    """An interrupt while numba makes one ends the process; see `damper.engine.compiled.plain`."""
    code = f"MODEL = {model!r}\n{GIVEN_BACK}"
    number, wrong = in_new_process(code, DAMPER_COMPILE="1")
    assert number >= 4
    assert not wrong


# --- the cache

#: An entry whose result comes from a function of another module.
SMALL = """
from damper.engine.compiled import COMPILED, cache_folder, compile_at_once
from damper.engine.accumulation import accumulation
from damper.engine.impact import ConstantRestitution
assert COMPILED
compile_at_once()
print(cache_folder().name)
print(accumulation(ConstantRestitution(0.5), 0.0, 0.0, 0.1, 1.0, 0.0, 0.25)[0])
"""


@pytest.fixture(scope="module")
def cached(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A cache that one process has made, and what it printed."""
    folder = tmp_path_factory.mktemp("cache")
    return folder, run(SMALL, NUMBA_CACHE_DIR=str(folder), DAMPER_COMPILE="1")


@needs_numba
def test_the_cache_serves_a_second_process(cached: tuple[Path, str]) -> None:
    folder, first = cached

    def written() -> dict:
        return {path: path.stat().st_mtime_ns for path in folder.rglob("*.nbc")}

    before = written()
    assert before
    assert run(SMALL, NUMBA_CACHE_DIR=str(folder), DAMPER_COMPILE="1") == first
    assert written() == before


@needs_numba
def test_an_edit_in_a_called_module_changes_compiled_results(tmp_path: Path) -> None:
    """numba alone would keep the old coefficient inside its cached caller."""
    shutil.copytree(SOURCE, tmp_path / "damper", ignore=shutil.ignore_patterns("__pycache__"))
    settings = {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "DAMPER_COMPILE": "1"}
    before = run(SMALL, tmp_path, **settings).split()
    assert list((tmp_path / "cache").rglob("*.nbc"))
    called = tmp_path / "damper/engine/impact.py"
    text = called.read_text()
    law = "def _constant(law, approach_speed):\n    return law.restitution"
    assert text.count(law) == 1
    called.write_text(text.replace(law, f"{law} / 2.0"))
    after = run(SMALL, tmp_path, **settings).split()
    assert after[0] != before[0]
    # 2 w / (a (1 - r))
    assert (float(before[1]), float(after[1])) == (1.0, pytest.approx(2.0 / 3.0))


#: `SMALL`, and then the only warning that it gave.
WARNED = f"""
import warnings
with warnings.catch_warnings(record=True) as given:
    warnings.simplefilter("always")
    exec({SMALL!r})
[warning] = given
print(warning.message)
"""


@needs_numba
def test_an_unwritable_cache_is_no_obstacle(tmp_path: Path, cached: tuple[Path, str]) -> None:
    """A file where the cache folder should be: nothing is kept, and one line says so."""
    (tmp_path / "damper").write_text("in the way")
    *found, warning = run(WARNED, NUMBA_CACHE_DIR=str(tmp_path), DAMPER_COMPILE="1").splitlines()
    assert found == cached[1].splitlines()
    assert f"{tmp_path / 'damper' / found[0]} cannot be written; compiling without it" in warning


#: Folders of the cache from the top, and one where numba puts its files.
CHAIN = (".", "damper", "damper/{}", "damper/{}/engine_0")
needs_owners = pytest.mark.skipif(
    not hasattr(os, "geteuid"), reason="the system does not say who may write to a folder"
)


@needs_owners
@pytest.mark.parametrize("how", ["0o775", "0o757", "another owner"])
@pytest.mark.parametrize("shared", range(4))
def test_a_cache_that_others_may_write_is_not_used(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, shared: int, how: str
) -> None:
    """They could have any code run as this user."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(compiled, "_warned", False)
    monkeypatch.setattr(compiled, "_is_own_group", lambda _: False)
    folders = [tmp_path / each.format(compiled.cache_folder().name) for each in CHAIN]
    for folder in folders:
        folder.mkdir(exist_ok=True)
        folder.chmod(0o755)
    assert compiled._make_cache_folder() == folders[2]
    stat = Path.stat

    def stat_of_another(path: Path) -> os.stat_result:
        found = stat(path)
        uid = found.st_uid + (path == folders[shared])
        return os.stat_result((*found[:4], uid, *found[5:]))

    if how == "another owner":
        monkeypatch.setattr(Path, "stat", stat_of_another)
    else:
        folders[shared].chmod(int(how, 8))
    with pytest.warns(RuntimeWarning, match=f"{folders[shared]} .*; compiling without it"):
        assert compiled._make_cache_folder() is None
    # A umask of 002 goes with a group for each user.
    monkeypatch.setattr(compiled, "_is_own_group", lambda _: True)
    if how == "0o775":
        assert compiled._make_cache_folder() == folders[2]


@needs_owners
def test_nobody_else_gets_into_a_new_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "new"))
    before = os.umask(0)
    try:
        folder = compiled._make_cache_folder()
    finally:
        os.umask(before)
    assert folder is not None
    for each in (folder, folder.parent, folder.parents[1]):
        assert each.stat().st_mode & 0o777 == 0o700
    # What numba makes there follows the umask.
    (folder / "engine_0").mkdir()
    (folder / "engine_0").chmod(0o777)
    assert compiled._make_cache_folder() == folder


@needs_numba
@pytest.mark.parametrize("kind", ["nbi", pytest.param("nbc", marks=pytest.mark.exhaustive)])
def test_a_damaged_cache_is_made_anew(tmp_path: Path, cached: tuple[Path, str], kind: str) -> None:
    """The process that finds a file cut short says so in one line, and the next one makes it."""
    folder, first = shutil.copytree(cached[0], tmp_path / "cache"), cached[1]
    settings = {"NUMBA_CACHE_DIR": str(folder), "DAMPER_COMPILE": "1"}
    (file,) = folder.rglob(f"*.{kind}")
    whole = file.stat().st_size
    file.write_bytes(file.read_bytes()[:20])
    *found, warning = run(WARNED, **settings).splitlines()
    assert found == first.splitlines()
    assert f"a file in {file.parent} cannot be used" in warning
    assert run(SMALL, **settings) == first
    assert file.stat().st_size == whole


def test_source_digest_sees_every_edit_but_no_line_ends(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    package = tmp_path / "damper"
    for name in ("engine/compiled.py", "engine/oscillator.py", "__init__.py"):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(SOURCE / name, package / name)
    monkeypatch.setattr(compiled, "__file__", str(package / "engine/compiled.py"))
    original = compiled.source_digest()
    for path in package.rglob("*.py"):
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert compiled.source_digest() == original
    flow = package / "engine/oscillator.py"
    flow.write_bytes(flow.read_bytes() + b"# a comment\n")
    edited = compiled.source_digest()
    assert edited != original
    (package / "new.py").write_text("")
    assert compiled.source_digest() not in (original, edited)


@pytest.mark.parametrize(
    ("unit", "ages", "kept"),
    [
        (3600, (1, 5, 9, 13, 17, 23, 25, 1000), (1, 5, 9, 13, 17, 23)),
        (86400, (2, 3, 4, 5, 6, 7, 8), (2, 3, 4, 5)),
    ],
    ids=["used within a day", "the newest four"],
)
def test_caches_of_other_versions(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, unit: int, ages: tuple, kept: tuple
) -> None:
    """The newest four stay, and those that were used within a day."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    root = compiled.cache_folder().parent
    now = time.time()
    for age in ages:
        (root / f"{age}").mkdir(parents=True)
        os.utime(root / f"{age}", (now - unit * age,) * 2)
    assert compiled._make_cache_folder() == compiled.cache_folder()
    expected = {f"{age}" for age in kept} | {compiled.cache_folder().name}
    assert {path.name for path in root.iterdir()} == expected
    # A process that starts with it makes it young again.
    os.utime(compiled.cache_folder(), (0, 0))
    compiled._make_cache_folder()
    assert compiled.cache_folder().stat().st_mtime > now - 60.0


# --- imports

HEAVY = {"numpy", "numba", "xarray", "scipy", "matplotlib", "netCDF4", "pandas", "yaml", "pydantic"}


@pytest.mark.parametrize("switch", ["1", "0"])
@pytest.mark.parametrize(
    ("code", "allowed"),
    [
        ("damper.Parameters(0.1, 0.05, 0.8, 1.0, 0.6); damper.State(0, 0, 0, 0)", set()),
        ("damper.events; import damper.engine.trajectory", {"numpy"}),
    ],
)
def test_imports_stay_light(code: str, allowed: set[str], switch: str) -> None:
    loaded = modules_after(f"import damper; {code}", "-W", "error", DAMPER_COMPILE=switch)
    assert HEAVY & loaded == allowed


def test_unknown_names_are_refused() -> None:
    with pytest.raises(AttributeError, match="module 'damper' has no attribute 'nonsense'"):
        damper.nonsense  # noqa: B018
    assert {"Parameters", "State", "events"} <= set(dir(damper))


@pytest.mark.parametrize("name", ["NUMBA_CACHE_DIR", "XDG_CACHE_HOME"])
def test_an_empty_variable_names_no_folder(monkeypatch, name):
    """It would put the cache into the present folder."""
    for one in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(one, raising=False)
    usual = compiled.cache_folder()
    monkeypatch.setenv(name, "")
    assert compiled.cache_folder() == usual
    assert usual.is_absolute()


@needs_numba
def test_what_the_cache_holds_waits_for_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However often it is asked; and what the cache lacks runs plain first."""
    monkeypatch.setattr(compiled, "_cache", lambda: tmp_path)
    monkeypatch.setattr(compiled, "_spent", 1.0)
    monkeypatch.setattr(compiled, "_at_once", False)
    each = compiled.Compiled(abs_of)
    each._note((float,)).touch()
    assert [each._waits((float,)) for _ in range(3)] == [False] * 3
    assert [each._waits((int,)) for _ in range(3)] == [True] * 3


def abs_of(number: float) -> float:
    return abs(number)
