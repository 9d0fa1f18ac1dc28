"""The command `damper`: events of one damper, studies and results checked, begun and opened."""

import importlib.util
import os
import subprocess
import sys
import warnings
import webbrowser
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

import damper
from damper.parameters import Parameters, SIParameters
from damper.parameters.files import path_of
from damper.parameters.lazy import pd
from damper.parameters.quantity import QuantityClass
from damper.parameters.tables import TABLE_OF
from damper.parameters.unit_text import number_in, split_unit
from damper.parameters.units import SI_UNITS, SPEED, TIME
from damper.sweep.events import KINDS

TEMPLATE = Path("config/studies/template.yaml")


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(damper.__version__)
def main() -> None:
    """Exact event-driven dynamics of impact dampers, and studies of them.

    \b
    damper events --mass-ratio 0.1 --damping-ratio 0.05 --frequency-ratio 0.2 \\
                  --clearance 0.25 --restitution 0.6 --until 60
    damper design machine.yaml
    damper identify decay.csv --free r,d --machine frame.yaml
    damper fmu machine.yaml
    damper new my_study
    damper check my_study
    """
    click.get_current_context().with_resource(warnings.catch_warnings())
    warnings.showwarning = lambda text, *_: click.echo(f"! {text}", err=True)


class _Number(click.ParamType):
    """A number, text with a unit, such as 20mm, or a word of the quantity, such as left."""

    name = "number"

    def __init__(self, units: str, words: Iterable[tuple[str, float]] = ()) -> None:
        self.units, self.words = units, dict(words)

    def convert(self, value: Any, param: Any, ctx: Any) -> float:
        """Return the number in the unit of the quantity."""
        if value in self.words:
            return self.words[value]
        try:
            return float(number_in(param.name, value, [self.units]))
        except ValueError as error:
            text = str(error)
            self.fail(text if "=" in text else f"{value!r} is no number", param, ctx)


def _quantities(kind: type[QuantityClass]) -> Callable[[Any], Any]:
    """Give a command an option for each quantity (a decorator)."""

    def decorate(command: Any) -> Any:
        for name, table in reversed(TABLE_OF.items()):
            option = click.option(
                "--" + table.replace("_", "-"),
                table,
                type=(_Number(SPEED if kind is Parameters else SI_UNITS[SPEED]), _Number("1")),
                multiple=True,
                help=f"Approach speed and {name} there, in place of {name}; once for each row.",
            )
            command = option(command)
        for quantity in reversed(kind.quantities):
            option = click.option(
                "--" + quantity.name.replace("_", "-"),
                quantity.name,
                type=_Number(quantity.units, quantity.words),
                required=quantity.default is None and not quantity.unless,
                help=quantity.about,
            )
            command = option(command)
        return command

    return decorate


EVENTS = """List the events of one damper in {unit}.

It starts from rest, with the free mass in the centre. Printed are time, kind ({kinds}),
side (-1 left wall, 1 right wall), approach speed, and the primary's displacement x and
velocity v. With --csv they go into a file, with --plot the motion is drawn instead.

\b
{example}"""


@contextmanager
def _in_words() -> Iterator[None]:
    """Say an error of the user's in one message."""
    try:
        yield
    except Exception as error:
        from damper.study.yaml_file import ConfigError, words_of

        if isinstance(error, ValueError | TypeError | OSError | ConfigError):
            raise click.ClickException(words_of(error)) from None
        raise


def _events_command(name: str, kind: Any, unit: str, time: str, example: str) -> None:
    """Add a command that prints the events of a damper."""

    text = EVENTS.format(unit=unit, kinds=", ".join(KINDS), example=example)

    @main.command(name, help=text)
    @_quantities(kind)
    @click.option(
        "--until", type=_Number(time), required=True, help=f"Time to which it runs, in {time}."
    )
    @click.option("--csv", type=click.Path(dir_okay=False), help="Write all events here.")
    @click.option("--plot", type=click.Path(dir_okay=False), help="Draw the motion into this file.")
    def command(until: float, csv: str | None, plot: str | None, **values: Any) -> None:
        with _in_words():
            parameters = kind(**{k: v for k, v in values.items() if v not in (None, ())})
            _show(parameters, until, csv, plot)


