"""Which stages see the query direction: f1, H and f2, or none of them and only the colour."""
