"""Functions that choose their implementation by the class of their first argument.

Models, contact laws and forcings are NamedTuples of constants. The functions that the engine calls
on them are declared with `by_class`; each class implements them in its own file.
"""

from collections.abc import Callable
from functools import wraps
from typing import Any, Protocol, cast

from damper.engine import compiled as compiled_code
from damper.engine.compiled import INNER_OPTIONS, Compiled, compiled, when_numba_loads


class ByClass(Protocol):
    """A function that chooses its implementation by the class of its first argument."""

    def __call__(self, model: Any, *rest: Any) -> Any:
        """Call the implementation for the model's class."""

    def of(self, kind: type) -> Callable[[Callable], Callable]:
        """Decorator of the implementation for one class."""

    def like(self, kind: type, other: type) -> None:
        """Take over for one class the implementation of another."""


def by_class(function: Callable) -> ByClass:
    """Make a function that each class of its first argument implements for itself (a decorator).

    ``@function.of(Model)`` gives the implementation for one class, and
    ``function.like(Model, Other)`` takes over that of another. Classes without one are refused
    with a TypeError. Compiled code chooses while it is compiled, so a run pays nothing for the
    choice, nor for classes that it does not use.
    """
    return _by_class(function, None)


def by_class_or_default(function: Callable) -> ByClass:
    """As `by_class`, but the function itself serves the classes without an implementation.

    For what is true of them all, or costs time alone: a default must not leave out a law.
    """
    return _by_class(function, function)


def _by_class(function: Callable, default: Callable | None) -> ByClass:
    class Choices(dict[type, Callable]):
        def __missing__(self, kind: type) -> Callable:
            if default is None:
                name = f"{function.__module__}.{function.__qualname__}"
                known = ", ".join(sorted(each.__name__ for each in self)) or "none that is loaded"
                raise TypeError(f"{name} is not implemented for {kind.__name__}, only for {known}")
            return default

    chosen = Choices()
    #: The same as plain Python.
    plain = Choices()
    # With the function's own arguments: to pass on `*rest` doubles the time of each choice.
    code = function.__code__
    names = code.co_varnames[: code.co_argcount]
    choose = eval(
        f"lambda {', '.join(names)}: (plain if compiled_code._plain.running else chosen)"
        f"[type({names[0]})]({', '.join(names)})",
        {"plain": plain, "chosen": chosen, "compiled_code": compiled_code},
    )

    def of(kind: type) -> Callable:
        def implement(implementation: Callable) -> Callable:
            known = isinstance(implementation, Compiled)
            chosen[kind] = implementation if known else compiled(implementation)
            plain[kind] = getattr(chosen[kind], "py_func", implementation)
            return chosen[kind]

        return implement

    def like(kind: type, other: type) -> None:
        chosen[kind], plain[kind] = chosen[other], plain[other]

    made = cast(Any, wraps(function)(choose))
    made.like = like
    made.of = of

    def declare() -> None:
        from numba.extending import overload

        def typed(model: Any, *rest: Any) -> Callable:
            return plain[model.instance_class]

        overload(choose, jit_options=INNER_OPTIONS, strict=False)(typed)

    when_numba_loads(declare)
    return made
