"""Structures: a primary of several coordinates or modes, with boxes anywhere on it."""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np

from damper.parameters.names import counted, unknown_name
from damper.parameters.quantity import Quantity, finite, in_range

#: Largest difference of two mirrored entries, over the largest entry, that counts as rounding.
ASYMMETRY = 1e-8
#: Least eigenvalue, over the largest, of a matrix that counts as semidefinite.
_ROUNDING = 1e-12
#: Most coordinates of a structure.
MOST_COORDINATES = 200
#: Names in `shapes` that are no boxes.
FORCE, BASE = "force", "base"


class Structure:
    """A structure with mass M, damping C and stiffness K, and the places on it that have names.

    ``M q'' + C q' + K q = B f(t)`` with n coordinates q. A named place is a vector b of n weights:
    its displacement is ``b . q``, and a force on it is ``b`` times the force on the coordinates.
    Instead of a vector, the number of a coordinate, from 0, stands for that coordinate alone.
    A structure does not change; another one is made by `having`.

    Parameters
    ----------
    mass, stiffness : array_like (n, n)
        Symmetric; the mass positive definite, the stiffness positive semidefinite; in kg and N/m.
        For one coordinate a number.
    damping : array_like (n, n), optional
        Symmetric and positive semidefinite, in N s/m; none when left out.
    boxes : mapping of str to vector or int
        The places that have a box for a free mass.
    force : vector, int or str, optional
        Where the force acts; the name of a box or point stands for its vector.
    base : vector, optional
        Displacement of each coordinate in a unit displacement of the base: ``B f = -M base a(t)``.
        Coordinates are relative to the base then.
    points : mapping of str to vector or int
        Further places whose motion is wanted.

    Raises
    ------
    ValueError, TypeError
        With the name of the matrix or vector, the entry and what is allowed.

    Examples
    --------
    >>> Structure(mass=[[2.0, 0.0], [0.0, 1.0]], stiffness=[[300.0, -100.0], [-100.0, 100.0]],
    ...           boxes={"roof": 1}, force=0)
    Structure(<2 coordinates, 1.125 to 2.251 Hz>, boxes=['roof'], force)
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    force: np.ndarray | None
    base: np.ndarray | None
    boxes: Mapping[str, np.ndarray]
    points: Mapping[str, np.ndarray]
    """Every named place: the boxes as well."""
    base_shares: Mapping[str, float]
    """Displacement of each box in a unit displacement of the base."""
    _modes: tuple[np.ndarray, np.ndarray] | None
    """Frequencies in Hz and damping ratios, if they were given."""

    def __init__(
        self,
        mass: Any,
        damping: Any = None,
        stiffness: Any = None,
        *,
        boxes: Mapping[str, Any] | None = None,
        force: Any = None,
        base: Any = None,
        points: Mapping[str, Any] | None = None,
    ) -> None:
        if stiffness is None:
            raise TypeError("stiffness is missing: Structure(mass=M, damping=C, stiffness=K)")
        found = {"mass": _matrix("mass", mass)}
        n = len(found["mass"])
        found["stiffness"] = _matrix("stiffness", stiffness, n)
        found["damping"] = _matrix("damping", np.zeros((n, n)) if damping is None else damping, n)
        _check_definite("mass", found["mass"], strictly=True)
        _check_definite("stiffness", found["stiffness"])
        _check_definite("damping", found["damping"])
        vectors = {
            "boxes": _named_vectors("boxes", boxes, n),
            "points": _named_vectors("points", points, n),
        }
        for name in vectors["boxes"].keys() & vectors["points"].keys():
            if not np.array_equal(vectors["boxes"][name], vectors["points"][name]):
                raise ValueError(f"{name!r} is a box and another point: give two names")
        vectors["points"] = vectors["boxes"] | vectors["points"]
        if isinstance(force, str):
            if force not in vectors["points"]:
                raise unknown_name("place of the force", force, vectors["points"])
            force = vectors["points"][force]
        single = {"force": force, "base": base}
        read = {k: None if v is None else _vector(k, v, n) for k, v in single.items()}
        influence = np.zeros(n) if read[BASE] is None else read[BASE]
        shares = {name: float(b @ influence) for name, b in vectors["boxes"].items()}
        self._set(**found, **vectors, **read, base_shares=shares)

    @classmethod
    def from_modes(
        cls,
        frequencies: Sequence[float],
        damping_ratios: Sequence[float] | float = 0.0,
        shapes: Mapping[str, Any] | None = None,
        *,
        modal_masses: Sequence[float] | None = None,
        base_shares: Mapping[str, float] | None = None,
    ) -> "Structure":
        """Return the structure of a modal table.

        Parameters
        ----------
        frequencies : sequence of float
            Undamped natural frequency of each mode in Hz; 0 is a rigid-body mode.
        damping_ratios : sequence of float, or float
            Of each mode, or of all.
        shapes : mapping of str to sequence of float
            Name of a place -> its displacement in each mode. Each but ``"force"`` and ``"base"``
            may have a box. ``"force"`` is where the force acts: a shape, or the name of another
            place. ``"base"`` has the participation factor of each mode,
            ``shape . M . influence / modal mass``, for a base that moves.
        modal_masses : sequence of float, optional
            In kg; all 1 for shapes that are normalised by mass, as they are when it is left out.
        base_shares : mapping of str to float, optional
            Displacement of a box along itself in a unit displacement of the base: 1 when left out,
            for a box along the base's motion; 0 for one across. The lowest modes do not say it.

        Examples
        --------
        >>> Structure.from_modes([1.0, 6.3], [0.01, 0.01], {"tip": [2.0, -2.0], "force": [0.7, 1]})
        Structure(<2 modes, 1 to 6.3 Hz>, boxes=['tip'], force)
        """
        hertz = _row("frequencies", frequencies)
        n = len(hertz)
        ratios = np.full(n, damping_ratios) if np.ndim(damping_ratios) == 0 else damping_ratios
        ratios = _row("damping_ratios", ratios, n)
        masses = _row("modal_masses", np.ones(n) if modal_masses is None else modal_masses, n)
        for name, values, above in (
            ("frequencies", hertz, False),
            ("damping_ratios", ratios, False),
            ("modal_masses", masses, True),
        ):
            for k, value in enumerate(values.tolist()):
                in_range(f"{name}[{k}]", value, minimum=0.0, above=above)
        given = _mapping("shapes", shapes)
        if isinstance(given.get(FORCE), str):
            if given[FORCE] not in given.keys() - {FORCE}:
                raise unknown_name("place of the force", given[FORCE], given.keys() - {FORCE})
            given[FORCE] = given[given[FORCE]]
        vectors = _named_vectors("shapes", given, n, named=False)
        single = {name: vectors.pop(name, None) for name in (FORCE, BASE)}
        shares = dict.fromkeys(vectors, 1.0)
        for name, share in _mapping("base_shares", base_shares, "shares").items():
            if name not in shares:
                raise unknown_name("box of base_shares", name, shares)
            shares[name] = finite(f"base_shares[{name!r}]", share)
        rates = 2.0 * math.pi * hertz
        with np.errstate(over="ignore"):
            damping, stiffness = 2.0 * ratios * rates * masses, rates * rates * masses
        for name, values in (("damping", damping), ("stiffness", stiffness)):
            for k, value in enumerate(values.tolist()):
                finite(f"{name} of mode {k + 1}", value)
        return cls.__new__(cls)._set(
            mass=np.diag(masses),
            damping=np.diag(damping),
            stiffness=np.diag(stiffness),
            boxes=vectors,
            points=vectors,
            base_shares=shares,
            modes=(hertz, ratios),
            **single,
        )

    @classmethod
    def read_modes(cls, path: Any, **options: Any) -> "Structure":
        """Read a modal table; arguments are those of `structure_files.read_modes`."""
        from damper.parameters.structure_files import read_modes  # which makes structures

        return read_modes(path, **options)

    @classmethod
    def read_matrices(cls, files: Any, **options: Any) -> "Structure":
        """Read matrices; arguments are those of `structure_files.read_matrices`."""
        from damper.parameters.structure_files import read_matrices  # which makes structures

        return read_matrices(files, **options)

    def _set(self, modes: Any = None, **values: Any) -> "Structure":
        for name, value in values.items():
            if name in ("boxes", "points"):
                value = {key: _frozen(one) for key, one in value.items()}
            self.__dict__[name] = _frozen(value) if isinstance(value, np.ndarray) else value
        self.__dict__["_modes"] = modes
        return self

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a structure does not change: make another one, of another {name}")

    def __len__(self) -> int:
        """Number of its coordinates."""
        return len(self.mass)

    @property
    def size_in_words(self) -> str:
        """Number of its coordinates or modes, and their frequencies."""
        low, high = self.frequencies[0], self.frequencies[-1]
        size = counted(len(self), "coordinate" if self._modes is None else "mode")
        rates = f"{low:.4g} Hz" if len(self) == 1 else f"{low:.4g} to {high:.4g} Hz"
        return f"{size}, {rates}"

    def __repr__(self) -> str:
        words = [f"<{self.size_in_words}>", f"boxes={list(self.boxes)}"]
        words += [name for name in (FORCE, BASE) if getattr(self, name) is not None]
        others = [name for name in self.points if name not in self.boxes]
        words += [f"points={others}"] if others else []
        return f"Structure({', '.join(words)})"

    @cached_property
    def _key(self) -> tuple[Any, ...]:
        matrices = (self.mass, self.damping, self.stiffness)
        vectors = {FORCE: self.force, BASE: self.base} | dict(self.points)
        # One zero: the other one is equal to it. The order of names does not count.
        return (
            *((m + 0.0).tobytes() for m in matrices),
            *((k, (v + 0.0).tobytes()) for k, v in sorted(vectors.items()) if v is not None),
            *sorted(self.base_shares.items()),
        )

    def __eq__(self, other: object) -> bool:
        return self._key == other._key if isinstance(other, Structure) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key)

    @cached_property
    def fingerprint(self) -> str:
        """Digest of all its numbers and names."""
        return sha256(repr(self._key).encode()).hexdigest()[:16]

    @cached_property
    def frequencies(self) -> np.ndarray:
        """Undamped natural frequencies in Hz, rising."""
        return np.sqrt(self._modal[0]) / (2.0 * math.pi)

    @property
    def shapes(self) -> np.ndarray:
        """Undamped modes (n, n) of modal mass 1: a column for each, in the order of frequencies."""
        return self._modal[1]

    @cached_property
    def _modal(self) -> tuple[np.ndarray, np.ndarray]:
        """Squares of the natural angular frequencies, and the shapes."""
        factor = np.linalg.inv(np.linalg.cholesky(self.mass))
        squares, vectors = np.linalg.eigh(factor @ self.stiffness @ factor.T)
        return np.maximum(squares, 0.0), factor.T @ vectors

    def mode_energies(self, x: Any, v: Any) -> np.ndarray:
        """Return the energy of each mode, kinetic and potential.

        Parameters
        ----------
        x, v : array_like (..., n)
            Displacements and velocities of the coordinates.

        Returns
        -------
        ndarray (..., n)
            In J, in the order of `frequencies`; their sum is that of the structure.
        """
        squares, shapes = self._modal
        to_modes = shapes.T @ self.mass
        rates, places = np.asarray(v) @ to_modes.T, np.asarray(x) @ to_modes.T
        return 0.5 * (rates**2 + squares * places**2)

    @property
    def settings(self) -> dict[str, Any]:
        """What it is made of, in plain values; `of_settings` is the inverse."""
        vectors = {FORCE: self.force, BASE: self.base}
        single = {name: v.tolist() for name, v in vectors.items() if v is not None}
        points = {name: b.tolist() for name, b in self.points.items()}
        if self._modes is not None:
            hertz, ratios = (row.tolist() for row in self._modes)
            return {
                "frequencies": hertz,
                "damping_ratios": ratios,
                "shapes": points | single,
                "modal_masses": np.diag(self.mass).tolist(),
                "base_shares": dict(self.base_shares),
            }
        matrices = {name: getattr(self, name).tolist() for name in ("mass", "damping", "stiffness")}
        boxes = {name: points[name] for name in self.boxes}
        return {**matrices, **single, "boxes": boxes, "points": points}

    @classmethod
    def of_settings(cls, settings: Mapping[str, Any]) -> "Structure":
        """Return the structure of `settings`."""
        return cls.from_modes(**settings) if "frequencies" in settings else cls(**settings)

    def box(self, name: Any, what: str = "box") -> np.ndarray:
        """Return the vector of a box; TypeError or ValueError with the nearest name for others."""
        if not isinstance(name, str) or name not in self.boxes:
            raise unknown_name(what, name, self.boxes)
        if not self.boxes[name].any():
            raise ValueError(f"{what} {name!r}: all its weights are zero, so it never moves")
        return self.boxes[name]

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Numbers of a structure given by modes, as `having` takes them."""
        found = []
        for k in range(1, len(self) + 1 if self._modes else 1):
            of = f"of mode {k}"
            found.append(Quantity(f"mode_{k}_frequency", f"$f_{{{k}}}$", f"frequency {of}", "Hz"))
            symbol = rf"$\zeta_{{{k}}}$"
            found.append(Quantity(f"mode_{k}_damping_ratio", symbol, f"damping ratio {of}"))
        return tuple(found)

    @property
    def numbers(self) -> dict[str, float]:
        """Their values."""
        pairs = zip(*(row.tolist() for row in self._modes or ()), strict=True)
        values = [value for pair in pairs for value in pair]
        return {q.name: value for q, value in zip(self.quantities, values, strict=True)}

    def having(self, **numbers: float) -> "Structure":
        """Return the structure with other frequencies or damping ratios of some modes.

        Parameters
        ----------
        **numbers : float
            `mode_1_frequency` in Hz and `mode_1_damping_ratio` are those of the first mode.

        Raises
        ------
        ValueError, TypeError
            For an unknown name; for a structure that was not given by modes.

        Examples
        --------
        >>> beam = Structure.from_modes([1.0, 6.3], 0.01, {"tip": [2.0, -2.0]})
        >>> beam.having(mode_2_frequency=5.5).frequencies.round(6).tolist()
        [1.0, 5.5]
        """
        if numbers and self._modes is None:
            raise ValueError(
                f"{next(iter(numbers))}: is of a structure that is given by modes, as "
                "damper.Structure.from_modes makes it"
            )
        known = self.numbers
        for name in numbers:
            if name not in known:
                raise unknown_name("number of the structure", name, known)
        values = list((known | numbers).values())
        changed = {"frequencies": values[::2], "damping_ratios": values[1::2]}
        return Structure.from_modes(**self.settings | changed)


