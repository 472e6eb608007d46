"""From a real MJCF file as it lies to a robot that runs: drives, platform, first guess, a small motion."""
