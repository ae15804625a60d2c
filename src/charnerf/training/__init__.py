"""Lightning: the module, the callbacks, one run."""
