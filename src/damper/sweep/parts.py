"""Parts: the .npz file that a job of a study makes, for every kind of study.

No xarray here: a job writes plain arrays, with the same bytes each time, and as one JSON text what
else there is to say of them.
"""

import json
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from damper.parameters.variables import Variable

_ABOUT = "__about__"


@dataclass(frozen=True)
class PartData:
    """Arrays by name, and what JSON can hold."""

    arrays: dict[str, np.ndarray]
    about: dict[str, Any] = field(default_factory=dict)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Declarations of a slice's arrays."""
        return tuple(
            Variable(**{**entry, "dims": tuple(entry["dims"]), "flags": tuple(entry["flags"])})
            for entry in self.about["variables"]
        )


class DamagedPartError(Exception):
    """A file is not, or no longer, what a job wrote."""


def write_part(part: PartData, path: Path) -> None:
    """Write a part as .npz; the same part gives the same bytes."""
    text = json.dumps({"arrays": list(part.arrays), "about": part.about}, sort_keys=True)
    arrays: dict[str, Any] = {_ABOUT: np.array(text), **part.arrays}
    np.savez(path, **arrays)


def read_part(path: Path) -> PartData:
    """Read what `write_part` wrote.

    Raises
    ------
    DamagedPartError
        With the path, where the file was cut or changed.
    """
    stream = BytesIO(path.read_bytes())
    try:
        with np.load(stream) as file:
            if bad := file.zip.testzip():
                raise ValueError(f"the bytes of {bad} have changed")
            arrays = {name: file[name] for name in file.files}
        written = json.loads(str(arrays.pop(_ABOUT)))
        if list(arrays) != written["arrays"]:
            raise ValueError("arrays are missing")
        return PartData(arrays, written["about"])
    except (BadZipFile, EOFError, KeyError, NotImplementedError, ValueError) as error:
        raise DamagedPartError(f"{path} is damaged: {error}") from None
