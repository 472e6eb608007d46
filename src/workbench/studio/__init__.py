"""``workbench studio``: a local page on which a robot's parameters are moved and everything answers at once."""
