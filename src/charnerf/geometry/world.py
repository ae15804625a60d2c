"""How a character stands in the world: metres, +Z up, facing -Y, feet on z = 0. Constants alone, quick to import."""

HEIGHT = 2.0  # metres, from the floor to the crown
CENTRE = (0.0, 0.0, 0.5 * HEIGHT)  # which cameras look at
BOX_HALF_EXTENT = 1.8  # metres; half the side of a cube around the centre that holds every character
