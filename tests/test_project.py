"""The project itself: format, lint, types, and documents that say what is true."""

import ast
import inspect
import json
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import tomllib
from graphlib import TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from damper.study.config import load_config, load_study
from damper.study.estimate import estimate
from damper.study.model import Study

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src/damper"
MODULES = sorted(
    ".".join(path.relative_to(ROOT / "src").with_suffix("").parts).removesuffix(".__init__")
    for path in SOURCE.rglob("*.py")
)


def run(*command: str) -> None:
    program = Path(sys.executable).with_name(command[0])
    found = str(program) if program.exists() else shutil.which(command[0])
    assert found, f"{command[0]} is not installed"
    done = subprocess.run(
        [found, *command[1:]], cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    "command",
    [
        ("ruff", "check"),
        ("ruff", "format", "--check"),
        ("snakefmt", "--check", "Snakefile", "workflow"),
        ("mypy", "--cache-dir=/dev/null"),
    ],
    ids=" ".join,
)
def test_format_lint_and_types(command):
    run(*command)


def test_public_functions_have_docstrings_and_types():
    empty = inspect.Parameter.empty
    for module in MODULES:
        loaded = import_module(module)
        assert loaded.__doc__, module
        for name, value in vars(loaded).items():
            if name.startswith("_") or getattr(value, "__module__", None) != module:
                continue
            function = getattr(value, "py_func", value)
            if inspect.isfunction(function):
                assert function.__doc__, f"{module}.{name} has no docstring"
                signature = inspect.signature(function)
                types = [p.annotation for p in signature.parameters.values()]
                assert empty not in [signature.return_annotation, *types], f"{module}.{name}"
            elif inspect.isclass(value):
                assert value.__doc__, f"{module}.{name} has no docstring"


def _rooms() -> list[str]:
    """Return the rooms from the ground up, as the table in docs/design.md lists them."""
    text = (ROOT / "docs/design.md").read_text(encoding="utf-8")
    section = text.partition("## Rooms")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| ([a-z, ]+) \|", section, re.MULTILINE)
    return [name for row in rows[1:] for name in row.split(", ")]


ROOMS = _rooms()


def test_rooms_import_only_those_before():
    folders = {path.name for path in SOURCE.iterdir() if path.is_dir()} - {"__pycache__"}
    assert set(ROOMS) == folders
    imports = r"^\s*(?:from|import) damper\.([\w.]+)"
    for place, room in enumerate(ROOMS):
        for path in (SOURCE / room).rglob("*.py"):
            for name in re.findall(imports, path.read_text(), re.MULTILINE):
                before = ROOMS.index(name.split(".")[0]) <= place
                assert before, f"{path.relative_to(SOURCE)} imports {name}"


