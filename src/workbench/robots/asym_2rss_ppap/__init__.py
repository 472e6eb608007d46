"""The asymmetric 2RSS+PPaP pick-and-place robot of [Almeida2010]."""
