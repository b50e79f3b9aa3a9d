"""numpy, loaded when it is first used: Blender's start reads only the samplers' names, and must not wait for it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
else:

    class _LateNumpy:
        def __getattr__(self, name: str) -> Any:
            import numpy

            return getattr(numpy, name)

    np = _LateNumpy()

__all__ = ["np"]