def _frozen(values: Any) -> np.ndarray:
    made = np.array(values, dtype=float)
    made.setflags(write=False)
    return made


def _numbers(name: str, values: Any) -> np.ndarray:
    """Return values as an array; errors name the first entry that is not a finite number."""
    if hasattr(values, "toarray"):  # a sparse matrix
        values = values.toarray()
    for word in ("units", "unit"):
        if hasattr(values, word):
            raise ValueError(
                f"{name} has units {getattr(values, word)!s}: give plain numbers in SI units"
            )
    try:
        array = np.asarray(values)
    except ValueError:
        raise TypeError(f"{name}: its rows differ in length: give a matrix of numbers") from None
    if array.dtype.kind not in "iuf":
        raise TypeError(f"{name} = {values!r}: must be numbers")
    array = array.astype(float)
    for place in np.argwhere(~np.isfinite(array))[:1].tolist():
        where = ", ".join(map(str, place))
        finite(f"{name}[{where}]", float(array[tuple(place)]))
    return array


def _matrix(name: str, values: Any, n: int | None = None) -> np.ndarray:
    array = _numbers(name, values)
    array = array.reshape(1, 1) if array.ndim == 0 else array
    if array.ndim != 2 or array.shape[0] != array.shape[1] or not len(array):
        raise ValueError(f"{name} has the shape {array.shape}: must be square")
    if n is not None and len(array) != n:
        raise ValueError(f"{name} has the shape {array.shape}: must be {(n, n)}, as mass has it")
    if len(array) > MOST_COORDINATES:
        raise ValueError(
            f"{name} has {len(array)} coordinates: must be at most {MOST_COORDINATES}; reduce the "
            "structure to its lowest modes, damper.Structure.from_modes"
        )
    apart = np.abs(array - array.T)
    if apart.max() > ASYMMETRY * np.abs(array).max():
        i, j = np.unravel_index(int(apart.argmax()), apart.shape)
        raise ValueError(
            f"{name} is not symmetric: {name}[{i}, {j}] = {float(array[i, j])!r} and "
            f"{name}[{j}, {i}] = {float(array[j, i])!r} differ by {apart.max():.3g}; must be equal"
        )
    return 0.5 * (array + array.T)


