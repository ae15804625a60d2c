"""Options of f1: what each view makes of a point by itself."""
