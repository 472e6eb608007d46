"""Formulas in other languages: Octave and MATLAB files, C, and any program, each in a process of its own."""
