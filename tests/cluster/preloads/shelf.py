"""A worker that knows the file system `shelf://`, which is no path."""

from tests.cluster.shelf import register

register()
