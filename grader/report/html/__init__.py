"""The student's report as one HTML page, and the look that all pages share."""
