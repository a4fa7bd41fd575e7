"""One thread that waits for everything: sockets, consoles, commands, children, timers."""

import contextlib
import heapq
import itertools
import os
import selectors
import signal
import threading
import time
from collections import deque


class Loop:
    """`call_soon` may be used from any thread, all else from the loop's own."""

    def __init__(self):
        self._selector = selectors.DefaultSelector()
        self._timers = []
        self._order = itertools.count()
        self._soon = deque()
        self._running = True
        self._child_callbacks = []
        self._thread = threading.get_ident()
        self._wake_r, self._wake_w = os.pipe()
        for fd in (self._wake_r, self._wake_w):
            os.set_blocking(fd, False)
        self.add_reader(self._wake_r, self._drain)
        signal.set_wakeup_fd(self._wake_w, warn_on_full_buffer=False)
        # Without a handler of Python's, the kernel drops the signal and nothing is written to the pipe.
        signal.signal(signal.SIGCHLD, lambda *_: None)

    def add_reader(self, fileobj, callback):
        self._selector.register(fileobj, selectors.EVENT_READ, callback)

    def remove_reader(self, fileobj):
        with contextlib.suppress(KeyError, ValueError):  # already gone
            self._selector.unregister(fileobj)

    def on_child(self, callback):
        """Call the callback whenever a child may have ended."""
        self._child_callbacks.append(callback)

    def call_later(self, delay_s, callback):
        # The number keeps timers of the same moment in order: two functions cannot be compared.
        heapq.heappush(self._timers, (time.monotonic() + delay_s, next(self._order), callback))

    def call_soon(self, callback):
        self._soon.append(callback)
        if threading.get_ident() != self._thread:
            with contextlib.suppress(BlockingIOError):  # a wake-up is already waiting
                os.write(self._wake_w, b"w")

    def stop(self):
        self._running = False

    def run(self):
        while self._running:
            for key, _ in self._selector.select(self._timeout_s()):
                key.data()
            while self._timers and self._timers[0][0] <= time.monotonic():
                heapq.heappop(self._timers)[2]()
            while self._soon:
                self._soon.popleft()()

    def _timeout_s(self):
        if self._soon:
            return 0
        if not self._timers:
            return None
        return max(0.0, self._timers[0][0] - time.monotonic())

    def _drain(self):
        try:
            woken_by = os.read(self._wake_r, 65536)
        except BlockingIOError:
            return
        # A signal writes its number into the pipe, `call_soon` another byte.
        if signal.SIGCHLD in woken_by:
            for callback in self._child_callbacks:
                callback()
