"""Digests change with the code behind a result, and with nothing else."""

import ast
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest
from cases import thinned

import damper
from damper.study import digest as module
from damper.study.digest import code_digest, files_behind

PACKAGE = Path(damper.__file__).parent
SCRIPTS = Path(__file__).parents[2] / "workflow" / "scripts"
OBSERVERS = ("stroboscopic_section", "impact_section", "impacts", "bursts")


def behind(script: Path, modules: Iterable[str] = ()) -> set[str]:
    """Files of the package behind a script, relative to it."""
    return {
        path.relative_to(PACKAGE).as_posix()
        for path in files_behind(script, modules)
        if path != script
    }


def test_every_byte_of_a_file_behind_counts_and_the_folder_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bytes count, not meaning, but for the ends of lines: simple, and it errs on the safe side."""
    real = code_digest(SCRIPTS / "part.py", ["damper.sweep.slices"])
    assert len(real) == 16
    assert set(real) <= set("0123456789abcdef")

    def edited(number: int, edit: str = "", text: bytes = b"\n", crlf: bool = False) -> str:
        home = tmp_path / str(number)
        shutil.copytree(PACKAGE, home / "damper", ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copytree(SCRIPTS, home / "scripts")
        if edit:
            with (home / edit).open("ab") as file:
                file.write(text)
        if crlf:
            for file in home.rglob("*.py"):
                file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
        monkeypatch.setattr(module, "_PACKAGE", home / "damper")
        return code_digest(home / "scripts/part.py", ["damper.sweep.slices"])

    assert edited(1) == real
    assert edited(2, crlf=True) == real
    assert edited(3, "damper/figures/map.py") == real
    edits = ("damper/engine/oscillator.py", "scripts/part.py")
    assert len({real, *(edited(4 + k, edit) for k, edit in enumerate(edits))}) == 3
    assert edited(6, edits[0], b"\n# edited\n") != edited(7, edits[0])


#: Files that do not concern the job of a part.
BESIDE = {
    *("sweep/cube.py", "tables/__init__.py", "tables/intervals.py", "study/config.py"),
    *("study/digest.py", "figures/bifurcation.py", "figures/common/style.py", "sweep/events.py"),
    *("study/simulation.py", *(f"observers/{name}.py" for name in OBSERVERS)),
}
#: Modules that a script loads by name.
NAMED = {"table.py": ("damper.tables.intervals",), "part.py": ("damper.sweep.slices",)}


def test_what_a_script_does_not_import_is_not_behind_it() -> None:
    assert not BESIDE & behind(SCRIPTS / "part.py", NAMED["part.py"])
    assert all((PACKAGE / path).is_file() for path in BESIDE)


@pytest.mark.parametrize("kind", ["bifurcation", "convergence"])
def test_figure_kind_counts_if_it_is_named(kind: str) -> None:
    path = f"figures/{kind}.py"
    script = SCRIPTS / "figure.py"
    assert {path, "figures/common/layout.py"} <= behind(script, [f"damper.figures.{kind}"])
    assert path not in behind(script)


@pytest.mark.parametrize("asked", OBSERVERS)
def test_observer_counts_only_if_it_is_asked_for(asked: str) -> None:
    found = behind(SCRIPTS / "part.py", ["damper.sweep.slices", f"damper.observers.{asked}"])
    assert {f"observers/{name}.py" for name in OBSERVERS} & found == {f"observers/{asked}.py"}


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("import damper.engine.oscillator", "engine/oscillator.py"),
        ("import os, damper.engine.oscillator", "engine/oscillator.py"),
        ("from damper.engine.oscillator import increments", "engine/oscillator.py"),
        ("def f():\n    from damper.models.walls import fly", "engine/oscillator.py"),
        ("from damper.sweep import slices", "engine/oscillator.py"),
        ("if True:\n    import damper.sweep.runs", "engine/oscillator.py"),
        # What the package loads on first use.
        ("from damper import events", "sweep/events.py"),
    ],
)
def test_every_form_of_import_is_followed(tmp_path: Path, line: str, found: str) -> None:
    script = tmp_path / "script.py"
    script.write_text(f"{line}\n")
    assert {found, "engine/oscillator.py"} <= behind(script)
    assert "figures/map.py" not in behind(script)


@pytest.mark.parametrize("line", ["import numpy.linalg", "import damperfoo.engine", "flow = 1"])
def test_names_of_other_packages_are_none_of_ours(tmp_path: Path, line: str) -> None:
    script = tmp_path / "script.py"
    script.write_text(f"{line}\n")
    assert behind(script) == set()


LOADED = """
import importlib, sys
for name in {names}:
    importlib.import_module(name)
for name, module in sorted(sys.modules.items()):
    if name.startswith("damper.") and module.__file__:
        print(module.__file__)
"""


def loaded(names: Iterable[str]) -> list[str]:
    """Files of the package, relative to it, that these modules load."""
    done = subprocess.run(
        [sys.executable, "-c", LOADED.format(names=list(names))],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "DAMPER_COMPILE": "0"},
    )
    return [Path(line).relative_to(PACKAGE).as_posix() for line in done.stdout.splitlines()]


@pytest.mark.parametrize(
    "script",
    thinned(
        sorted(path.name for path in SCRIPTS.glob("*.py")), {"part.py", "table.py"}.__contains__
    ),
)
def test_every_module_that_a_script_loads_is_behind_its_digest(script: str) -> None:
    """What Python really imports."""
    tree = ast.parse((SCRIPTS / script).read_text())
    names = [
        node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("damper")
    ]
    assert names
    modules = NAMED.get(script, ())
    paths = set(loaded((*names, *modules)))
    assert paths
    # What the study language makes of a study stands among the settings of its jobs.
    if "study/kinds.py" in paths:
        paths -= set(loaded(["damper.study.kinds"]))
    paths = {path for path in paths if not path.startswith("study/")}
    # A package's front that holds nothing but a docstring changes nothing.
    paths = {path for path in paths if len(ast.parse((PACKAGE / path).read_text()).body) > 1}
    assert paths <= behind(SCRIPTS / script, modules)
