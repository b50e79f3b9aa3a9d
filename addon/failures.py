"""What the user is told when something goes wrong: one line that says what, and what to do."""

from __future__ import annotations

import errno
import traceback
from typing import TextIO

from bpy.app.translations import pgettext_rpt as rpt_

from ._core import core

#: Of a disk, of what a user may have of it, and of a file.
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def failure_text(error: Exception, err: TextIO | None = None) -> str:
    """The line for an exception. The traceback of a bug goes to `err`, by default to stderr."""
    if isinstance(error, core.errors.RooksError):
        return str(error)
    if isinstance(error, ImportError):
        return rpt_(
            "Rooks is not installed completely, or for another Python ({error}): remove it in the preferences, "
            "restart Blender, and install the zip again"
        ).format(error=error)
    if isinstance(error, OSError) and error.errno in _NO_ROOM:
        return rpt_("the disk is full ({error}): make room, or set ROOKS_CACHE_DIR to a folder that has some").format(
            error=error
        )
    if isinstance(error, MemoryError):
        return rpt_("there is not enough memory for this scene and these settings")
    traceback.print_exception(error, file=err)
    return rpt_("internal error: {error}").format(error=f"{type(error).__name__}: {error}").splitlines()[0]
