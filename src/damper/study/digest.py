"""Digest of the code behind a result: Snakemake does not notice an edit in an imported package.

The digest of a script covers the script and every damper module that it imports, directly or
not. Rules list it among their `params`, so an edit reruns the dependent jobs only.
"""

import re
from collections.abc import Iterable
from functools import cache
from hashlib import sha256
from itertools import accumulate
from pathlib import Path

from damper import HOME

_PACKAGE = Path(__file__).parent.parent


def code_digest(script: Path, modules: Iterable[str] = ()) -> str:
    """Digest of a script and the damper modules behind it, in hexadecimal digits.

    `modules` are the modules that it loads by name, such as the observers that a study asks for;
    ValueError for one that is not of damper. The same on every platform: newlines are normalised.
    """
    sources = sorted((path.name, _digest(path)) for path in files_behind(script, modules))
    return sha256(repr(sources).encode()).hexdigest()[:16]


def files_behind(script: Path, modules: Iterable[str] = ()) -> set[Path]:
    """Return the files that `code_digest` covers: the script and all that it imports of damper."""
    files = {Path(script)} | _behind(Path(script))
    for name in modules:
        path = _file(name, _PACKAGE)
        if path is None:
            raise ValueError(f"{name!r} is not a module of damper")
        files |= {path} | _behind(path)
    return files


@cache
def _behind(path: Path) -> frozenset[Path]:
    """Return the files that a file imports of damper, directly or not."""
    files: set[Path] = set()
    waiting = [path]
    while waiting:
        found = _imports(waiting.pop()) - files
        files |= found
        waiting += found
    return frozenset(files)


#: ``from a.b import c, d``, with or without parentheses, and ``import a.b, c``. Parsing each file
#: took a third of the time in which the Snakefile loads. A line of a docstring that reads
#: like an import adds a file, an error on the safe side.
_FROM = re.compile(rb"^[ \t]*from[ ]+(damper[\w.]*)[ ]+import[ ]*(\([^)]*\)|[^\n]*)", re.MULTILINE)
_IMPORT = re.compile(rb"^[ \t]*import[ ]+([^\n]*)", re.MULTILINE)
_NAME = re.compile(rb"(?<!as )\b[A-Za-z_][\w.]*")


@cache
def _imports(path: Path) -> frozenset[Path]:
    found, source = set(), _source(path)
    for module, listed in _FROM.findall(source):
        # `from damper.sweep import cube` names a module, `from damper.sweep.cube import gather`
        # does not.
        within = module.decode()
        names = [name.decode() for name in _NAME.findall(listed)]
        modules = [within, *(f"{within}.{name}" for name in names)]
        if within == "damper":
            modules += [HOME[name] for name in names if name in HOME]
        found |= set(modules)
    for listed in _IMPORT.findall(source):
        found |= {name.decode() for name in _NAME.findall(listed)}
    # The fronts of all packages around a module run before it.
    around = {part for name in found for part in accumulate(name.split("."), "{}.{}".format)}
    return frozenset(file for name in around if (file := _file(name, _PACKAGE)))


@cache
def _file(module: str, package: Path) -> Path | None:
    """Return the source file of a damper module; None for anything else.

    The package's own front is left out: it holds nothing but names that load on first use. So is
    the study language, which figures and tables import for their settings: its results stand among
    the settings of the jobs, which are compared as they are.
    """
    first, *rest = module.split(".")
    if first != "damper" or not rest or rest[0] == "study":
        return None
    path = package.joinpath(*rest)
    for candidate in (path.with_suffix(".py"), path / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


@cache
def _source(path: Path) -> bytes:
    return path.read_bytes().replace(b"\r\n", b"\n")


@cache
def _digest(path: Path) -> bytes:
    return sha256(_source(path)).digest()
