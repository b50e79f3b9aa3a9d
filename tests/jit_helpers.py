"""What the tests ask of numba."""

from __future__ import annotations

import numba
import pytest


def compiled_return_type(function, *arguments) -> str:
    """The type of what a compiled function returns for arguments of these types.

    Only for these: other tests in the same process may have called it with others. Skips where numba is switched off.
    """
    if not hasattr(function, "overloads"):
        pytest.skip("numba is switched off")
    function(*arguments)
    return str(function.overloads[tuple(map(numba.typeof, arguments))].signature.return_type)
