"""Jobs that Snakemake would run for a target, from an empty folder of results.

A dry run in a process of its own, which also works from within a job: it takes no lock and makes
no results.
"""

import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path


def count_jobs(
    targets: Sequence[str], folder: Path, config_files: Sequence[Path] = ()
) -> dict[str, int]:
    """Return how many jobs of each rule the targets need when nothing is there yet.

    Parameters
    ----------
    targets : sequence of str
        Files below the folder of results, such as ``burst/figures/burst.png``; none is the
        default run.
    folder : Path
        The project: where its Snakefile is.
    config_files : sequence of Path
        Further configuration, as behind ``--configfile``.

    Returns
    -------
    dict of str to int
        Rule -> jobs; the rule ``all``, which does nothing, is left out.

    Raises
    ------
    RuntimeError
        When Snakemake refuses, with its words.
    """
    with tempfile.TemporaryDirectory() as empty:
        results = f"{empty}/results"
        command = [sys.executable, "-m", "snakemake", "--dry-run", "--nolock", "--quiet", "rules"]
        command += ["--cores", "1", *(f"{results}/{target}" for target in targets)]
        if config_files:
            command += ["--configfile", *map(str, config_files)]
        command += ["--config", f"results={results}"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}:\n{done.stderr}{done.stdout}")
    return job_table(done.stdout)


def job_table(output: str) -> dict[str, int]:
    """Read Snakemake's first job table.

    Examples
    --------
    >>> job_table('''Job stats:
    ... job       count
    ... ------  -------
    ... figure        1
    ... all           1
    ... total         2
    ... ''')
    {'figure': 1}
    """
    lines = output.splitlines()
    if "Job stats:" not in lines:
        return {}
    counts = {}
    for line in lines[lines.index("Job stats:") + 3 :]:
        if not line.strip():
            break
        rule, count = line.split()
        counts[rule] = int(count)
    return {rule: count for rule, count in counts.items() if rule not in ("all", "total")}


def jobs_of(
    targets: Mapping[str, Sequence[str]], folder: Path, config_files: Sequence[Path] = ()
) -> dict[str, dict[str, int]]:
    """Count the jobs of several targets: name -> rule -> jobs; see `count_jobs`."""
    return {name: count_jobs(files, folder, config_files) for name, files in targets.items()}
