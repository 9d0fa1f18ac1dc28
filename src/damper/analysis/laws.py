"""Largest violations of the model's laws in a cube, over all runs and by regime.

Regimes are parts of the parameter box where accuracy may degrade. Regimes of the first six
parameters hold runs of the rigid model; every other model has rows of its own. docs/limits.md
explains where accuracy ends.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from damper.analysis.places import require_variables
from damper.observers.common.laws import LAW_NAMES, excess
from damper.parameters.lazy import pd, xr
from damper.parameters.named import damper_of
from damper.parameters.names import split
from damper.parameters.quantities import ALL, DIMENSIONLESS_NAMES, PARAMETER_NAMES
from damper.parameters.tables import beside_numbers
from damper.parameters.variables import STATUS_MEANINGS
from damper.sweep.record import masses_of, setting_of

#: Laws whose violation is a number worth reading; the other one either holds or does not.
GRADED = tuple(name for name in LAW_NAMES if name != "not_finite")


class Regime(NamedTuple):
    """A part of the box: a name, and a condition on a run's quantities."""

    name: str
    condition: str
    """As `pandas.DataFrame.eval` reads it; none for all runs of the model."""
    model: str = "rigid"

    def holds(self, runs: pd.DataFrame) -> pd.Series:
        """Whether each run, a row of `runs_of`, is in the regime."""
        chosen: pd.Series = runs.model == self.model
        return chosen & runs.eval(self.condition) if self.condition else chosen


REGIMES = (
    Regime(
        "ordinary",
        "1e-3 <= damping_ratio <= 1 and 0.1 <= frequency_ratio <= 10"
        " and 1e-3 <= mass_ratio <= 10 and 1e-3 <= clearance <= 10",
    ),
    Regime("slow forcing", "frequency_ratio <= 1e-3"),
    Regime("fast forcing", "frequency_ratio >= 1e3"),
    Regime("undamped", "damping_ratio <= 1e-12"),
    Regime("undamped resonance", "damping_ratio <= 1e-12 and abs(frequency_ratio - 1) <= 1.1e-9"),
    Regime("critical damping", "abs(damping_ratio - 1) <= 1.1e-12"),
    Regime("heavy damping", "damping_ratio >= 10"),
    Regime("tiny mass", "mass_ratio <= 1e-6"),
    Regime("heavy free mass", "mass_ratio >= 1e3"),
    Regime("nearly elastic", "restitution >= 0.999"),
    Regime("plastic", "restitution <= 1e-6"),
    Regime("tiny clearance", "0 < clearance <= 1e-6"),
    Regime("large clearance", "clearance >= 1e3"),
    Regime("grazing start", "initial_displacement == -1 and 0 < initial_relative_velocity < 1e-3"),
    Regime("long runs", "periods >= 100000"),
    Regime("grounded", "", "grounded"),
    Regime(
        "fast support",
        "support_damping == 0 and support_stiffness_ratio >= 1e6 * mass_ratio",
        "grounded",
    ),
    Regime("heavily damped support", "support_damping >= 100 * mass_ratio", "grounded"),
    Regime("time-varying", "", "time_varying"),
    Regime("several masses", "", "several"),
    Regime("compliant", "", "compliant"),
    Regime("stiff contact", "contact_stiffness_ratio >= 1e8", "compliant"),
)


class Row(NamedTuple):
    """Runs of one regime: how they ended, the worst value of each law, and the worst run."""

    regime: Regime
    outcomes: list[int]
    """Counts in the order of `damper.parameters.variables.STATUS_MEANINGS`."""
    worst: pd.Series
    """Of each law; NaN where there is nothing to violate."""
    nearest: pd.Series
    """The same over its limit."""
    broken: int
    """Runs that break a law."""
    law: str
    point: dict[str, float]
    """Law nearest to its limit, or farthest beyond, and where."""

    @property
    def runs(self) -> int:
        """All runs of the regime."""
        return sum(self.outcomes)

    @property
    def stopped(self) -> int:
        """Runs that did not finish."""
        return sum(self.outcomes[1:])


def excesses(cube: xr.Dataset) -> pd.DataFrame:
    """Each law's violation over its limit, run by run; NaN where there is nothing to violate."""
    return _excesses(records_of(cube))


def regimes(cube: xr.Dataset) -> list[Row]:
    """Return a row for all runs, then a row for each regime with runs.

    Parameters
    ----------
    cube : xarray.Dataset
        Dimensionless, with the variables of the observer ``laws``.
    """
    runs = runs_of(cube)
    far = _excesses(runs)
    chosen = [(Regime("all", "every run"), runs.status.notna())]
    chosen += [(regime, regime.holds(runs)) for regime in REGIMES]
    return [_row(regime, runs[some], far[some]) for regime, some in chosen if some.any()]


def runs_of(cube: xr.Dataset) -> pd.DataFrame:
    """Every run of a cube, a row: laws, status, all quantities, the model, and the periods."""
    runs, periods = records_of(cube), setting_of(cube, "periods")
    if isinstance(periods, dict):
        time = periods["time"]
        raise ValueError(f"laws: the window is a time {time}: regimes need its length in cycles")
    defaults = {n: ALL[n].default for n in DIMENSIONLESS_NAMES if n not in runs}
    runs = runs.assign(**defaults, periods=periods)
    names = [*PARAMETER_NAMES, *filter(split, runs)]
    others = beside_numbers(**masses_of(cube))
    dampers: list[Any] = [
        damper_of({n: v for n, v in values.items() if v is not None} | others)
        for values in runs[names].to_dict("records")
    ]
    return runs.assign(
        model=[damper.main_feature for damper in dampers],
        support_damping=[damper.support_damping_ratio for damper in dampers],
    )


def records_of(cube: xr.Dataset) -> pd.DataFrame:
    """Every run of a cube, a row in the order of `runs_of`: laws, status, and its coordinates."""
    require_variables(cube, *LAW_NAMES, "segments")
    found = cube[[*LAW_NAMES, "segments", "status"]]
    return found.expand_dims("run").to_dataframe().reset_index()


def _excesses(runs: pd.DataFrame) -> pd.DataFrame:
    return pd.DataFrame({n: excess(n, runs[n].values, runs.segments.values) for n in LAW_NAMES})


def _row(regime: Regime, runs: pd.DataFrame, far: pd.DataFrame) -> Row:
    run, law = far.fillna(-1.0).stack().idxmax()
    values = runs.loc[run, [*DIMENSIONLESS_NAMES, *filter(split, runs)]].to_dict()
    return Row(
        regime,
        [int((runs.status == code).sum()) for code in range(len(STATUS_MEANINGS))],
        runs[list(LAW_NAMES)].max(),
        far.max(),
        int((far > 1.0).any(axis=1).sum()),
        law,
        {name: value for name, value in values.items() if value != ALL[name].default},
    )
