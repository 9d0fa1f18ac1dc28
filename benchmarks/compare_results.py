"""Two folders of results beside each other: cubes variable by variable, claims line by line."""

import csv
from pathlib import Path

import numpy as np
import xarray as xr

#: Differences below this part of a variable's largest size are rounding.
SMALL = 1e-9
#: Chaos moves means (of whole numbers) or quantiles by no more standard deviations than this.
MOVED, QUANTILES = 0.02, (0.05, 0.25, 0.5, 0.75, 0.95)


def cubes(before: Path, after: Path) -> None:
    """Compare every netCDF file of every study."""
    for name in sorted({p.relative_to(f) for f in (before, after) for p in f.glob("*/*.nc")}):
        missing = [str(folder) for folder in (before, after) if not (folder / name).is_file()]
        if missing:
            print(f"{name}: not in {', '.join(missing)}")
            continue
        with xr.open_dataset(before / name) as a, xr.open_dataset(after / name) as b:
            print(f"{name}: {cube(a, b)}")


def cube(a: xr.Dataset, b: xr.Dataset) -> str:
    """How one cube differs, and whether only by chaos."""
    points = a["status"].dims if "status" in a else ()
    lines, most = [], 0.0
    for name in sorted({*a.variables, *b.variables}, key=str):
        x, y = (data.variables.get(name) for data in (a, b))
        shapes = [v is not None and f"{v.dtype.kind} {dict(v.sizes)}" for v in (x, y)]
        if shapes[0] != shapes[1]:
            text, moved = f"{shapes[0] or 'missing'} -> {shapes[1] or 'missing'}", np.inf
        elif x.dtype.kind in "biuf":
            text, moved = numbers(x, y, points)
        else:
            text, moved = ("", 0.0) if np.array_equal(x.values, y.values) else ("differs", np.inf)
        lines += [f"\n  {name}: {text}"] if text else []
        most = max(most, moved)
    verdict = "STATISTICS DIFFER" if most > MOVED else "same outside of chaos"
    verdict = "OTHER VARIABLES, SHAPES OR WORDS" if most == np.inf else verdict
    verdict = verdict if most > 0.0 else f"same to {SMALL:g}" if lines else "identical"
    return f"{verdict}; {len(lines)} of {len(a.variables)} variables differ{''.join(lines)}"


def numbers(a: xr.Variable, b: xr.Variable, points: tuple) -> tuple[str, float]:
    """How a variable differs, and how far its statistics move (not at all by rounding)."""
    x, y = a.values.astype(float), b.values.astype(float)
    differs = ~((x == y) | (np.isnan(x) & np.isnan(y)))
    if not differs.any():
        return "", 0.0
    apart = np.where(differs, np.abs(x - y), 0.0)
    largest = np.nanmax(np.abs(x), initial=0.0)
    large = ~(apart <= SMALL * largest)  # also where only one is a number
    axes = tuple(k for k, name in enumerate(a.dims) if name not in points)
    parts = [f"{100 * marks.any(axis=axes).mean():.3g} %" for marks in (differs, large)]
    text = (
        f"{parts[0]} of points differ, {parts[1]} by more than {SMALL:g} of {largest:.3g}, at most "
        f"by {np.nanmax(apart):.2g}; not a number {np.isnan(x).sum()} -> {np.isnan(y).sum()}"
    )
    if not large.any():
        return text, 0.0
    whole = a.dtype.kind in "biu"
    p, q = ([np.nanmean(v)] if whole else np.nanquantile(v, QUANTILES) for v in (x, y))
    moved = float(np.max(np.abs(np.subtract(p, q))) / (np.nanstd(x) or SMALL * largest or 1.0))
    words = [" ".join(f"{value:.4g}" for value in side) for side in (p, q)]
    text += f"; {'mean' if whole else 'quantiles'} {words[0]} -> {words[1]}"
    return f"{text}, moved by {moved:.2g} standard deviations", moved


def claims(before: Path, after: Path) -> None:
    """Compare the verdicts on the papers' statements."""
    files = [(folder / "claims.csv").read_text(encoding="utf-8") for folder in (before, after)]
    old, new = ({r["claim"]: r["verdict"] for r in csv.DictReader(f.splitlines())} for f in files)
    for claim in sorted({*old, *new}):
        if old.get(claim) != new.get(claim):
            print(f"{claim}: {old.get(claim)} -> {new.get(claim)}")
    same = "the same" if files[0] == files[1] else "not the same"
    print(f"{len(old)} -> {len(new)} claims; the files are {same}")