_events_command(
    "events",
    Parameters,
    "dimensionless numbers",
    TIME,
    """damper events --mass-ratio 0.1 --damping-ratio 0.05 --frequency-ratio 0.2 \\
              --clearance 0.25 --restitution 0.6 --until 60""",
)
_events_command(
    "events-si",
    SIParameters,
    "SI units",
    "s",
    """damper events-si --primary-mass 100 --damping 800 --stiffness 4e6 --free-mass 10 \\
                 --force-amplitude 200 --forcing-frequency 200 --gap 1e-3 \\
                 --restitution 0.3 --until 0.5""",
)


def _show(parameters: Any, until: float, csv: str | None, plot: str | None) -> None:
    table = pd.DataFrame(damper.events(parameters, until=until))
    table["kind"] = [KINDS[kind] for kind in table["kind"]]
    if csv:
        table.to_csv(csv, index=False)
    if plot:
        damper.run(parameters, until).plot().savefig(plot, dpi=150)
    if not (csv or plot or len(table)):
        click.echo(f"No event until {until:g}.")
    elif not (csv or plot):
        click.echo(table.drop(columns=["cycle", "time_in_cycle"]).to_string(index=False))


@main.command()
@click.argument("files", nargs=-1, required=True, type=click.Path())
def check(files: tuple[str, ...]) -> None:
    """Check study FILES, or studies by name, and estimate what they take.

    For each: whether it is valid, its slices, points, runs and impacts, and rough upper
    figures of time, memory and disk. Nothing is made.

    \b
    damper check config/studies/my_study.yaml restitution
    """
    from damper.study.check import main as check_files

    raise SystemExit(check_files(files))


class _DesignCommand(click.Command):
    """Its options are the settings of a machine, which are read only where they are needed."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Return the file, --quick and --output, and an option for each setting."""
        from damper.sizing.machine import SETTINGS, Machine

        made: list[click.Parameter] = super().get_params(ctx)
        for name, setting in Machine.model_fields.items():
            if name == "materials":  # names and values: for the file alone
                continue
            units = [
                note.text for note in setting.metadata if getattr(note, "keyword", "") == "unit"
            ]
            file = name.endswith("_record")
            limits = SETTINGS[name].limits if name in SETTINGS else ""
            notes = ", ".join(filter(None, [*units, limits]))
            option = click.Option(
                ["--" + name.replace("_", "-"), name],
                nargs=2 if name in ("band", "restitution_range") else 1,
                metavar="FILE" if file else None,
                help=f"{setting.description}" + f" [{notes}]" * bool(notes),
            )
            made.insert(-1, option)
        return made


@main.command("design", cls=_DesignCommand)
@click.argument("machine", required=False, type=click.Path())
@click.option("--quick", is_flag=True, help="By the closed forms alone, without runs.")
@click.option(
    "--output", type=click.Path(), metavar="DIRECTORY", help="Write page and studies here."
)
def size(machine: str | None, quick: bool, output: str | None, **given: Any) -> None:
    """Size the damper of MACHINE for the worst case.

    MACHINE is a YAML file; options override what it says. All is in SI
    units, and frequencies are in Hz. With --output a page, its figures and the studies behind all
    numbers are written.

    \b
    damper design machine.yaml --restitution 0.5 --output machine
    damper design --mass 100 --natural-frequency 31.8 --damping-ratio 0.02 \\
                  --force-amplitude 200 --band 28 36 --restitution 0.3 \\
                  --largest-mass 10 --largest-gap 5e-3 --quick
    """
    from damper.sizing.answer import design, machine_from, opening
    from damper.sizing.page import prepare
    from damper.sizing.structures import structure_machine

    over = {k: v for k, v in given.items() if v is not None}
    with _in_words():
        asked = structure_machine(machine, over) or machine_from(machine, over)
        folder = None if output is None else Path(path_of(output, "output", "folder"))
        older = prepare(folder, [machine, *asked.records]) if folder else []
        first = opening(asked, quick)
        click.echo(first)  # before the search, which takes its time
        found = design(asked, quick=quick)
        click.echo(repr(found).removeprefix(f"{first}\n"))
        if folder:
            found.save(folder)
    if folder:
        click.echo(f"Page: {folder / 'design.html'}")
    if older:
        click.echo(f"Replaced files of an older page: {', '.join(path.name for path in older)}")


