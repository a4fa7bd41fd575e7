"""One plain function a command: keyword arguments as parsed, the exit code as its result."""
