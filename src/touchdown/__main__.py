"""`python -m touchdown` is the command line."""

from touchdown.cli import main

main()
