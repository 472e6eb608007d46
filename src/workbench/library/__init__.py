"""The library of robots that comes along: what each is, what was measured of it, and its page in the documentation."""
