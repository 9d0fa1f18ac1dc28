"""Arrays that compiled code need not count references to, because someone else keeps them.

Each function that compiled code calls counts two references to each array in its arguments, some
5 ns each: of a model with arrays that was three quarters of the time of an event.
"""

from typing import TypeVar

from damper.engine.compiled import when_numba_loads

T = TypeVar("T")


def lent(owned: T) -> T:
    """Return an array, or a tuple with all arrays in it, without counting references.

    For arguments of the function that calls this: its caller keeps them until it returns. What is
    lent must neither be returned nor outlive them.
    """
    return owned


def _declare() -> None:
    from numba.core import cgutils, types
    from numba.core.imputils import impl_ret_borrowed
    from numba.extending import lower_builtin, type_callable
    from numba.np.arrayobj import make_array

    @type_callable(lent)
    def _type_of(context):
        return lambda owned: owned

    def without_owner(context, builder, kind, value):
        if isinstance(kind, types.Array):
            array = make_array(kind)(context, builder, value)
            array.meminfo = cgutils.get_null_value(array.meminfo.type)
            array.parent = cgutils.get_null_value(array.parent.type)
            return array._getvalue()
        if isinstance(kind, types.BaseTuple):
            parts = [
                without_owner(context, builder, part, builder.extract_value(value, i))
                for i, part in enumerate(kind)
            ]
            return context.make_tuple(builder, kind, parts)
        return value

    @lower_builtin(lent, types.Any)
    def _lower(context, builder, signature, arguments):
        value = without_owner(context, builder, signature.args[0], arguments[0])
        return impl_ret_borrowed(context, builder, signature.return_type, value)


when_numba_loads(_declare)
