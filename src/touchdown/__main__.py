"""`python -m touchdown` runs the command line."""

from touchdown.cli.app import main

main()
