"""A worker that knows the file system `shelf://`, which is no path."""

from tests.classes.cluster.shelf import register

register()
