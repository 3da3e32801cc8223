"""The one place where kernels are compiled: one decorator for each kind of function, one set of flags, one cache.

numba keys its cache on the file of the function alone, so an edit to a law in another file goes unnoticed and the
old machine code answers. Its index names the class of each argument, and cannot be read once a class has moved. The
name of the cache folder therefore holds a hash of all rooms with kernels and with classes of their arguments.
"""

from __future__ import annotations

import atexit
import warnings
from collections.abc import Callable
from typing import Any

import numba
import numba.experimental.function_type
from numba import config, types
from numba.extending import register_jitable, typeof_impl

from damagepred.kernels.cache_folder import cache_folder
from damagepred.kernels.process_cache import ProcessCache
from damagepred.kernels.progress import counted
from damagepred.runtime.version import source_hash

ROOMS = ("kernels", "assembly", "solvers")
"""Rooms of the package with kernels, and with the classes of their arguments."""

_shared = cache_folder(f"kernels-{source_hash(*ROOMS)}")
CACHE = None if _shared is None else ProcessCache(_shared)
CACHE_FOLDER = None if CACHE is None else CACHE.folder
"""None: every process compiles again."""
if CACHE is not None:
    atexit.register(CACHE.close)

FLAGS = {"nogil": True, "error_model": "numpy"}
"""Without the interpreter lock; IEEE arithmetic (no fastmath: NaN must be seen)."""


warnings.filterwarnings("ignore", "First-class function type", numba.NumbaExperimentalFeatureWarning)


def _compiled(compiler: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """Compile with the package's cache; other users of numba in this process keep theirs."""
    before, config.CACHE_DIR = config.CACHE_DIR, str(CACHE_FOLDER or "")
    try:
        return compiler(*arguments, cache=CACHE_FOLDER is not None, **FLAGS, **options)
    finally:
        config.CACHE_DIR = before


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls."""
    return counted(_compiled(numba.njit, function, no_cfunc_wrapper=True), function.__module__)


def law(function: Callable[..., Any]) -> Any:
    """Compile a short function of kernels: always inlined, as only then loops over it use vector instructions."""
    return register_jitable(forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **FLAGS)(function)


def rule(function: Callable[..., Any]) -> Any:
    """Compile a function of kernels that is too long to be inlined, once for each kind of arguments."""
    return numba.njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, **FLAGS)(function)


def _c_function(function: Callable[..., Any], signature: Any, **options: Any) -> Any:
    return numba.cfunc(signature, **options)(function)


class Phase(types.WrapperAddressProtocol):  # type: ignore[misc]
    """A function that is compiled and optimised once, and that structures hold as a field (first-class function).

    A kernel called by its name is optimised again within each kernel that calls it.
    """

    def __init__(self, function: Callable[..., Any], signature: Any) -> None:
        self.function, self._signature, self._compiled = function, signature, None
        self.kind = types.FunctionType(signature)
        self.signatures: list[Any] = []
        counted(self, function.__module__)

    def signature(self) -> Any:
        """Types of result and arguments."""
        return self._signature

    def __wrapper_address__(self) -> int:
        """Entry point; compiles at the first call."""
        if self._compiled is None:
            self._compiled = _compiled(_c_function, self.function, signature=self._signature)
            self.signatures.append(self._signature)
        return int(self._compiled.address)

    def __call__(self, *arguments: Any) -> Any:
        """Run with the JIT off; otherwise kernels call the function as the field of a structure."""
        if not config.DISABLE_JIT:
            raise TypeError(f"{self.function.__name__} is called by kernels, as the field of a structure")
        return self.function(*arguments)


@typeof_impl.register(Phase)
def _(function: Phase, _context: Any) -> Any:
    """Type of a function, which numba otherwise makes at each call."""
    return function.kind


def phase(signature: Any) -> Callable[[Callable[..., Any]], Phase]:
    """Compile a function of one signature once; structures hold it, and kernels call it as their field."""
    return lambda function: Phase(function, signature)