@main.command()
@click.argument("machine", type=click.Path())
@click.option("--output", type=click.Path(), metavar="FILE", help="Instead of MACHINE.fmu.")
@click.option("--free-mass", type=_Number("kg"), help="Of the damper, in kg.")
@click.option("--gap", type=_Number("m"), help="Its whole travel, in m.")
@click.option("--restitution", type=_Number("1"), help="Rebound over approach speed.")
def fmu(machine: str, output: str | None, **given: float | None) -> None:
    """Make an FMU of MACHINE with its damper.

    MACHINE is a YAML file as for `damper design`. Without an option the closed forms give the size.
    The FMU is for co-simulation by FMI 3: force or acceleration of the base in,
    motion and impulse out. The machine that imports it needs Python and this package.

    \b
    damper fmu machine.yaml --free-mass 10kg --gap 1mm --output machine.fmu
    """
    from damper.fmu.build import NEEDS, build_fmu
    from damper.fmu.stepped import PARAMETERS

    path = Path(output or Path(machine).with_suffix(".fmu").name)
    with _in_words():
        sizes = {name: value for name, value in given.items() if value is not None}
        drive, begin = build_fmu(machine, path, sizes)
    for name, value in begin.items():
        click.echo(f"{name:<21}{value:g} {PARAMETERS[name].units}".rstrip())
    click.echo(f"FMU: {path}, driven by {drive}; the machine that imports it needs {NEEDS}")


def _pairs(option: str, given: tuple[str, ...]) -> dict[str, Any]:
    """Values of NAME=VALUE, or of NAME=LOW:HIGH, by name."""
    found: dict[str, Any] = {}
    for text in given:
        name, _, value = text.partition("=")
        try:
            numbers = [part if split_unit(part) else float(part) for part in value.split(":")]
        except ValueError:
            numbers = []
        if len(numbers) != (2 if option == "--range" else 1):
            form = "NAME=LOW:HIGH" if option == "--range" else "NAME=VALUE"
            raise click.ClickException(f"{option} {text}: must be {form}")
        found[name] = numbers if option == "--range" else numbers[0]
    return found


