"""Random changes of training batches, one class and one option each, and their sequence."""
