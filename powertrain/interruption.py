"""Ctrl-C while CasADi works."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def interruptible() -> Iterator[None]:
    """A block, or with ``@interruptible()`` a function, that ends with KeyboardInterrupt if Ctrl-C came inside, at its end at the latest.

    CasADi's wrappers discard an exception raised while they convert arguments: what they build goes on, or ends with an error of another
    kind. The handler of Ctrl-C is the present one; if it does not raise KeyboardInterrupt, nothing changes. Python handles signals in the
    main thread; in others nothing changes, either.
    """
    before, interrupted = signal.getsignal(signal.SIGINT), False
    if not callable(before) or threading.current_thread() is not threading.main_thread():
        yield
        return

    def handler(number: int, frame: FrameType | None) -> None:
        nonlocal interrupted
        try:
            before(number, frame)
        except KeyboardInterrupt:
            interrupted = True
            raise

    signal.signal(signal.SIGINT, handler)
    try:
        yield
    except KeyboardInterrupt:
        interrupted = False  # it arrives
        raise
    finally:
        signal.signal(signal.SIGINT, before)
        if interrupted:
            raise KeyboardInterrupt from None
