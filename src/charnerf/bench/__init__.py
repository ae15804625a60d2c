"""Error against run time: one model rendered by every renderer, beside the same network evaluated as pixelNeRF's authors do."""
