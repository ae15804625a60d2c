"""What tests are built from: figures, drawings, models and runs small enough for a test."""
