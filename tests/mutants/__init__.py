"""Mutation of the core modules: small faults planted one at a time, to see whether a test notices (docs/mutants.md)."""
