"""All measurements of the cost study, in one dictionary that goes into its file of timings."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from damper.verification.cost.jobs import jobs_of
from damper.verification.cost.ladder import climb, read_rungs
from damper.verification.cost.machine import core, machine
from damper.verification.cost.scaling import scale
from damper.verification.cost.startup import job_times, start_up
from damper.verification.cost.without import unused


def measure(
    settings: Mapping[str, Any],
    folder: Path = Path(),
    config_files: Sequence[Path] = (),
    benchmarks: Path | None = None,
) -> dict[str, Any]:
    """Measure what the settings ask for, one thing after the other; to be alone on the machine.

    Parameters
    ----------
    settings : mapping
        Any of ``ladder`` (``rungs`` for `damper.verification.cost.ladder.read_rungs`, and the
        keywords of `damper.verification.cost.ladder.climb`), ``unused`` (those of
        `damper.verification.cost.without.unused`), ``scaling`` (those of
        `damper.verification.cost.scaling.scale`), ``startup`` (``jobs`` and ``repeats`` of
        `damper.verification.cost.startup.start_up`) and ``jobs``
        (`damper.verification.cost.jobs.jobs_of`).
    folder : Path
        The project: where its Snakefile and the scripts of its jobs are.
    config_files : sequence of Path
        What the run got behind ``--configfile``.
    benchmarks : Path, optional
        Snakemake's benchmark files of the jobs that have run.

    Returns
    -------
    dict
        Of numbers, texts, lists and dictionaries only: ``machine``, ``core``, and a part for each
        part of the settings.

    Raises
    ------
    ValueError, TypeError
        For an unknown part, a scene that is none, and the like.
    """
    unknown = set(settings) - set(PARTS)
    if unknown:
        raise ValueError(f"unknown part {min(unknown)!r}: must be one of {', '.join(PARTS)}")
    found: dict[str, Any] = {"machine": machine(), "core": core()}
    if "ladder" in settings:
        given = dict(settings["ladder"])
        found["ladder"] = climb(read_rungs(given.pop("rungs")), **given)
    if "unused" in settings:
        given = dict(settings["unused"])
        found["unused"] = given | {"ratios": unused(**given)}
    if "scaling" in settings:
        found["scaling"] = scale(**settings["scaling"])
    if "startup" in settings:
        given = settings["startup"]
        found["startup"] = start_up(given["jobs"], folder, given["repeats"])
        found["times"] = job_times(benchmarks) if benchmarks else {}
    if "jobs" in settings:
        found["jobs"] = jobs_of(settings["jobs"], folder, config_files)
    return found


#: Parts of the settings.
PARTS = ("ladder", "unused", "scaling", "startup", "jobs")
