"""Print of study files whether they are valid and what they take, before anything is made.

python -m damper.study.check config/studies/restitution.yaml ...
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from damper.engine.trajectory import Trajectory
from damper.models import model_of
from damper.parameters.quantities import is_si
from damper.parameters.unusual import unusual_damper
from damper.study.config import ConfigError, Study, load_study
from damper.study.estimate import COMPILE_SECONDS, PLAIN_SECONDS, estimate
from damper.study.yaml_file import join_names
from damper.sweep.estimate import amount, duration, machine_memory
from damper.sweep.idle import starts_at_exact_rest

_COLUMNS = ("slices", "points", "runs", "impacts", "time", "job", "memory", "gather", "disk")

#: Where a study is that is given by its name.
_STUDIES = Path("config/studies")
_LEGEND = (
    "Rough upper figures. time: of all simulation jobs on one core, without figures and tables; "
    "job, memory: of one of them; gather: memory to gather the cube; disk: slices and cube."
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table of the studies and what is wrong; return 1 if one is not valid, else 0."""
    parser = argparse.ArgumentParser(
        prog="python -m damper.study.check",
        description="Say of studies whether they are valid and what they take.",
    )
    parser.add_argument(
        "files", nargs="+", type=Path, help="study files, or names of those in config/studies"
    )
    rows: list[tuple[str, ...]] = [("study", "valid", *_COLUMNS)]
    notes, errors = [], []
    for given in parser.parse_args(arguments).files:
        named = _STUDIES / f"{str(given).removesuffix('.yaml')}.yaml"
        path: Path = given if given.exists() or given.parent != Path() else named
        try:
            study = load_study(path)
            rows.append((path.stem, "yes", *_cells(study)))
            notes += [f"{path.stem}: {note}" for note in _notes(study)]
        except ConfigError as error:
            rows.append((path.stem, "no", *"-" * len(_COLUMNS)))
            errors.append(str(error))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for name, *cells in rows:
        padded = [cell.rjust(width) for cell, width in zip(cells, widths[1:], strict=True)]
        print("  ".join([name.ljust(widths[0]), *padded]))
    print(_LEGEND, *notes, sep="\n", flush=True)
    for text in errors:
        print(text, file=sys.stderr)
    return 1 if errors else 0


def _cells(study: Any) -> Sequence[str]:
    """Return what a study takes; less is known of those of structures and of the engine."""
    if not isinstance(study, Study):
        known = (len(study.parts({})), study.runs, study.runs) if hasattr(study, "runs") else ()
        return [*map(_count, known), *"-" * (len(_COLUMNS) - len(known))]
    found = estimate(study)
    return (
        *(_count(n) for n in (found.slices, found.points, found.runs, found.impacts)),
        duration(found.seconds),
        duration(found.job.seconds),
        amount(found.job.memory),
        amount(found.gather_memory),
        amount(found.disk),
    )


def _notes(study: Any) -> Iterator[str]:
    """Yield what runs leave out, does not go into this machine's memory, or is to be compiled."""
    if not hasattr(study, "force"):
        return
    if layout := getattr(study.force, "layout", ""):
        yield (
            f"the file of its record has {layout} (forcing.columns, delimiter, step and factor may "
            "say otherwise)"
        )
    cycle, transient, periods = min(study.windows, key=lambda window: window[0] * sum(window[1:]))
    length = cycle * (transient + periods)
    if length < study.force.end * (1.0 - 1e-9):
        yield (
            f"runs end at {length:g} ({transient:g} + {periods:g} cycles), before "
            f"their {study.force.kind} does, at {study.force.end:g}"
        )
    if not isinstance(study, Study):
        return
    given = [name for section in study.sections.values() for name in section]
    clock = [name for name in ("forcing_frequency", "frequency_ratio") if name in given]
    if clock and not study.force.has_phase:
        yield (
            f"{clock[0]} is no more than the clock: a force of kind {study.force.kind} has no "
            "frequency. Without it a cycle is a second (2 pi sqrt(M/K) in a study without SI "
            "units): then transient, periods, start and length are in s, and so many "
            "samples_per_period a second"
        )
    if is_si(study.ends):
        yield from unusual_damper(study.ends, study.force.kind)
    if starts_at_exact_rest(study.initial, study.ends):
        yield (
            "all runs start at exact rest, where a free mass out of the walls' reach stays idle; "
            "any relative velocity ends that: give initial_relative_velocity, or draws of it, to "
            "see the other motions"
        )
    found, most = estimate(study), machine_memory()
    for what, size in (
        ("a simulation job", found.job.memory),
        ("to gather the cube", found.gather_memory),
    ):
        if size > most:
            yield (
                f"{what} takes some {amount(size)} of memory, more than the {amount(most)} of "
                "this machine"
            )
    if found.run_seconds < PLAIN_SECONDS and not study.orbits:
        return
    models = {p.main_feature for p in study.corners if not Trajectory(model_of(p)).is_compiled}
    if models:
        yield (
            f"to compile for the model {join_names(sorted(models))} takes some "
            f"{duration(COMPILE_SECONDS * len(models))} more, the first time"
        )


def _count(number: float) -> str:
    return f"{number:.0f}" if number < 1e7 else f"{number:.3g}"


if __name__ == "__main__":
    sys.exit(main())
