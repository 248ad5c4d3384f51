"""Stock Gymnasium's constants, copied so that drawing does not need Box2D; lengths in pixels."""

SCALE = 30.0  # pixels per metre
VIEWPORT_W = 600
VIEWPORT_H = 400
FPS = 50  # steps per second
LANDER_POLY = [(-14, +17), (-17, 0), (-17, -10), (+17, -10), (+17, 0), (+14, +17)]
LEG_W, LEG_H = 2, 8  # half the width and half the height of a leg
