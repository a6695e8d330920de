"""Machine code for those kernels alone that Python calls, with vectors of four numbers.

Numba optimises each function together with all that it calls, and makes machine code of that. For a kernel that only
kernels call this happens again in each caller, and takes a third of the time in which the loop of a run is compiled. A
loop that is optimised as a whole is not slower. So such kernels are linked as they are.
"""

from typing import Any

from numba.core.codegen import JITCodeLibrary, JITCPUCodegen, ll  # type: ignore[attr-defined]
from numba.core.compiler import Flags
from numba.core.registry import cpu_target
from numba.core.targetconfig import ConfigStack

FROM_PYTHON = "_ZN7cpython"
"""Beginning of the names of functions that take a kernel's arguments from Python."""


VECTORS = '"prefer-vector-width"="256"'
"""An attribute of a function. A chain has some twenty beads. LLVM takes vectors of eight numbers for some processors;
too many beads are then left over, and the loop of a run takes a fifth more time."""


class Kernel(JITCodeLibrary):  # type: ignore[misc]
    """The code of a kernel."""

    def add_ir_module(self, ir_module: Any) -> None:
        """Add code that is not optimised yet."""
        for function in ir_module.functions:
            # llvmlite's own method refuses attributes that have a value.
            set.add(function.attributes, VECTORS)
        super().add_ir_module(ir_module)


class Linked(Kernel):
    """The code of a kernel that only kernels call."""

    def get_pointer_to_function(self, name: str) -> int:
        """Return zero: there is no machine code."""
        self._ensure_finalized()
        return 0

    def serialize_using_object_code(self) -> Any:
        """Return what a file keeps."""
        return self.serialize_using_bitcode()

    def _optimize_final_module(self) -> None:
        """Leave that to the callers."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


class Called(Kernel):
    """The code of a kernel that Python calls. The part that takes its arguments from Python runs once a call, but is
    long, so it is not optimised."""

    def add_ir_module(self, ir_module: Any) -> None:
        """Add code that is not optimised yet."""
        for function in ir_module.functions:
            if function.name.startswith(FROM_PYTHON) and not function.is_declaration:
                function.attributes.add("noinline")
                function.attributes.add("optnone")
        super().add_ir_module(ir_module)


class Codegen(JITCPUCodegen):  # type: ignore[misc]
    """Numba's generator of code for this processor; all other functions get the same code as before."""

    def create_library(self, name: str, **options: Any) -> Any:
        """Return a place for the code of the function that is being compiled."""
        flags = ConfigStack.top_or_none()
        if flags is None or flags.nrt or not flags.no_cfunc_wrapper:
            return super().create_library(name, **options)
        return (Linked if flags.no_cpython_wrapper else Called)(self, name, **options)

    def unserialize_library(self, serialized: Any) -> Any:
        """Return code from a file, whichever function is being compiled; Numba itself never keeps bitcode alone."""
        name, kind, content = serialized
        if kind != "bitcode":
            with ConfigStack().enter(Flags()):
                return super().unserialize_library(serialized)
        library = Linked(self, name)
        library._final_module = ll.parse_bitcode(content)
        library._finalize_final_module()
        return library

    def set_env(self, name: str, env: Any) -> None:
        """Put the objects of a function, which errors name, into its machine code, if there is some."""
        if self._engine.get_global_value_address(name):
            super().set_env(name, env)


def link_kernels() -> None:
    """Let this process compile so."""
    cpu_target.target_context.codegen().__class__ = Codegen
