"""Flying by physics: the paper's controller and its tuner."""
