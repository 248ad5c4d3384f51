"""The world: stock Gymnasium, flights recorded from it, and their pictures."""
