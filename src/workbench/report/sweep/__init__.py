"""The report of a sweep: what thousands of variants of one case say together, from their stored results."""
