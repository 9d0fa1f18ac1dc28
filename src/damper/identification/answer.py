"""`damper.identify`: unknown quantities of a damper, and how sure they are."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from damper.identification.draws import AGREE
from damper.identification.fit import Fit, Fitter
from damper.identification.problem import OF_RECORD, RecordedDamper
from damper.identification.recordings import KINDS, Recording, plain_numbers, read_recording
from damper.parameters import Parameters, SIParameters
from damper.parameters.files import path_of
from damper.parameters.forcing import forcing_of, left_out
from damper.parameters.lazy import pd
from damper.parameters.named import completed
from damper.parameters.names import NAMES_BY_SYMBOL, split, unknown_name
from damper.parameters.quantities import ALL, INITIAL_NAMES, is_si
from damper.parameters.quantity import finite
from damper.parameters.tables import WALL_TABLES, read_table
from damper.sizing.words import text_of
from damper.study.yaml_file import read_yaml

#: Part of all dampers that an interval is to hold.
_CONFIDENCE = 0.95
#: Chance of a residual in white noise, by each of the tests, below which a card says so.
_CHANCE = 1e-3
#: Half of an interval over the value from which on it counts which unknowns the data tell apart,
#: and from which on the data do not determine the value.
_LOOSE, _VAGUE = 0.1, 0.5
#: Singular value, over the largest one, of what the data cannot tell at all.
_NOTHING = 1e-6
#: Part of an allowed range within which a value is at its end.
_AT_END = 1e-4
#: Samples in a period of the primary, below which a record is coarse.
_COARSE = 10.0


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class Identification:
    """What records say about a damper; made by `identify`."""

    title: str
    values: pd.DataFrame
    """`quantity`, `value`, `unit`, the ends `low` and `high` of its 95 % interval, and
    `standard_error` by the covariance, a row each."""
    parameters: Parameters | SIParameters
    """The damper with these values."""
    correlation: pd.DataFrame
    profile: pd.DataFrame
    """Least `sum_of_squares`, over its least value, where one quantity has another `value`, in its
    `unit`."""
    motion: pd.DataFrame
    """`record`, `time`, `measured`, `computed` and `residual`."""
    impacts: pd.DataFrame
    """`record`, `time`, `side` and `approach_speed` of the computed impacts."""
    records: tuple[Recording, ...]
    rms: Mapping[str, float]
    """Rms of the residual of each record, with its degrees of freedom."""
    warnings: tuple[str, ...]
    """Unknowns that the data cannot tell apart, and faults of the fit."""
    assumed: tuple[str, ...]
    studies: Mapping[str, dict[str, Any]]
    """Studies that run the result, a record each."""

    def __getitem__(self, name: str) -> float:
        """Value of a quantity."""
        rows = self.values.set_index("quantity").value
        if name not in rows:
            raise unknown_name("quantity", name, rows.index)
        return float(rows[name])

    def interval(self, name: str) -> tuple[float, float]:
        """Ends of the 95 % interval of a quantity."""
        self[name]
        row = self.values.set_index("quantity").loc[name]
        return float(row.low), float(row.high)

    @property
    def lines(self) -> list[tuple[str, str, str]]:
        """Quantity, value and interval, in words."""
        found = []
        for row in self.values.itertuples():
            half = 0.5 * (row.high - row.low)
            digits = 3
            if 0.0 < half < math.inf and row.value:
                digits = min(max(math.ceil(math.log10(abs(row.value) / half)) + 2, 2), 12)
            ends = [text_of(end, row.unit, digits) for end in (row.low, row.high)]
            found.append((row.quantity, text_of(row.value, row.unit, digits), " to ".join(ends)))
        return found

    def __repr__(self) -> str:
        shown = pd.DataFrame(self.lines, columns=["quantity", "value", "95 % interval"])
        noise = ", ".join(f"{label}: rms residual {rms}" for label, rms in self.rms_text.items())
        body = [f"! {text}" for text in self.warnings] + [shown.to_string(index=False), noise]
        return "\n".join([self.title, *body, *(f"- {text}" for text in self.assumed)])

    @property
    def rms_text(self) -> dict[str, str]:
        """Rms of the residual of each record, with its unit."""
        si = isinstance(self.parameters, SIParameters)
        units = {one.label: KINDS[one.kind][0] if si else "1" for one in self.records}
        return {label: text_of(rms, units[label]) for label, rms in self.rms.items()}

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Write the page (HTML, Markdown), figure, CSV files and studies into a folder.

        The files of an older page there are deleted first. ValueError where the folder cannot be
        written.
        """
        from damper.identification.page import write

        write(self, Path(path_of(folder, "folder", "folder")))


