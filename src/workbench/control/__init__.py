"""Control: formulas as models inside controllers, sampled as in life, on a plant that can be believed."""
