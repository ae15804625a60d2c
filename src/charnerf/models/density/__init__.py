"""How directions enter: wirings of f1, H and f2."""