def identify(
    records: Any,
    free: Sequence[str],
    machine: Any = None,
    *,
    kind: str = "displacement",
    starts: Mapping[str, float] | None = None,
    ranges: Mapping[str, Sequence[float]] | None = None,
    **known: Any,
) -> Identification:
    """Find unknown quantities of a damper by least squares on exact runs.

    Fits begin from many starts and go from short windows of the records to the whole. The last fit
    has the engine's own derivatives; by what it has none of, differences, which the answer says.

    Parameters
    ----------
    records : path, Recording, or sequence of them
        Files are read by `damper.read_recording` as records of `kind`.
    free : sequence of str
        Names of the unknowns: quantities of `damper.Parameters` or `SIParameters`, or their
        symbols, such as r and d; quantities of a single mass, such as gap_1; initial quantities,
        of each record that does not state them; and `scale`, the factor of a record.
    machine : path, mapping, Parameters or SIParameters, optional
        What is known: a YAML file with quantities, `forcing`, and perhaps `starts`, `ranges` and
        `records` (for each `file` and what `damper.Recording` takes). Without a force it is free
        motion. The value of an unknown is where it starts.
    kind : str, default "displacement"
        Of files, as for `Recording`.
    starts : mapping of str to float, optional
        Where unknowns start. They then spread from a third to three times of it.
    ranges : mapping of str to (lowest, highest), optional
        Ranges of unknowns.
    **known
        Quantities by name, over those of `machine`.

    Returns
    -------
    Identification

    Raises
    ------
    ValueError, TypeError
        With the name, the value and what is allowed.

    Examples
    --------
    A ball that falls on a heavy floor; the times between its bounces.

    >>> import damper
    >>> floor = dict(primary_mass=1e6, stiffness=1e6, damping=0, free_mass=1, gap=10, gravity=9.81)
    >>> found = damper.identify(
    ...     damper.Recording([0.8390, 0.7511, 0.6722, 0.6013], kind="intervals"), ["restitution"],
    ...     floor, initial_position=-1 + 2 * 1.1 / 10)
    >>> round(found["restitution"], 3)
    0.892
    """
    if not find_spec("scipy"):
        raise ValueError("scipy is missing: pip install -e '.[fast,workflow]'")
    known, about = _read(machine, known)
    starts = {**about.get("starts", {}), **plain_numbers(starts or {}, "starts")}
    ranges = {**about.get("ranges", {}), **plain_numbers(ranges or {}, "ranges")}
    recordings = _recordings(records, about, kind)
    if not (isinstance(free, list | tuple) and all(isinstance(name, str) for name in free)):
        raise TypeError(f"free = {free!r}: must be a list of names")
    assumed = []
    if "forcing" not in known and not known.get("force_amplitude"):
        known = {"forcing": "none", **known}
        assumed.append("Nothing drives the machine: free motion.")
        started = [n for n in INITIAL_NAMES[:2] if _is_unknown(n, free, known, recordings)]
        if started:
            free = [*free, *started]
            assumed.append(f"No {' and no '.join(started)} is given: unknown as well.")
    problem = RecordedDamper(completed(known), recordings, list(free), starts, ranges)
    fitter = Fitter(problem)
    problem.check(fitter.start(0))
    return _answer(fitter, fitter.best(), assumed)


