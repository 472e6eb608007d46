"""The report of a study of control: sections over its stored results."""
