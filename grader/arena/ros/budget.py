"""How many messages and bytes of a run are recorded, and of which channel: nobody's flood takes what is another's."""

import threading

MESSAGE_BYTES = 150
"""What a message takes beside its own bytes, in the evidence and where it is judged."""


class Budget:
    """`limits` holds `channel_messages`, `channel_bytes`, `run_bytes` and `channels`.

    A quarter of the run's bytes is set apart, the same for each channel that there may be. Of the rest a channel takes
    no more than a part that gets smaller with every other one that needs more than was set apart for it; of the
    channels a process has at most half of what is left.
    """

    def __init__(self, limits):
        self.channel_messages = limits["channel_messages"]
        self.channel_bytes = limits["channel_bytes"]
        self.run_bytes = limits.get("run_bytes", 64 << 20)
        self.channels_max = limits.get("channels", 300)
        self.own_share = self.run_bytes // 4 // self.channels_max
        self._shared_left = self.run_bytes - self.run_bytes // 4
        self._channels = {}
        self._heavy = set()
        self._of_process = {}
        self._lock = threading.Lock()

    def open(self, key, process):
        """The account of a channel, made anew where there is room for one more; else None. `key` is all that makes it
        what it is, its definition too."""
        with self._lock:
            if key not in self._channels:
                held = self._of_process.get(process, 0)
                others = len(self._channels) - held
                size = sum(map(len, key))
                if held >= (self.channels_max - others + 1) // 2 or size > self._shared_left:
                    return None
                self._shared_left -= size
                self._of_process[process] = held + 1
                self._channels[key] = Account(self)
            return self._channels[key]

    def take(self, account, size, messages):
        """Whether so many more messages, of so many bytes together, are recorded."""
        size += MESSAGE_BYTES * messages
        with self._lock:
            total = account.messages + messages
            if total > self.channel_messages or account.bytes + size > self.channel_bytes:
                return False
            if account.bytes + size > self.own_share:
                self._heavy.add(account)
                share = self.run_bytes // (len(self._heavy) + 1)
                if size > self._shared_left or account.bytes + size > share:
                    return False
                self._shared_left -= size
            account.bytes += size
            account.messages = total
        return True


class Account:
    """What a channel has used, and the id under which the grader knows it."""

    def __init__(self, budget):
        self.budget = budget
        self.messages = self.bytes = 0
        self.channel = None

    @property
    def heavy(self):
        """Whether it has more than was set apart for it."""
        return self.bytes > self.budget.own_share

    def take(self, size, messages=1):
        return self.budget.take(self, size, messages)
