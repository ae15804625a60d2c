"""Which views the model conditions on."""