def _imported(module: str) -> set[str]:
    """Return the modules of the project that a module imports while it runs, in functions too.

    Imports for types do not count. A package may load its own modules.
    """
    path = SOURCE.parent.joinpath(*module.split("."))
    text = (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text("utf-8")
    nodes = [*ast.walk(ast.parse(text))]
    guards = [n for n in nodes if isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING"]
    for_types = {inner for guard in guards for node in guard.body for inner in ast.walk(node)}
    found = {
        full if (full := f"{node.module}.{alias.name}") in MODULES else str(node.module)
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node not in for_types
        for alias in node.names
    }
    return {name for name in found & {*MODULES} - {"damper"} if not name.startswith(module)}


def test_modules_of_the_study_language_import_in_one_direction():
    """Imports for types count as well."""
    language = {
        path.stem: re.findall(r"from damper\.study\.(\w+) import", path.read_text())
        for path in (SOURCE / "study").glob("*.py")
    }
    TopologicalSorter(language).prepare()


def test_no_two_modules_import_each_other():
    TopologicalSorter({module: _imported(module) for module in MODULES}).prepare()


def test_a_class_has_a_name_of_its_own():
    found = [
        name
        for path in SOURCE.rglob("*.py")
        for name in re.findall(r"^class ([A-Za-z]\w*)", path.read_text(), re.MULTILINE)
    ]
    assert sorted(found) == sorted(set(found))


def test_models_do_not_know_each_other():
    """They share the damper with one free mass at rigid walls, and the files beside the folders.

    Masses on a structure meet their walls at once as several masses on one primary do.
    """
    folders = {path.name for path in (SOURCE / "models").iterdir() if path.is_dir()}
    for name in folders - {"masses", "__pycache__"}:
        shared = {"masses", "several"} if name == "structure" else {"masses"}
        for path in (SOURCE / "models" / name).rglob("*.py"):
            others = folders - {"__pycache__", name} - shared
            found = re.findall(r"damper\.models\.(\w+)", path.read_text())
            assert not others.intersection(found), path


def test_heavy_packages_stay_in_their_rooms():
    draws = {"figures", "papers", "verification", "structures", "notebook", "sizing"}
    reads = {*draws, "analysis", "tables", "study", "notebook"}
    # What hands over results: cubes, branches, and motions of runs that are advanced by steps.
    made = (
        *(("sweep", "cube"), ("sweep", "structures")),
        *(("sweep", "orbits", "branch"), ("sweep", "started")),
    )
    for path in SOURCE.rglob("*.py"):
        text = path.read_text()
        parts = path.relative_to(SOURCE).with_suffix("").parts
        if parts == ("parameters", "lazy"):
            continue
        assert parts[0] in draws or "import matplotlib" not in text, path
        assert (
            parts[0] in reads
            or parts in made
            or not re.search(r"import xarray|lazy import .*\bxr\b", text)
        ), path


def test_readme_commands_and_ci_agree():
    readme = (ROOT / "README.md").read_text()
    commands = re.findall(r"^python3 -m venv .*$", readme, re.MULTILINE)
    assert len(commands) == 2
    assert commands[0].endswith("snakemake --cores 2")
    assert commands[1].endswith("pytest")
    assert "grep -m 1 'pip install.*pytest$' README.md" in (ROOT / ".ci/run").read_text()


def test_the_lock_pins_what_the_project_asks_for():
    text = (ROOT / "requirements.lock").read_text()
    pins = [Requirement(line) for line in re.findall(r"^(\S+==.*?) \\$", text, re.MULTILINE)]
    assert len(pins) == len(re.findall(r"^\S+==", text, re.MULTILINE))
    assert text.count("--hash=sha256:") >= len(pins)
    assert "://" not in text
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = [of for name, of in project["optional-dependencies"].items() if name != "docs"]
    asked = sum(extras, project["dependencies"])
    for each in map(Requirement, asked):
        name = canonicalize_name(each.name)
        found = [pin for pin in pins if pin.name == name]
        assert found, f"{name} is not in requirements.lock"
        for pin in found:
            (version,) = (exact.version for exact in pin.specifier)
            assert each.specifier.contains(version), f"{each}, but the lock has {pin}"


@pytest.mark.exhaustive
def test_the_tutorial_runs():
    cells = json.loads((ROOT / "docs/tutorial.ipynb").read_text())["cells"]
    code = "".join("".join(cell["source"]) + "\n" for cell in cells if cell["cell_type"] == "code")
    found: dict = {}
    exec(code.replace("%matplotlib inline", ""), found)
    assert found["orbit"].stable
    assert found["worst"].min() < 0.3 * 200 / (800 * 200)


def test_cells_of_the_site_take_the_time_they_need():
    """The first one compiles: minutes on a slow machine."""
    pytest.importorskip("latex2mathml")
    assert runpy.run_path(str(ROOT / "docs/conf.py"))["nb_execution_timeout"] < 0


@pytest.mark.exhaustive
def test_the_steps_of_the_dockerfile_work(tmp_path):
    """Without docker: what is copied and run there is copied to, and run in, an empty folder."""
    lines = (ROOT / "Dockerfile").read_text().splitlines()
    environment = os.environ | {"PATH": f"{tmp_path}/.venv/bin:{os.environ['PATH']}"}
    environment.pop("PYTHONPATH", None)
    for word, rest in (line.split(maxsplit=1) for line in lines if line):
        if word == "COPY":
            *sources, target = rest.split()
            for source in sources:
                copy = shutil.copytree if (ROOT / source).is_dir() else shutil.copy
                copy(ROOT / source, tmp_path / target)
        elif word in ("RUN", "CMD"):
            command = rest if word == "RUN" else shlex.join([*json.loads(rest), "--dry-run"])
            done = subprocess.run(
                command, shell=True, cwd=tmp_path, env=environment, capture_output=True, text=True
            )
            assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    assert "Job stats" in done.stdout


def test_links_in_documents_lead_somewhere():
    documents = [ROOT / "README.md", ROOT / "config/README.md", *(ROOT / "docs").glob("*.md")]
    for document in documents:
        for target in re.findall(r"\]\(([^)#:]+)\)", document.read_text()):
            assert (document.parent / target).exists(), f"{document.name}: {target}"


@pytest.mark.exhaustive
def test_test_commands_in_documents_select_tests():
    for document in sorted((ROOT / "docs").glob("*.md")):
        for command in set(re.findall(r"`pytest ([^`]+)`", document.read_text())):
            run = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-n", "0"]
            done = subprocess.run([*run, *shlex.split(command)], cwd=ROOT, capture_output=True)
            assert done.returncode == 0, f"{document.name}: {command}"


def test_readme_python_examples_run(tmp_path):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    example = next(block for block in blocks if "damper.events" in block)
    script = tmp_path / "example.py"
    script.write_text(example + "\nassert round(float(stick['time']), 4) == 44.2497\n")
    done = subprocess.run([sys.executable, script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_example_study_in_the_documents_is_a_study(tmp_path):
    (block,) = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs/studies.md").read_text(), re.DOTALL)
    path = tmp_path / "example.yaml"
    path.write_text(block)
    assert load_study(path).fan_axes == ("frequency_ratio",)


def test_the_folder_of_catalogues_asks_for_one_small_study():
    config = load_config({}, ROOT, [ROOT / ".test/config/config.yaml"])
    (name,) = config.default
    assert estimate(config.studies[name]).seconds < 60.0


@pytest.mark.parametrize(
    "path", sorted((ROOT / "config/studies").glob("*.yaml")), ids=lambda p: p.stem
)
def test_every_study_that_comes_with_the_project_loads(path):
    study = load_study(path)
    if not isinstance(study, Study):
        assert study.files("figures")
        assert study.files("tables")
    else:
        assert 1 <= len(study.slices()) <= 100
