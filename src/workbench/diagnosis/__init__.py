"""Diagnosis of a formula: which term is wrong, in which joint, through which parameter, and what would mend it."""
