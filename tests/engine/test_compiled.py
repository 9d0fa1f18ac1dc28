"""Compiled and plain are one source; a stale cache never answers; importing stays light."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

import damper
from damper.engine import compiled

SOURCE = Path(damper.__file__).parent
needs_numba = pytest.mark.skipif(
    importlib.util.find_spec("numba") is None, reason="numba is not installed"
)

RUNS = """
import sys
import damper
from damper.engine.compiled import COMPILED
print(COMPILED, file=sys.stderr)
P, S = damper.Parameters, damper.State
runs = [
    (P(0.1, 0.05, 0.2, 0.25, 0.6), None, 120.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.3), None, 120.0),
    (P(0.1, 0.05, 0.2, 0.25, 0.0), None, 120.0),
    (P(0.1, 0.0, 1.0, 2.0, 0.9, 0.5), S(0.1, 0.2, 0.3, -0.4), 60.0),
    (P(2.0, 3.0, 0.5, 0.2, 1.0), S(0.1, 0.0, 0.0, 1.0), 60.0),
    (P(1e-9, 1.0, 10.0, 0.005, 0.7), None, 20.0),
    (P(1e6, 2000.0, 0.7, 0.05, 0.8), S(0.0, 0.0, 0.0, 1.0), 5.0),
    (P(0.3, 0.1, 1e3, 1e-3, 0.7), S(1.0, 0.0, 1.0, 0.0), 2.0),
    (P(0.2, 1e-4, 1.01, 1.0, 0.85), S(0.0, 0.0, 0.0, 0.0, 7.5), 60.0),
]
for parameters, state, until in runs:
    for row in damper.events(parameters, state, until=until, max_events=60):
        values = [float(row[name]).hex() for name in ("time", "approach_speed", "x", "v")]
        print(row["kind"], row["side"], *values)
    print("--")