def _check_definite(name: str, array: np.ndarray, strictly: bool = False) -> None:
    """Raise ValueError unless the eigenvalues are positive, or at least not negative."""
    diagonal = np.diag(array)
    for k in np.flatnonzero(diagonal <= 0.0 if strictly else diagonal < 0.0)[:1].tolist():
        sign = "> 0" if strictly else ">= 0"
        raise ValueError(f"{name}[{k}, {k}] = {float(diagonal[k])!r}: must be {sign}")
    if np.array_equal(array, np.diag(diagonal)):
        return
    # Coordinates may be metres and radians: each is scaled to a diagonal of 1.
    size = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    values, vectors = np.linalg.eigh(array / size / size[:, None])
    least, allowed = float(values[0]), _ROUNDING * len(array) * float(values[-1])
    if least <= allowed if strictly else least < -allowed:
        k = int(np.abs(vectors[:, 0]).argmax())
        what = "positive definite" if strictly else "positive semidefinite"
        raise ValueError(
            f"{name} is not {what}: scaled to a diagonal of 1, its least eigenvalue is "
            f"{least:.3g}, mostly of coordinate {k} ({name}[{k}, {k}] = {float(diagonal[k])!r})"
        )


def _row(name: str, values: Any, n: int | None = None) -> np.ndarray:
    array = _numbers(name, values)
    array = array.reshape(1) if array.ndim == 0 and n in (None, 1) else array
    if array.ndim != 1 or not len(array) or (n is not None and len(array) != n):
        many = "one value for each mode" if n is None else f"{n} values, one for each mode"
        raise ValueError(f"{name} has the shape {array.shape}: must be {many}")
    return array


