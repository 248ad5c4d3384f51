"""Records to one page that anyone can open."""
