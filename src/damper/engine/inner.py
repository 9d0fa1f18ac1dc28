"""How numba compiles what only compiled code calls: to code that becomes a part of its caller.

numba makes machine code of each function on its own as well, which nobody would call: a fifth of
the time that compiling takes. Loaded with numba only.

The classes below are private to numba. Other versions of it may have others, or none.
"""

from typing import Any

import numba
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class _NoEnvironment:
    @staticmethod
    def set_env(*_: Any) -> None:
        """Do nothing: no function here asks for Python objects, nor has it one when loaded."""


class _PartOfCallers(JITCodeLibrary):
    """Code to link with that of callers, where machine code is made of it."""

    codegen = _NoEnvironment
    is_apart = False
    """Whether it stays a function that callers share, or has such functions."""

    def _optimize_final_module(self) -> None:
        parts = self._linking_libraries
        self.is_apart = self.is_apart or any(getattr(part, "is_apart", False) for part in parts)
        if not self.is_apart:
            super()._optimize_final_module()
            return
        # All functions that are linked here would be optimised again in each caller: that was half
        # of the time. Inlining is enough, up to where machine code is made.
        passes, builder = self._codegen._module_pass_manager(
            loop_vectorize=False, slp_vectorize=False, opt=0, cost="cheap"
        )
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """No address: there is no machine code."""
        self._ensure_finalized()
        return 0


class InnerCompiler(Compiler):
    """numba's own compiler, but for the machine code."""

    def define_pipelines(self) -> Any:
        """As for every function, with another place for its code."""
        state = self.state
        if state.library is None:
            state.library = _PartOfCallers(state.targetctx.codegen(), state.func_id.func_qualname)
            state.library.is_apart = not state.flags.forceinline
        return super().define_pipelines()


#: Version of numba that the tests run with.
_TESTED = (0, 68)


def tried_compiler(options: dict[str, Any]) -> type[Compiler]:
    """Return `InnerCompiler`; of another version of numba after a trial, which raises if it fails.

    A trial takes some .3 s. `options` are those of an inner function.
    """
    if numba.version_info.short != _TESTED:
        # A function that callers share runs the whole of this module.
        apart = options | {"forceinline": False}
        part = numba.njit(pipeline_class=InnerCompiler, **apart)(_double)
        if numba.njit(lambda x: part(x))(1.5) != 3.0:
            raise RuntimeError("numba compiles a part of a function to something else")
    return InnerCompiler


def _double(x):
    return 2.0 * x