def _vector(name: str, given: Any, n: int) -> np.ndarray:
    """Return a vector of weights, or the unit vector of a coordinate that is given by number."""
    if isinstance(given, int | np.integer) and not isinstance(given, bool):
        if not 0 <= given < n:
            allowed = f"0 to {n - 1}" if n > 1 else "0, or a weight with a point, as 1.0"
            raise ValueError(f"{name} = {given!r}: must be the number of a coordinate, {allowed}")
        return np.eye(n)[int(given)]
    array = _numbers(name, given)
    array = array.reshape(1) if array.ndim == 0 and n == 1 else array
    if array.ndim == 2 and 1 in array.shape:
        array = array.ravel()  # a column of a file
    if array.shape != (n,):
        count = f"{array.size} values" if array.ndim == 1 else f"the shape {array.shape}"
        raise ValueError(f"{name} has {count}: must be {n}, one for each coordinate")
    return array


def _mapping(name: str, given: Any, of: str = "vectors") -> dict[str, Any]:
    if not isinstance(given, Mapping | None):
        raise TypeError(f"{name} = {given!r}: must be a mapping of names to {of}")
    return dict(given or {})


def _named_vectors(
    name: str, given: Mapping[str, Any] | None, n: int, named: bool = True
) -> dict[str, np.ndarray]:
    given = _mapping(name, given)
    for key in given:
        if not isinstance(key, str) or not key.strip():
            raise TypeError(f"{name}: {key!r} is no name")
        if named and key in (FORCE, BASE):
            raise ValueError(f"{name}: {key!r} is no name of a place; give {key}= beside {name}")
    read = _vector if named else _row
    return {key: read(f"{name}[{key!r}]", value, n) for key, value in given.items()}
