"""What runs as the first process of a room: a copy of this machine that is thrown away, and a grading in it."""
