"""The records that cross from one station of the data flow to the next. No I/O in here."""
