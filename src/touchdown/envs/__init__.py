"""Any environment as an agent sees it: making one, a pool of them, a recorded flight."""
