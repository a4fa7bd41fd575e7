#!/bin/sh
# Stands in for a browser (and whatever else opens pages): tells the arena what it was asked for.
exec "${0%/*}/python3" -S -E "${0%/*}/grader-open.py" "${0##*/}" "$@"
