"""Numbers to Axes: each figure is handed what it draws and computes nothing that others report."""
