"""Sweeps: one case varied into thousands, computed by workers, kept case by case, resumed where a run stopped."""
