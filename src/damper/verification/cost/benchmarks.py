"""Wall times of jobs that have run, from Snakemake's own benchmark files, by stage."""

from pathlib import Path


def seconds_by_stage(folder: Path, since: float = 0.0) -> dict[str, list[float]]:
    """Wall seconds of every job, by what the jobs do.

    Parameters
    ----------
    folder : Path
        Usually ``logs/benchmarks``; a folder that is not there has no jobs.
    since : float, optional
        Time, as `time.time` gives it, before which files are left out.

    Returns
    -------
    dict
        Stage -> seconds of each of its jobs.
    """
    seconds: dict[str, list[float]] = {}
    for path in sorted(folder.rglob("*.tsv")):
        if path.stat().st_mtime >= since:
            text = path.read_text(encoding="utf-8").splitlines()[1]
            stage = stage_of(path.relative_to(folder))
            seconds.setdefault(stage, []).append(float(text.split("\t")[0]))
    return seconds


def stage_of(path: Path) -> str:
    """Stage that a benchmark file is of: ``<study>/<stage>...``, or ``<stage>/...`` of no study."""
    first, second = (*path.with_suffix("").parts, "")[:2]
    stage = first if first in ("compile", "claims", "report") else second or first
    return {"figures": "figure", "tables": "table"}.get(stage, stage)
