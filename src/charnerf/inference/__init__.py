"""The library: parts from a config, weights files, a loaded model, an encoded character."""
