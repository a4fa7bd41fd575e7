"""The records that pass from one room to the next: frozen, typed, without any I/O.

Every definition that several rooms need is here once: statuses, results, package facts, rates. Reading, writing and
judging them is the business of other rooms.
"""
