"""A worker on a machine without the grader."""

import sys


class _Hidden:
    def find_spec(self, name, path=None, target=None):
        del path, target
        if name.split(".")[0] == "grader":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


sys.meta_path.insert(0, _Hidden())
