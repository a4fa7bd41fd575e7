"""Many submissions at once: from a roster to a gradebook, on one machine or a cluster; compared, reviewed."""
