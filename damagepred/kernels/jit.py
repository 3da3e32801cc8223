"""The one place where kernels are compiled: one decorator, one set of flags, one cache.

numba keys its cache on the file of the function alone, so an edit to a law in another file goes unnoticed and the
old machine code answers. The cache folder's name therefore holds a hash of all kernel sources.
"""

from __future__ import annotations

import gc
import uuid
from functools import cached_property

import numba
from numba import config
from numba.core import types
from numba.core.ccallback import CFunc
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.extending import register_jitable

from damagepred.kernels.cache_folder import cache_folder
from damagepred.version import kernel_hash

CACHE_FOLDER = cache_folder(f"kernels-{kernel_hash()}")
"""None: every process compiles anew."""

FLAGS = {"nogil": True, "fastmath": False, "error_model": "numpy", "boundscheck": False, "no_cfunc_wrapper": True}
"""Without the interpreter lock, IEEE arithmetic (no fastmath: NaN must be seen), and nothing compiled for C."""
UNCOUNTED = {**FLAGS, "_nrt": False}
"""Also without counting who refers to an array: for a tuple of 15 arrays handed to a law that branches, the counts of
all of them go up and down, and that took three quarters of the time of a joint. What is compiled so cannot make
arrays, and a law may not return one."""
STACK = 65536
"""Entries of a deep stack, 0.5 MB. Its chunk is the next power of two; the rest of it is room for the calls."""


def _with_deep_stack(function):
    """Give the frame of a function a large stack, so that there is room for the frames of all calls inside it.

    CPython allocates frames in chunks of 16 kB. Where calls in a loop cross the end of a chunk, as those of numba do,
    every call allocates one and frees it again.
    """
    function.__code__ = function.__code__.replace(co_stacksize=STACK)
    return function


class _Flags(Flags):
    """Flags that are compared as they are stored: numba does so thousands of times for each kernel."""

    def __hash__(self):
        """Of their number, the same for nearly all, as numba's is of their names."""
        return len(self._values)

    def __eq__(self, other):
        """Whether the same are set, to the same values."""
        return isinstance(other, _Flags) and self._values == other._values


class _Compiler(Compiler):
    """Compiler that makes many objects, and collects no garbage meanwhile: they all stay."""

    @_with_deep_stack
    def compile_extra(self, func):
        """Compile a function."""
        self.state.flags = _Flags(self.state.flags)
        collects = gc.isenabled()
        gc.disable()
        try:
            return super().compile_extra(func)
        finally:
            if collects:
                gc.enable()


class _UnitLibrary(JITCodeLibrary):
    """Code of a unit: LLVM's passes run once, over all that is linked together. Zones' kernels need them twice."""

    def _optimize_functions(self, ll_module):
        """Leave functions to the passes over the whole."""
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self):
        """Run the passes over the whole."""
        passes = self._codegen._module_pass_manager()
        if isinstance(passes, tuple):  # and what builds them, in newer versions of numba
            passes[0].run(self._final_module, passes[1])
        else:
            passes.run(self._final_module)


class _UnitCompiler(_Compiler):
    """Compiler of units."""

    def compile_extra(self, func):
        """Compile a unit."""
        self.state.library = _UnitLibrary(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(func)


class _LawLibrary(JITCodeLibrary):
    """Code of a law: linked into the kernels that call it, and optimised with them."""

    def _optimize_final_module(self):
        """Leave that to the kernels."""

    def _finalize_final_module(self):
        """Make no machine code."""
        self._finalized = True


class _LawCompiler(Compiler):
    """Compiler of laws, while a kernel that calls them is compiled: they have no machine code of their own."""

    def compile_extra(self, func):
        """Compile a law."""
        state = self.state
        state.flags, state.library = _Flags(state.flags), _LawLibrary(state.targetctx.codegen(), func.__qualname__)
        state.flags.no_compile = True
        compiled = super().compile_extra(func)
        known_by = [].append  # numba knows a law by a function in C, whichever it is
        state.targetctx.insert_user_function(known_by, compiled.fndesc, [state.library])
        return compiled._replace(entry_point=known_by)


def _compiled(function, flags):
    before, config.CACHE_DIR = config.CACHE_DIR, str(CACHE_FOLDER or "")
    try:
        compiled = numba.njit(cache=CACHE_FOLDER is not None, pipeline_class=_Compiler, **flags)(function)
    finally:
        config.CACHE_DIR = before  # other users of numba in this process keep theirs
    _own_names(compiled)
    return compiled


class Unit:
    """A kernel that other kernels call by its address, with the address of a table.

    A kernel called by its name is compiled again with each that calls it; a unit is compiled once.

    Parameters
    ----------
    function : callable
        Of the address of a table; its results are entries of the table.
    """

    def __init__(self, function):
        self.function, self.name = function, function.__name__

    @cached_property
    def _compiled(self):
        flags = {name: value for name, value in UNCOUNTED.items() if name != "no_cfunc_wrapper"}
        compiled = CFunc(self.function, ((types.intp,), types.void), {}, flags, pipeline_class=_UnitCompiler)
        before, config.CACHE_DIR = config.CACHE_DIR, str(CACHE_FOLDER or "")
        try:
            if CACHE_FOLDER is not None:
                compiled.enable_caching()
                _own_names(compiled)
            compiled.compile()
        finally:
            config.CACHE_DIR = before
        return compiled

    @property
    def address(self):
        """Address of the machine code, which is made at the first call."""
        return self._compiled.address

    def __call__(self, table):
        """Run from Python.

        Parameters
        ----------
        table : int
            Address of the table.
        """
        self._compiled.ctypes(table)


def kernel(function):
    """Compile ``function``, cached: it fills arrays that it is given, and makes none."""
    return _compiled(function, UNCOUNTED)


def kernel_making_arrays(function):
    """Compile ``function``, cached: it may make arrays of its own, and return them."""
    return _compiled(function, FLAGS)


def _own_names(compiled):
    """Name what this process keeps of a kernel as no other process does.

    numba counts 1, 2, ...: of two processes that compile at the same time one kernel for different arguments, both may
    take the same number, and one of them would then load the machine code of the other.
    """
    file = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if (pattern := getattr(file, "_data_name_pattern", None)) is not None:
        file._data_name_pattern = pattern.replace("{number:d}", f"{{number:d}}-{uuid.uuid4().hex[:12]}")


def law(function):
    """Compile a law that kernels call: always inlined, as only then it can work on many contacts at a time.

    In Python it is the function that it was. Code for calls from Python would take as long to compile as the law.
    """
    return register_jitable(forceinline=True, pipeline_class=_LawCompiler, **UNCOUNTED)(function)


def rule(function):
    """Compile a law that is too long to be put wherever it is called: compiled once, called from many kernels."""
    return register_jitable(pipeline_class=_LawCompiler, **UNCOUNTED)(function)
