"""Two runs side by side: what changed in their inputs, and in every error."""
