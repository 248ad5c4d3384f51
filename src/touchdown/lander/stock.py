"""Stock's numbers, in pixels unless they say otherwise: drawing needs them, but no Box2D."""

SCALE = 30.0  # pixels a metre
VIEWPORT_W = 600
VIEWPORT_H = 400
FPS = 50
LANDER_POLY = [(-14, +17), (-17, 0), (-17, -10), (+17, -10), (+17, 0), (+14, +17)]
LEG_W, LEG_H = 2, 8  # half of a leg's width and height
