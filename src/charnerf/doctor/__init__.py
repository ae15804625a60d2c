"""What is wrong with data sets, drawings and runs: found, shown by a number or a picture, and how it is mended."""
