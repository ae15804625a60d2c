"""Error against run time: the baseline, the methods, their references, sweeps, tables, plots."""
