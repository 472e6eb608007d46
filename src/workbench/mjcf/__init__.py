"""MJCF as text and as MuJoCo compiles it: read safely, edited number by number, prepared for the reference."""
