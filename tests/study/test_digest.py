"""Digests change with the code behind a result, and with nothing else."""

import ast
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

import damper
from damper.study import digest as module
from damper.study.digest import code_digest

PACKAGE = Path(damper.__file__).parent
SCRIPTS = Path(__file__).parents[2] / "workflow" / "scripts"
OBSERVERS = ("stroboscopic_section", "impact_section", "impacts", "bursts")


class Copy:
    """A copy of the package and the scripts that may be edited."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder, self.monkeypatch = folder, monkeypatch
        self.number = 0

    def digest(
        self,
        script: str,
        modules: Iterable[str] = (),
        *,
        edit: str | None = None,
        crlf: bool = False,
        text: bytes = b"\n# edited\n",
        content: str | None = None,
    ) -> str:
        """Digest of a fresh copy with one file edited (a path in the package, or the script).

        `content` takes the place of the script's own.
        """
        self.number += 1
        home = self.folder / str(self.number)
        shutil.copytree(PACKAGE, home / "damper", ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copytree(SCRIPTS, home / "scripts", ignore=shutil.ignore_patterns("__pycache__"))
        path = home / "scripts" / script
        if content is not None:
            path.write_text(content)
        if edit:
            edited = path if edit == script else home / "damper" / edit
            assert edited.is_file(), edit
            edited.write_bytes(edited.read_bytes() + text)
        if crlf:
            for file in home.rglob("*.py"):
                file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
        self.monkeypatch.setattr(module, "_PACKAGE", home / "damper")
        return code_digest(path, modules)


@pytest.fixture
def copy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Copy:
    return Copy(tmp_path, monkeypatch)


def test_digest_does_not_depend_on_the_folder(copy: Copy) -> None:
    real = code_digest(SCRIPTS / "simulate.py")
    assert copy.digest("simulate.py") == copy.digest("simulate.py") == real
    assert len(real) == 16
    assert set(real) <= set("0123456789abcdef")


#: Direct and indirect imports of each script, and files that do not concern it.
CONCERNS = {
    "simulate.py": (
        [
            "sweep/slices.py",
            "sweep/runs.py",
            "engine/trajectory.py",
            "engine/search.py",
            "engine/oscillator.py",
            "parameters/dampers.py",
            "engine/compiled.py",
            "parameters/variables.py",
            "observers/common/base.py",
            "observers/__init__.py",
        ],
        [
            "sweep/cube.py",
            "tables/__init__.py",
            "tables/intervals.py",
            "study/config.py",
            "study/digest.py",
            "figures/bifurcation.py",
            "figures/common/style.py",
            "sweep/events.py",
            "sweep/simulation.py",
            *(f"observers/{name}.py" for name in OBSERVERS),
        ],
    ),
    "gather.py": (
        ["sweep/cube.py", "sweep/slices.py", "parameters/variables.py", "parameters/dampers.py"],
        ["tables/__init__.py", "study/config.py", "figures/bifurcation.py", "sweep/simulation.py"],
    ),
    "figure.py": (
        ["figures/__init__.py", "figures/common/style.py", "parameters/quantities.py"],
        [
            "engine/trajectory.py",
            "engine/oscillator.py",
            "engine/search.py",
            "sweep/runs.py",
            "sweep/cube.py",
            "tables/__init__.py",
        ],
    ),
    "table.py": (
        [
            "tables/__init__.py",
            "tables/intervals.py",
            "analysis/intervals.py",
            "sweep/runs.py",
            "engine/trajectory.py",
            "engine/search.py",
            "engine/oscillator.py",
        ],
        [
            "tables/performance.py",
            "sweep/cube.py",
            "study/config.py",
            "figures/bifurcation.py",
            "sweep/simulation.py",
        ],
    ),
    "compile.py": (
        ["engine/compiled.py", "sweep/slices.py", "engine/trajectory.py", "engine/oscillator.py"],
        ["sweep/cube.py", "tables/__init__.py", "figures/common/style.py"],
    ),
}


#: Modules that a script loads by name.
NAMED = {"table.py": ("damper.tables.intervals",)}


@pytest.mark.parametrize("script", CONCERNS)
def test_edit_behind_a_script_changes_its_digest_and_no_other(copy: Copy, script: str) -> None:
    modules = NAMED.get(script, ())
    before = copy.digest(script, modules)
    digests = {before}
    behind, beside = CONCERNS[script]
    for path in (script, *behind):
        digests.add(copy.digest(script, modules, edit=path))
    assert len(digests) == len(behind) + 2, "an edit was not noticed"
    for path in beside:
        assert copy.digest(script, modules, edit=path) == before, path


@pytest.mark.parametrize("kind", ["bifurcation", "map", "curves", "trajectory", "convergence"])
def test_figure_kind_counts_if_it_is_named(copy: Copy, kind: str) -> None:
    named = (f"damper.figures.{kind}",)
    edit = f"figures/{kind}.py"
    assert copy.digest("figure.py", named, edit="figures/common/layout.py") != copy.digest(
        "figure.py", named
    )
    assert copy.digest("figure.py", named, edit=edit) != copy.digest("figure.py", named)
    assert copy.digest("figure.py", edit=edit) == copy.digest("figure.py")


@pytest.mark.parametrize("asked", OBSERVERS)
def test_observer_counts_only_if_it_is_asked_for(copy: Copy, asked: str) -> None:
    modules = (f"damper.observers.{asked}",)
    before = copy.digest("simulate.py", modules)
    assert before != copy.digest("simulate.py")
    noticed = {
        name
        for name in OBSERVERS
        if copy.digest("simulate.py", modules, edit=f"observers/{name}.py") != before
    }
    assert noticed == {asked}


def test_order_and_repetition_of_modules_do_not_matter(copy: Copy) -> None:
    a, b = "damper.observers.impacts", "damper.observers.bursts"
    orders = ((a, b), (b, a), (b, a, b, a), iter([a, b]))
    assert len({copy.digest("simulate.py", modules) for modules in orders}) == 1


def test_misspelt_module_is_refused() -> None:
    with pytest.raises(ValueError, match=r"damper\.observers\.burst"):
        code_digest(SCRIPTS / "simulate.py", ["damper.observers.burst"])


def test_newlines_are_normalised(copy: Copy) -> None:
    modules = tuple(f"damper.observers.{name}" for name in OBSERVERS)
    for script in CONCERNS:
        assert copy.digest(script, modules, crlf=True) == copy.digest(script, modules)


def test_comment_and_blank_line_count(copy: Copy) -> None:
    """Bytes count, not meaning: simple, and it errs on the safe side."""
    before = copy.digest("simulate.py")
    assert copy.digest("simulate.py", edit="engine/oscillator.py", text=b"\n") != before
    assert copy.digest("simulate.py", edit="simulate.py", text=b"\n") != before


@pytest.mark.parametrize(
    "line",
    [
        "import damper.engine.oscillator",
        "import damper.engine.oscillator as f",
        "import os, damper.engine.oscillator",
        "from damper.engine.oscillator import increments",
        "from damper.engine.bounds import energy_norm",
        "def f():\n    from damper.models.walls import fly",
        "from damper.sweep import slices",
        "if True:\n    import damper.sweep.runs",
    ],
)
def test_every_form_of_import_is_followed(copy: Copy, line: str) -> None:
    before = copy.digest("simulate.py", content=f"{line}\n")
    assert copy.digest("simulate.py", content=f"{line}\n", edit="engine/oscillator.py") != before
    assert copy.digest("simulate.py", content=f"{line}\n", edit="sweep/simulation.py") == before


@pytest.mark.parametrize(
    ("name", "path"), [("events", "sweep/events.py"), ("simulate", "sweep/simulation.py")]
)
def test_names_that_the_package_loads_on_first_use_are_followed(
    copy: Copy, name: str, path: str
) -> None:
    line = f"from damper import {name}\n"
    before = copy.digest("simulate.py", content=line)
    assert copy.digest("simulate.py", content=line, edit=path) != before
    assert copy.digest("simulate.py", content=line, edit="engine/oscillator.py") != before


def test_names_of_other_packages_are_none_of_ours(copy: Copy) -> None:
    lines = ("import numpy.linalg\n", "from damperfoo.engine import x\n", "flow = 1\n")
    digests = [copy.digest("simulate.py", content=line) for line in lines]
    assert len(set(digests)) == 3
    for line, before in zip(lines, digests, strict=True):
        assert copy.digest("simulate.py", content=line, edit="engine/oscillator.py") == before


def test_same_in_every_process() -> None:
    code = (
        "from pathlib import Path; from damper.study.digest import code_digest; "
        f"print(code_digest(Path({str(SCRIPTS / 'table.py')!r}), ['damper.observers.bursts']))"
    )
    here = code_digest(SCRIPTS / "table.py", ["damper.observers.bursts"])
    for seed in ("0", "1"):
        done = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
        )
        assert done.stdout.strip() == here


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


@pytest.mark.parametrize("script", sorted(path.name for path in SCRIPTS.glob("*.py")))
def test_every_module_that_a_script_loads_is_behind_its_digest(copy: Copy, script: str) -> None:
    """What Python really imports, against edits of each of those files."""
    tree = ast.parse((SCRIPTS / script).read_text())
    names = [
        node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("damper")
    ]
    assert names
    modules = NAMED.get(script, ())
    names += modules
    paths = loaded(names)
    if any(path.startswith("study/") for path in paths):
        # What the study language makes of a study stands among the params.
        paths = sorted({*paths} - {*loaded(["damper.study.kinds"])})
    # A package's front that holds nothing but a docstring changes nothing.
    paths = [path for path in paths if len(ast.parse((PACKAGE / path).read_text()).body) > 1]
    assert paths
    before = copy.digest(script, modules)
    unnoticed = [path for path in paths if copy.digest(script, modules, edit=path) == before]
    assert unnoticed == []
