"""The submissions of a batch graded by the workers of a Dask cluster; Dask does the scheduling.

Jobs go out as tasks, results come back as files: a worker packs a submission's folder into one file in the exchange,
and the client, which alone writes into the batch's folder, unpacks it into place.
"""