def _is_unknown(
    name: str, free: Sequence[str], known: Mapping[str, Any], records: Sequence[Recording]
) -> bool:
    """Whether a record of free motion begins in a way that nobody says."""
    showing = [record for record in records if record.is_sampled]
    said = name in known or name in [NAMES_BY_SYMBOL.get(one, one) for one in free]
    return not said and any(name not in record.known for record in showing)


def _read(machine: Any, known: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return what is known, and what a file says of the records and of starts."""
    about: dict[str, Any] = {}
    folder = Path()
    if isinstance(machine, str | os.PathLike):
        folder = Path(machine).parent
        machine = dict(read_yaml(Path(machine)).data)
        for one in (machine, *(machine.get("masses") or ())):
            for name in WALL_TABLES if isinstance(one, dict) else ():
                if isinstance(one.get(name), str):
                    unit = "m/s" if is_si(machine) else "1"
                    one[name] = read_table(name, folder / one[name], unit)
    elif isinstance(machine, Parameters | SIParameters):
        machine = machine.given
    elif not isinstance(machine, Mapping | None):
        raise TypeError(
            f"machine is of class {type(machine).__name__}: must be a path, a mapping, "
            "damper.Parameters or SIParameters"
        )
    values = {**(machine or {}), **known}
    if "structure" in values:
        raise ValueError("structure: the machine of records has one primary mass: leave it out")
    beside = ("starts", "ranges", "records")
    about |= {name: values.pop(name) for name in beside if name in values}
    kind = SIParameters if is_si(values) else Parameters
    names = [*(q.name for q in kind.quantities), *INITIAL_NAMES, "forcing", "masses", *WALL_TABLES]
    for name in values:
        if name not in names and not split(name):
            raise unknown_name("parameter", name, [*names, *beside])
    if isinstance(values.get("forcing"), Mapping):
        given = dict(values["forcing"])
        file = given.pop("file", None)
        values["forcing"] = forcing_of(given, None if file is None else folder / str(file))
    about |= {n: plain_numbers(about[n], n) for n in ("starts", "ranges") if n in about}
    listed = _entries(about.get("records", ()))
    about["records"] = [{**one, "file": folder / one["file"]} for one in listed]
    numbers = plain_numbers(values)
    for name, value in numbers.items():
        if name in ALL and not ALL[name].whole:
            finite(name, value)
    return numbers, about


def _entries(records: Any) -> list[Mapping[str, Any]]:
    """Records as a machine's file lists them; ValueError for what is no such list."""
    for k, one in enumerate(records if isinstance(records, list | tuple) else [records]):
        if not (isinstance(one, Mapping) and isinstance(one.get("file"), str | os.PathLike)):
            raise ValueError(
                f"records[{k}] = {one!r}: must be a mapping of file, and what damper.Recording "
                "takes"
            )
    return list(records)


def _recordings(records: Any, about: Mapping[str, Any], kind: str) -> list[Recording]:
    given = () if records is None else records
    given = [given] if isinstance(given, str | os.PathLike | Recording) else given
    if not isinstance(given, list | tuple):
        raise TypeError(
            f"records is of class {type(records).__name__}: must be a file or "
            "damper.Recording(times, values), or a list of them"
        )
    found = [one if isinstance(one, Recording) else read_recording(one, kind) for one in given]
    for entry in about["records"]:
        settings = dict(entry)
        found.append(read_recording(settings.pop("file"), settings.pop("kind", kind), **settings))
    if not found:
        raise ValueError("records: must be one file or Recording, or more")
    labels: dict[str, int] = {}
    for one in found:
        labels[one.label] = labels.get(one.label, 0) + 1
        if labels[one.label] > 1:
            one.__dict__["label"] = f"{one.label} {labels[one.label]}"
    return found


def _answer(fitter: Fitter, fit: Fit, assumed: list[str]) -> Identification:
    from scipy.stats import t

    problem, unknowns = fitter.problem, fitter.problem.unknowns
    errors = np.sqrt(np.diag(fit.covariance))
    own = [j for j, u in enumerate(unknowns) if u.name not in OF_RECORD]
    most = float(t.ppf(0.5 + 0.5 * _CONFIDENCE, fit.freedom))
    told = [j for j in own if errors[j] < math.inf]
    others = [(j, f) for j in told for way in (-most, most) for f in fitter.profile(fit, j, way)]
    points = fitter.likely(fit)
    # Both may have found a lower place.
    cost, point = min(fitter.tried, key=lambda one: one[0])
    if cost < fit.cost * (1.0 - 1e-6):
        fit = fitter.exact(point)
        errors = np.sqrt(np.diag(fit.covariance))
    low, high = fitter.ends(fit, most, points)
    labels = [unknown.label for unknown in unknowns]
    columns = {
        "quantity": labels,
        "value": fit.point,
        "unit": [unknown.unit for unknown in unknowns],
        "low": low,
        "high": high,
        "standard_error": errors,
    }
    with np.errstate(invalid="ignore"):
        correlation = pd.DataFrame(fit.covariance / np.outer(errors, errors), labels, labels)
    rows = [
        (labels[j], other.point[j], unknowns[j].unit, other.cost / (fit.cost or 1.0))
        for j, other in others
    ]
    motion, impacts, rms = _compared(problem, fit)
    values = problem.values_of(fit.point, 0)
    parameters = problem.start(values, 0.0)[0]
    if problem.differences:
        names = ", ".join(sorted(problem.differences))
        assumed.append(f"Derivatives by {names} are differences of runs.")
    for record in problem.records:
        if problem.si and not record.unit:
            units = " and ".join(dict.fromkeys(("s", KINDS[record.kind][0])))
            assumed.append(f"{record.label}: no unit is given, so it is in {units}.")
    return Identification(
        title=f"{', '.join(r.label for r in problem.records)}: {len(unknowns)} unknowns",
        values=pd.DataFrame(columns),
        parameters=parameters,
        correlation=correlation,
        profile=pd.DataFrame(rows, columns=["quantity", "value", "unit", "sum_of_squares"]),
        motion=motion,
        impacts=impacts,
        records=tuple(problem.records),
        rms=rms,
        warnings=tuple(_warnings(fitter, fit, low, high)),
        assumed=tuple(assumed),
        studies={f"record_{k}": _study(problem, fit, k) for k in range(len(problem.records))},
    )


def _compared(
    problem: RecordedDamper, fit: Fit
) -> tuple[pd.DataFrame, pd.DataFrame, dict[str, float]]:
    """Records and the computed ones, the impacts, and rms of each residual."""
    frames, impacts, rms = [], [], {}
    for k, record in enumerate(problem.records):
        computed = problem.computed(fit.point, k, len(record.times), False)[0]
        residual = record.values - computed
        numbered = record.kind == "intervals"
        table = {
            "record": record.label,
            "time": np.cumsum(record.times) if numbered else record.times,
            "measured": record.values,
            "computed": computed,
            "residual": residual,
        }
        frames.append(pd.DataFrame(table))
        end = float(table["time"][-1]) * (1.35 if numbered else 1.0)
        motion, _ = problem.run(fit.point, k, end, False)
        rows = pd.DataFrame(motion.impacts, columns=["time", "side", "approach_speed"])
        rows.insert(0, "record", record.label)
        impacts.append(rows)
        share = fit.freedom / (fit.freedom + len(fit.point))
        rms[record.label] = math.sqrt(float(np.nanmean(residual**2)) / share)
    return pd.concat(frames), pd.concat(impacts), rms


def _warnings(fitter: Fitter, fit: Fit, low: np.ndarray, high: np.ndarray) -> Iterator[str]:
    """Yield the unknowns that the data cannot tell apart, and the faults of the fit."""
    problem, unknowns = fitter.problem, fitter.problem.unknowns
    own = [j for j, unknown in enumerate(unknowns) if unknown.name not in OF_RECORD]
    own += [j for j, unknown in enumerate(unknowns) if unknown.name == "scale"]
    half = 0.5 * (high - low)
    said = set()
    for value, which in fit.confused:
        names = ", ".join(unknowns[j].label for j in which if j in own)
        loose = any(j in own and half[j] > _LOOSE * abs(fit.point[j]) for j in which)
        if ", " in names and loose and names not in said:
            how = "cannot" if value < _NOTHING else "hardly"
            yield f"The data {how} tell apart: {names}. They say more of a combination of these."
            said.add(names)
    for j in own:
        unknown, value = unknowns[j], float(fit.point[j])
        if unknown.record is None and not high[j] - low[j] <= 2.0 * _VAGUE * abs(value):
            yield f"The data do not determine {unknown.label}."
        least, most = unknown.allowed
        near = _AT_END * (most - least if most < math.inf else unknown.starts[1])
        if value - least < near or most - value < near:
            yield f"{unknown.label} = {value:.4g} is at the end of its range."
    if not fitter.again:
        yield (
            "No two searches ended in the best place: another minimum may be better. Narrow ranges "
            "(--range) or a second record help."
        )
    if not fit.converged:
        yield "The fit has not converged: its intervals are no more than a hint."
    if fitter.spread_of_means > AGREE:
        yield (
            "Independent draws lie around different values: the intervals are no more than a hint. "
            "Narrow ranges (--range) or a second record help."
        )
    if (other := fitter.other(fit)) is not None:
        values = (text_of(float(other[j]), unknowns[j].unit) for j in own)
        named = (f"{unknowns[j].label} = {text}" for j, text in zip(own, values, strict=True))
        yield f"The data fit nearly as well with {', '.join(named)}."
    for label, times in fit.excess(_CHANCE).items():
        yield (
            f"{label}: the residual is {times:.2g} times what the record's noise explains. The "
            "machine has more than this model, or the fit is not the best one: do not trust it."
        )
    if fit.chance < _CHANCE:
        yield (
            "The residual is no white noise: the machine has more than this model, a sample is "
            "wrong, or the fit is not the best one. The intervals are too narrow."
        )
    elif fitter.in_part < _CHANCE:
        yield "A part of the records fits much better than the whole: the model may lack something."
    for record in problem.records:
        if record.is_sampled and record.step * problem.rate * _COARSE > math.tau:
            yield f"{record.label}: fewer than {_COARSE:g} samples in a period of the machine."


def _study(problem: RecordedDamper, fit: Fit, k: int) -> dict[str, Any]:
    """The study that runs a record's damper."""
    record, values = problem.records[k], problem.values_of(fit.point, k)
    parameters, _ = problem.start(values, 0.0)
    force = values.pop("forcing", None)
    values.pop("masses", None)
    free = left_out(parameters.forcing, problem.si)
    given = {
        name: v
        for name, v in values.items()
        if v is not None and free.get(name) != v and not split(name)
    }
    # Of a table also where it was given as a file.
    given |= {name: getattr(parameters, name) for name in WALL_TABLES if name in given}
    span = float(record.times.sum() if record.kind == "intervals" else np.ptp(record.times))
    study: dict[str, Any] = {
        "title": f"{record.label}: as identified",
        "source": "identified by damper.identify",
        "parameters": _plain(given),
        "transient": 0,
        "periods": max(math.ceil(span / parameters.cycle), 1),
        "observers": {"trajectory": {"samples_per_period": 200}, "bursts": {}},
    }
    if force is not None:
        study["forcing"] = dict(parameters.forcing.settings)
    if parameters.masses:
        study["masses"] = [_plain(dict(mass)) for mass in parameters.masses]
    return study


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of a damper or a mass as a study's file has them."""
    return {
        name: [list(row) for row in value] if name in WALL_TABLES else float(value)
        for name, value in values.items()
    }
