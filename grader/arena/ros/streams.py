"""What a process writes: lines for the console, and bytes that it hands over in a file."""

import os

LINE_BYTES_MAX = 4096
READ_BYTES = 65536
PIPE_READS = 16


class Lines:
    """One of a process's two output streams, cut into lines."""

    def __init__(self, process, name, pipe):
        self._process = process
        self._name = name
        self._pipe = pipe
        self._rest = b""
        os.set_blocking(pipe.fileno(), False)
        process.loop.add_reader(pipe, self._readable)

    def _readable(self):
        try:
            chunk = os.read(self._pipe.fileno(), READ_BYTES)
        except BlockingIOError:
            return
        if not chunk:
            if self._rest:
                self._process.line(self._name, self._rest, False)
            self._process.loop.remove_reader(self._pipe)
            self._pipe.close()
            self._process.stream_closed()
            return
        if self._process.printed_too_much:  # read, so that it does not wait for room, and thrown away
            self._rest = b""
            return
        *lines, self._rest = (self._rest + chunk).split(b"\n")
        for line in lines:
            self._line(line)
        if len(self._rest) > LINE_BYTES_MAX:
            self._line(self._rest)
            self._rest = b""

    def _line(self, line):
        cut = len(line) > LINE_BYTES_MAX
        self._process.line(self._name, line[:LINE_BYTES_MAX].rstrip(b"\r"), cut)


class Collected:
    """What a process hands over: a file that is there once the process has ended, and whole or not at all."""

    def __init__(self, process, descriptor, file, bytes):  # noqa: A002 - the spec's own words
        self._process = process
        self._descriptor = descriptor
        self._path = file
        self._limit_bytes = self._left_bytes = bytes
        self._file = open(file + ".part", "wb")  # noqa: SIM115 - stays open until the process has ended
        os.set_blocking(descriptor, False)
        process.loop.add_reader(descriptor, self._readable)

    def _readable(self):
        if not self._read():
            self._end()
            self._process.stream_closed()

    def _read(self):
        """Take a piece; False at the end."""
        try:
            chunk = os.read(self._descriptor, READ_BYTES)
        except BlockingIOError:
            return True
        self._left_bytes -= len(chunk)
        if self._left_bytes >= 0:
            self._file.write(chunk)
        return bool(chunk)

    def close(self):
        """Take what is still in the pipe, and no more."""
        for _ in range(PIPE_READS):
            if self._descriptor is None or not self._read():
                break
        self._end()

    def _end(self):
        if self._descriptor is None:
            return
        self._process.loop.remove_reader(self._descriptor)
        os.close(self._descriptor)
        self._descriptor = None
        self._file.close()
        part = self._path + ".part"
        if self._left_bytes >= 0:
            os.chmod(part, 0o644)
            os.replace(part, self._path)
        else:
            os.unlink(part)
            self._process.too_much_collected(self._limit_bytes)
