"""Volume rendering: compositing, quadrature, renderers; takes functions, knows no model."""
