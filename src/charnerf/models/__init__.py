"""The networks: encoder E, f1, combinator H, f2, heads; learning is modules."""
