"""The pages, and what writes their figures: `python -m docs`. Not part of the installed package."""
