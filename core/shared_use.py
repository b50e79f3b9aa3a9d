"""Something that is used by several threads, and given back by the last of them.

Ctrl-C takes the calling thread out of whatever it does, even out of a thread pool that it is just starting: it then
knows of no thread that it could wait for. What the threads use can only be given back by whoever is the last to use it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class SharedUse:
    """Calls `close` once, when the owners have let go and no user is left."""

    def __init__(self, close: Callable[[], None]) -> None:
        self._close = close
        self._users = 1  # the first owner
        self._lock = threading.Lock()

    @contextmanager
    def user(self) -> Iterator[bool]:
        """Use it while the block runs. False: it has been given back, and must not be used."""
        is_open = self.join()
        try:
            yield is_open
        finally:
            if is_open:
                self.let_go()

    def join(self) -> bool:
        """Become one more owner, who lets go once. False: it has been given back, and must not be used."""
        with self._lock:
            is_open = self._users > 0
            self._users += is_open
        return is_open

    def let_go(self) -> None:
        """An owner, once, or a user: it is not used here any more."""
        with self._lock:
            self._users -= 1
            is_last = self._users == 0
        if is_last:
            self._close()