@main.command()
@click.argument("records", nargs=-1, type=click.Path())
@click.option("--free", required=True, help="Names of the unknowns, with commas between them.")
@click.option("--machine", type=click.Path(), help="YAML file with what is known.")
@click.option(
    "--kind",
    default="displacement",
    show_default=True,
    help="What the records are: displacement, velocity, acceleration, peaks, impacts, intervals.",
)
@click.option("--columns", help="Columns of time and value, such as t,x or 0,2.")
@click.option("--delimiter", help="What stands between columns.")
@click.option("--step", type=_Number("s"), help="Time between samples, of values alone. [s]")
@click.option("--factor", type=float, help="By what values are multiplied, for their unit.")
@click.option("--known", multiple=True, metavar="NAME=VALUE", help="A quantity that is known.")
@click.option("--start", multiple=True, metavar="NAME=VALUE", help="Where an unknown starts.")
@click.option("--range", "span", multiple=True, metavar="NAME=LOW:HIGH", help="An unknown's range.")
@click.option("--output", type=click.Path(), metavar="DIRECTORY", help="Write the page here.")
def identify(
    records: tuple[str, ...],
    free: str,
    machine: str | None,
    kind: str,
    known: tuple[str, ...],
    start: tuple[str, ...],
    span: tuple[str, ...],
    output: str | None,
    columns: str | None,
    **reading: Any,
) -> None:
    """Find unknown quantities of a damper in RECORDS of it.

    RECORDS are CSV, MATLAB, WAV or UFF files of one kind; others, and what is known of each, stand
    in the machine's file under `records`. With --output a page, its figure, CSV files and studies
    are written.

    \b
    damper identify decay.csv --free r,d,friction --machine frame.yaml
    damper identify clicks.wav --kind impacts --free r,d --machine frame.yaml --output found
    """
    from damper.identification.page import FILES
    from damper.parameters.dampers import SI_NAME
    from damper.parameters.names import NAMES_BY_SYMBOL
    from damper.parameters.record_file import columns_of
    from damper.sizing.page import prepare

    with _in_words():
        if output:
            prepare(Path(output), [machine, *records], FILES)
        reading["columns"] = columns_of(columns)
        unknown = [name.strip() for name in free.split(",")]
        usual = [NAMES_BY_SYMBOL.get(name, name) for name in unknown]
        given = _pairs("--known", known)
        for name in given:
            if name in (*unknown, *usual, *map(SI_NAME.get, usual)):
                raise click.ClickException(
                    f"--known {name}: is unknown by --free {free}: must be --start {name}=VALUE "
                    "for a first guess, or left out of one of them"
                )
        found = damper.identify(
            [damper.read_recording(path, kind, **reading) for path in records],
            unknown,
            machine,
            kind=kind,
            starts=_pairs("--start", start),
            ranges=_pairs("--range", span),
            **given,
        )
        click.echo(repr(found))
        if output:
            found.save(output)
            click.echo(f"Page: {Path(output, 'identification.html')}")


@main.command()
@click.argument("name")
def new(name: str) -> None:
    """Begin a study NAME from the template.

    It is a copy of the template, in which every key is explained: `damper new my_study`.
    """
    from damper.study.fields import STEM, STEM_WORDS

    if not STEM.fullmatch(name):
        raise click.ClickException(f"{name!r} cannot be the name of a study: {STEM_WORDS}")
    path = TEMPLATE.with_name(f"{name}.yaml")
    if not TEMPLATE.exists():
        raise click.ClickException(f"no {TEMPLATE} here: this is not the project's folder")
    if path.exists():
        raise click.ClickException(f"{path} exists: choose another name")
    text = TEMPLATE.read_text("utf-8").replace("studies='[template]'", f"studies='[{name}]'")
    path.write_text(text, "utf-8")
    click.echo(f"Edit {path}, and add {name} to the studies in config/config.yaml.")


@main.command(options_metavar="", context_settings={"ignore_unknown_options": True})
@click.argument("options", nargs=-1, type=click.UNPROCESSED)
def verify(options: tuple[str, ...]) -> None:
    """Check all results, or those of studies by name, byte by byte, and make nothing.

    A line for each that is damaged, out of date or missing, and how many are sound; the exit status
    is 1 if one is not. OPTIONS are those of the run, such as `--configfile config/ci.yaml`, and
    names of studies stand where the run has its targets.

    \b
    damper verify
    damper verify restitution border
    """
    if not Path("Snakefile").exists():
        raise click.ClickException("no Snakefile here: this is not the project's folder")
    if not importlib.util.find_spec("snakemake"):
        raise click.ClickException("Snakemake is missing: pip install -e '.[fast,workflow]'")
    from snakemake.cli import get_argument_parser

    names = get_argument_parser().parse_known_args(options)[0].targets
    # The Snakefile knows what each result is to be made of, but not its targets while it is read.
    command = [sys.executable, "-m", "snakemake", "--quiet=all", "--dry-run", *options]
    raise SystemExit(subprocess.call(command, env=os.environ | {"DAMPER_VERIFY": " ".join(names)}))


@main.command()
@click.argument("results", default="results", type=click.Path(path_type=Path))
def view(results: Path) -> None:
    """Open the page of RESULTS in a browser.

    RESULTS is the folder in which `snakemake` made them, by default `results`.
    """
    page = results / "report.html"
    if not page.exists():
        raise click.ClickException(f"no {page}: `snakemake --cores 2` makes it")
    webbrowser.open(page.resolve().as_uri())
