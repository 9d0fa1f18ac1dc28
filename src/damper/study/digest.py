"""Digest of the code behind a result: Snakemake does not notice an edit in an imported package.

The digest of a script covers the script and every damper module that it imports, directly or
not. Rules list it among their `params`, so an edit reruns just what depends on it.
"""

import ast
import hashlib
from collections.abc import Iterable
from functools import cache
from itertools import accumulate
from pathlib import Path

from damper import HOME

_PACKAGE = Path(__file__).parent.parent


def code_digest(script: Path, modules: Iterable[str] = ()) -> str:
    """Digest of a script and the damper modules behind it.

    Parameters
    ----------
    script : Path
        A Python file.
    modules : iterable of str
        Modules that it loads by name, such as the observers that a study asks for.

    Returns
    -------
    str
        Hexadecimal digits; the same on every platform (newlines are normalised).

    Raises
    ------
    ValueError
        When one of `modules` is not a module of damper.
    """
    digest = hashlib.sha256()
    files = files_behind(script, modules)
    for path in sorted(files, key=lambda path: (path.name, _source(path))):
        digest.update(path.name.encode() + b"\0" + _source(path) + b"\0")
    return digest.hexdigest()[:16]


def files_behind(script: Path, modules: Iterable[str] = ()) -> set[Path]:
    """Return the files that `code_digest` covers: the script and all that it imports of damper."""
    files = {Path(script)}
    waiting = [Path(script)]
    for name in modules:
        path = _file(name)
        if path is None:
            raise ValueError(f"{name!r} is not a module of damper")
        waiting.append(path)
    while waiting:
        path = waiting.pop()
        files.add(path)
        waiting += [found for found in _imports(path) if found not in files]
    return files


@cache
def _imports(path: Path) -> frozenset[Path]:
    found = set()
    for node in ast.walk(ast.parse(_source(path))):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            # `from damper.sweep import cube` names a module, `from damper.sweep.cube import gather`
            # does not.
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            if node.module == "damper":
                names += [HOME[alias.name] for alias in node.names if alias.name in HOME]
        # The fronts of all packages around a module run before it.
        around = {part for name in names for part in accumulate(name.split("."), "{}.{}".format)}
        found |= {file for name in around if (file := _file(name))}
    return frozenset(found)


def _file(module: str) -> Path | None:
    """Return the source file of a damper module; None for anything else.

    The package's own front is left out: it holds nothing but names that load on first use. So is
    the study language, which figures and tables import for their settings: what it makes of a
    study stands among the `params` of rules, which are compared as they are.
    """
    first, *rest = module.split(".")
    if first != "damper" or not rest or rest[0] == "study":
        return None
    path = _PACKAGE.joinpath(*rest)
    for candidate in (path.with_suffix(".py"), path / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


@cache
def _source(path: Path) -> bytes:
    return path.read_bytes().replace(b"\r\n", b"\n")
