"""Results as an RO-Crate: the contents of each file, its study and its origin.

Equal results give equal bytes, so the crate holds no time; its publisher adds
`datePublished`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

#: Suffix -> media type.
FORMATS = {
    ".nc": "application/x-netcdf",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".csv": "text/csv",
    ".md": "text/markdown",
    ".yaml": "application/yaml",
    ".html": "text/html",
    ".js": "text/javascript",
}
_CONFORMS = {"@id": "https://w3id.org/ro/crate/1.1"}


def crate(
    results: Path,
    studies: Sequence[Mapping[str, Any]],
    files: Sequence[str],
    versions: Mapping[str, str],
) -> dict[str, Any]:
    """Describe a folder of results as RO-Crate metadata, version 1.1.

    Parameters
    ----------
    results : Path
        The folder; `files` are there.
    studies : sequence of mapping
        `damper.study.study_file.StudyFile.about` of each.
    files : sequence of str
        Paths below the folder.
    versions : mapping of str to str
        Programs that made them, and their versions.

    Returns
    -------
    dict
        For ``ro-crate-metadata.json``.
    """
    of_study = {
        about["name"]: [f for f in files if f.startswith(f"{about['name']}/")] for about in studies
    }
    names = {
        path: ". ".join(part for part in (caption, see) if part)
        for about in studies
        for path, _, caption, see, *_ in about["figures"]
    }
    programs = [
        {"@id": f"#{name}", "@type": "SoftwareApplication", "name": name, "version": number}
        for name, number in versions.items()
    ]
    made = {
        "@id": "#run",
        "@type": "CreateAction",
        "name": "Simulated, drawn and judged by the workflow",
        "instrument": [{"@id": program["@id"]} for program in programs],
        "object": _references(f for f in files if _goes_in(f)),
        "result": _references(f for f in files if f.endswith(".nc")),
    }
    root = {
        "@id": "./",
        "@type": "Dataset",
        "name": "Impact dampers: results of reproducible studies",
        "description": "Cubes of simulations, with the figures, tables and verdicts made of them.",
        "license": {"@id": "https://spdx.org/licenses/BSD-3-Clause"},
        "hasPart": [
            *({"@id": f"{name}/"} for name in of_study),
            *_references(f for f in files if "/" not in f),
        ],
        "mentions": {"@id": "#run"},
    }
    descriptor = {
        "@id": "ro-crate-metadata.json",
        "@type": "CreativeWork",
        "conformsTo": _CONFORMS,
        "about": {"@id": "./"},
    }
    folders = [
        {
            "@id": f"{about['name']}/",
            "@type": "Dataset",
            "name": about["title"],
            "description": about["description"] or about["title"],
            "hasPart": _references(of_study[about["name"]]),
        }
        for about in studies
    ]
    entities = [_file(results, path, names.get(path.rpartition(".")[0], "")) for path in files]
    return {
        "@context": "https://w3id.org/ro/crate/1.1/context",
        "@graph": [descriptor, root, *folders, *entities, made, *programs],
    }


def _goes_in(path: str) -> bool:
    """Whether a file is a study as it was run, or a record that drives it."""
    return path.count("/") == 1 and path.endswith((".yaml", ".csv"))


def _references(paths: Any) -> list[dict[str, str]]:
    return [{"@id": path} for path in paths]


def _file(results: Path, path: str, description: str) -> dict[str, Any]:
    """Describe a file; files with run times differ in each run."""
    about = {"@id": path, "@type": "File", "name": path.rpartition("/")[2]}
    about |= {"encodingFormat": FORMATS.get(Path(path).suffix, "application/octet-stream")}
    if "timed" not in path.split("/"):
        content = (results / path).read_bytes()
        about |= {"contentSize": str(len(content)), "sha256": sha256(content).hexdigest()}
    return about | ({"description": description} if description else {})
