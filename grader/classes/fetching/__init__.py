"""How a batch gets one roster entry's source, and which commit of it counts."""