"""


def run(code: str, folder: Path = SOURCE.parent, **variables: str) -> subprocess.CompletedProcess:
    """Run code in a fresh interpreter that finds damper in `folder`."""
    environment = {**os.environ, "PYTHONPATH": str(folder), **variables}
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
        cwd=folder,
    )


@needs_numba
def test_compiled_and_plain_give_the_same_events() -> None:
    """Bit for bit, chaotic runs included (measured so over 19,000 events of one run)."""
    fast, plain = run(RUNS, DAMPER_COMPILE="1"), run(RUNS, DAMPER_COMPILE="0")
    assert (fast.stderr.strip(), plain.stderr.strip()) == ("True", "False")
    pairs = zip(fast.stdout.split("--\n"), plain.stdout.split("--\n"), strict=True)
    for one, other in pairs:
        assert one.splitlines() == other.splitlines()
    assert len(fast.stdout.splitlines()) > 250


def test_plain_python_warns_and_raises_nowhere() -> None:
    """What compiled code would pass on as nan or inf raises here: no such value comes up."""
    lines = run(RUNS, DAMPER_COMPILE="0").stdout
    assert "nan" not in lines
    assert "inf" not in lines


@needs_numba
def test_an_edit_in_a_called_module_changes_compiled_results(tmp_path: Path) -> None:
    """numba alone would keep the old `impact` inside its cached callers."""
    shutil.copytree(SOURCE, tmp_path / "damper", ignore=shutil.ignore_patterns("__pycache__"))
    code = (
        "import damper; from damper.engine.compiled import COMPILED, cache_folder; assert COMPILED;"
        "p = damper.Parameters(0.1, 0.05, 0.8, 1.0, 0.6);"
        "print(damper.__file__, cache_folder().name);"
        "print(*(float(t).hex() for t in damper.events(p, until=30.0)['time']))"
    )
    settings = {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "DAMPER_COMPILE": "1"}
    before = run(code, tmp_path, **settings).stdout.splitlines()
    assert before[0].startswith(str(tmp_path))
    files = sorted(path for path in (tmp_path / "cache").rglob("*.nbc"))
    assert files

    search = tmp_path / "damper" / "engine" / "search.py"
    text = search.read_text()
    law = "return v, restitution * approach_speed"
    assert text.count(law) == 1
    search.write_text(text.replace(law, "return v, 0.5 * restitution * approach_speed"))
    after = run(code, tmp_path, **settings).stdout.splitlines()
    assert after[0] != before[0]
    first, second = before[1].split(), after[1].split()
    assert first[0] == second[0]
    assert first[1] != second[1]


@needs_numba
def test_the_cache_serves_a_second_process(tmp_path: Path) -> None:
    code = "from damper.engine.oscillator import oscillator; print(oscillator(0.1, 1.0, 1.0, 0.7))"
    settings = {"NUMBA_CACHE_DIR": str(tmp_path), "DAMPER_COMPILE": "1"}

    def cached() -> dict:
        return {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")}

    first = run(code, **settings).stdout
    written = cached()
    assert written
    assert run(code, **settings).stdout == first
    assert cached() == written


def test_cache_folder_follows_the_setting(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    digest = compiled.source_digest()
    assert re.fullmatch("[0-9a-f]{64}", digest)
    assert compiled.cache_folder() == tmp_path / "damper" / digest[:16]
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    assert compiled.cache_folder().name == digest[:16]


def test_source_digest_sees_every_edit_but_no_line_ends(tmp_path: Path) -> None:
    package = tmp_path / "damper"
    shutil.copytree(SOURCE, package, ignore=shutil.ignore_patterns("__pycache__"))
    code = "from damper.engine.compiled import source_digest; print(source_digest())"

    def digest() -> str:
        return run(code, tmp_path, DAMPER_COMPILE="0").stdout

    original = digest()
    for path in package.rglob("*.py"):
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert digest() == original
    flow = package / "engine" / "oscillator.py"
    flow.write_bytes(flow.read_bytes() + b"# a comment\n")
    edited = digest()
    assert edited != original
    (package / "new.py").write_text("")
    assert digest() not in (original, edited)


@needs_numba
def test_an_unwritable_cache_is_no_obstacle(tmp_path: Path) -> None:
    """A file where the cache folder should be: nothing is kept, everything works."""
    (tmp_path / "damper").write_text("in the way")
    code = (
        "from damper.engine.oscillator import oscillator; print(oscillator(0.1, 1.0, 1.0, 0.7)[0])"
    )
    found = run(code, NUMBA_CACHE_DIR=str(tmp_path), DAMPER_COMPILE="1")
    assert found.stdout.strip() == "0.1"


def test_caches_in_use_are_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Of other versions' caches the newest four stay, and those that were used within a day."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    root = compiled.cache_folder().parent
    now = time.time()
    for hours in (1, 5, 9, 13, 17, 23, 25, 1000):
        (root / f"{hours} hours").mkdir(parents=True)
        os.utime(root / f"{hours} hours", (now - 3600 * hours,) * 2)
    assert compiled._make_cache_folder() == compiled.cache_folder()
    kept = {f"{hours} hours" for hours in (1, 5, 9, 13, 17, 23)}
    assert {path.name for path in root.iterdir()} == kept | {compiled.cache_folder().name}
    # A process that starts with it makes it young again.
    os.utime(compiled.cache_folder(), (0, 0))
    compiled._make_cache_folder()
    assert compiled.cache_folder().stat().st_mtime > now - 60.0


def test_old_caches_are_kept_up_to_four(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    root = compiled.cache_folder().parent
    for days in range(2, 9):
        (root / f"{days} days").mkdir(parents=True)
        os.utime(root / f"{days} days", (time.time() - 86400 * days,) * 2)
    compiled._make_cache_folder()
    kept = {f"{days} days" for days in (2, 3, 4, 5)}
    assert {path.name for path in root.iterdir()} == kept | {compiled.cache_folder().name}


HEAVY = {"numpy", "numba", "xarray", "scipy", "matplotlib", "netCDF4", "pandas", "yaml", "pydantic"}


@pytest.mark.parametrize("switch", ["1", "0"])
@pytest.mark.parametrize(
    ("code", "allowed"),
    [
        ("import damper", set()),
        ("import damper; damper.Parameters(0.1, 0.05, 0.8, 1.0, 0.6)", set()),
        ("import damper; damper.State(0, 0, 0, 0)", set()),
        ("import damper; damper.events", {"numpy"}),
        ("import damper.engine.trajectory", {"numpy"}),
    ],
)
def test_imports_stay_light(code: str, allowed: set[str], switch: str) -> None:
    found = run(f"{code}\nimport sys\nprint(*sys.modules)", DAMPER_COMPILE=switch).stdout.split()
    assert "damper" in found
    if allowed and switch == "1":
        # The engine may load numba, and numba loads what it likes.
        allowed = {*allowed, "numba", "yaml", "scipy"}
    assert HEAVY.intersection(found) <= allowed


def test_unknown_names_are_refused() -> None:
    with pytest.raises(AttributeError, match="module 'damper' has no attribute 'nonsense'"):
        damper.nonsense  # noqa: B018
    assert {"Parameters", "State", "events"} <= set(dir(damper))
